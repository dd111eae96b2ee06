//! The error of an alignment against ground truth.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use mocban_core::domain::{Affine2, PairName, PrintFromMesh, Rigid3, value_error_text};

/// A result passes only if its angle error is at most this number of degrees (the paper's rule).
pub const MAX_ANGLE_DEG: f64 = 5.0;
/// A result passes only if its mean landmark error is at most this percentage of the character's height.
pub const MAX_TRE_PCT: f64 = 5.0;
/// A result with a mask of true stroke tops passes only if its `mask_iou` is at least this value.
pub const MIN_MASK_IOU: f64 = 0.7;

/// One line of `truth.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TruthRecord {
    /// The pair.
    pub id: PairName,
    /// Maps mesh points to print pixels and the height over the true plane.
    pub print_from_mesh: PrintFromMesh,
    /// The plane of the stroke tops in mesh coordinates.
    pub plane: TruthPlane,
    /// Points on stroke tops, in mesh coordinates.
    pub landmarks: Vec<[f64; 3]>,
    /// Height of the character in the print, in print pixels.
    pub char_height_px: f64,
    /// Path of the mask of the true stroke tops, an image in the print's frame. `None` if there is no mask.
    #[serde(default)]
    pub tops_mask: Option<String>,
    /// Map (3 x 3) from the print's pixels to the page of its block. The catalog sets it when it stores the record of a pair
    /// that was cut from a block.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page_from_crop: Option<[[f64; 3]; 3]>,
}

/// A plane `n . x + d = 0`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TruthPlane {
    /// Unit normal, pointing out of the block.
    pub n: [f64; 3],
    /// Offset, in mesh units.
    pub d: f64,
}

/// Why ground truth cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TruthError {
    /// Not a record of `truth.jsonl`.
    #[error("truth is not of the form of truth.jsonl: {0}")]
    Form(String),
    /// A normal of length 0 or not finite.
    #[error("the true plane's normal {0:?} is no direction")]
    Normal([f64; 3]),
    /// A true map that is singular on the plane.
    #[error("the true print_from_mesh flattens the plane")]
    Flat,
    /// A record without landmarks.
    #[error("the truth has no landmarks")]
    NoLandmarks,
    /// A character height that is not positive.
    #[error("the character's height is {0} px")]
    Height(f64),
    /// A tops mask that cannot be read.
    #[error("the tops mask {0}")]
    Mask(String),
    /// A pair that was cut from a block, and a record that does not say for which crop it is.
    #[error("the truth does not name the crop of the page that it is for; store it again")]
    UnknownCrop,
    /// A box that was moved away from the character.
    #[error("the box was moved away from the character of the truth")]
    OtherCharacter,
    /// A tops mask of another crop of the page.
    #[error("the box was moved, but the mask of its true stroke tops was not")]
    OtherCrop,
    /// A tops mask of another size than the print.
    #[error("the tops mask is {found:?} px, the print {wanted:?} px")]
    MaskSize {
        /// Size of the tops mask.
        found: [usize; 2],
        /// Size of the print.
        wanted: [usize; 2],
    },
}

/// The error of one result against ground truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TruthErrors {
    /// Rotation from the true to the found alignment, in degrees in 0..=180. It is 180 if the character is mirrored.
    pub angle_deg: f64,
    /// Whether the found map mirrors the character.
    pub mirrored: bool,
    /// Mean distance in the print between the true and the found positions of the landmarks (target registration
    /// error), in percent of the character's height.
    pub tre_pct: f64,
    /// Intersection over union of the depth mask and the mask of true stroke tops, in 0..=1. `None`
    /// without a mask of true tops.
    pub mask_iou: Option<f64>,
}

impl TruthErrors {
    /// Returns whether angle, landmarks and mask are all within their limits.
    pub fn pass(&self) -> bool {
        self.angle_deg <= MAX_ANGLE_DEG
            && self.tre_pct <= MAX_TRE_PCT
            && self.mask_iou.is_none_or(|iou| iou >= MIN_MASK_IOU)
    }

    /// Returns the largest of the errors, each divided by its limit. The value is at most 1 if the result passes.
    pub fn severity(&self) -> f64 {
        let mask = self
            .mask_iou
            .map_or(0.0, |iou| (1.0 - iou) / (1.0 - MIN_MASK_IOU));
        (self.angle_deg / MAX_ANGLE_DEG)
            .max(self.tre_pct / MAX_TRE_PCT)
            .max(mask)
    }
}

impl TruthRecord {
    /// Parses a stored record and checks that it is complete enough to measure errors.
    ///
    /// # Errors
    /// Returns an error if the value is not a record, or if its plane, map, landmarks or height are degenerate.
    pub fn read(value: &serde_json::Value) -> Result<Self, TruthError> {
        let record = Self::deserialize(value)
            .map_err(|error| TruthError::Form(value_error_text(&error.to_string())))?;
        let tangents = record.tangents()?;
        if record.landmarks.is_empty() {
            return Err(TruthError::NoLandmarks);
        }
        if !(record.char_height_px > 0.0 && record.char_height_px.is_finite()) {
            return Err(TruthError::Height(record.char_height_px));
        }
        let truth = in_plane(&record.print_from_mesh, tangents).inverse();
        truth.map(|_| record).ok_or(TruthError::Flat)
    }

    /// Measures the errors of the map that an alignment found. `mask_iou` is copied to the result.
    ///
    /// # Errors
    /// Returns an error if the normal of the true plane is zero or not finite, or if the record's `print_from_mesh` is
    /// singular on the plane.
    pub fn measure(
        &self,
        found: &PrintFromMesh,
        mask_iou: Option<f64>,
    ) -> Result<TruthErrors, TruthError> {
        let tangents = self.tangents()?;
        let truth = in_plane(&self.print_from_mesh, tangents);
        let relative = in_plane(found, tangents).after(&truth.inverse().ok_or(TruthError::Flat)?);
        let mirrored = relative.determinant() < 0.0;
        Ok(TruthErrors {
            angle_deg: if mirrored {
                180.0
            } else {
                rotation_deg(&relative)
            },
            mirrored,
            tre_pct: 100.0 * self.landmark_distance_px(found) / self.char_height_px,
            mask_iou,
        })
    }

    /// Returns the angle between the normals of the true and the found plane, in degrees in 0..=180.
    ///
    /// # Errors
    /// Returns an error if the normal of the true plane is zero or not finite.
    pub fn normal_error_deg(&self, plane_from_mesh: &Rigid3) -> Result<f64, TruthError> {
        let [across, down] = self.tangents()?;
        let [x, y, z, _] = plane_from_mesh.0[2];
        let (found, truth) = (Vector3::new(x, y, z), Vector3::from(self.plane.n));
        // The sine resolves small angles, which the cosine does not.
        let sin = found.dot(&across).hypot(found.dot(&down));
        Ok(sin.atan2(found.dot(&truth) / truth.norm()).to_degrees())
    }

    /// Returns the mean distance in print pixels between the true and the found positions of the landmarks.
    fn landmark_distance_px(&self, found: &PrintFromMesh) -> f64 {
        let distances = self.landmarks.iter().map(|point| {
            let ([u, v, _], [p, q, _]) = (self.print_from_mesh.apply(*point), found.apply(*point));
            (u - p).hypot(v - q)
        });
        distances.sum::<f64>() / self.landmarks.len() as f64
    }

    /// Returns two orthonormal directions that span the true plane.
    fn tangents(&self) -> Result<[Vector3<f64>; 2], TruthError> {
        let normal = Vector3::from(self.plane.n);
        let length = normal.norm();
        if !(length > 0.0 && length.is_finite()) {
            return Err(TruthError::Normal(self.plane.n));
        }
        let normal = normal / length;
        let mut axis = Vector3::zeros();
        axis[normal.iamin()] = 1.0;
        let first = normal.cross(&axis).normalize();
        Ok([first, normal.cross(&first)])
    }
}

/// Returns the linear part of `map` on a plane. The part maps coordinates along the `tangents` to print pixels.
fn in_plane(map: &PrintFromMesh, tangents: [Vector3<f64>; 2]) -> Affine2 {
    let row = |r: [f64; 4]| {
        let [a, b] = tangents.map(|t| r[0] * t[0] + r[1] * t[1] + r[2] * t[2]);
        [a, b, 0.0]
    };
    Affine2([row(map.0[0]), row(map.0[1])])
}

/// Returns the angle of the rotation that is closest to the linear part of a map, in degrees in 0..=180.
fn rotation_deg(map: &Affine2) -> f64 {
    let [[a, b, _], [c, d, _]] = map.0;
    (c - b).atan2(a + d).to_degrees().abs()
}

#[cfg(test)]
mod tests {
    use super::{TruthError, TruthErrors, TruthRecord};
    use mocban_core::domain::{Affine2, PrintFromMesh, Rigid3};

    /// A tilted plane seen mirrored, ten pixels a unit.
    fn rotated_map(angle_rad: f64, shift: [f64; 2]) -> (PrintFromMesh, Rigid3) {
        let (s, c) = 0.4_f64.sin_cos();
        let plane_from_mesh = Rigid3::to_frame(
            [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]],
            [5.0, -2.0, 1.0],
        );
        let mirror = Affine2([[-10.0, 0.0, 50.0], [0.0, 10.0, 60.0]]);
        let rotation = Affine2::similarity(1.0, angle_rad, shift);
        (
            PrintFromMesh::new(&rotation, &mirror, &plane_from_mesh),
            plane_from_mesh,
        )
    }

    /// Ground truth with landmarks on a cross of arm 3.
    fn record() -> TruthRecord {
        let (print_from_mesh, plane_from_mesh) = rotated_map(0.0, [0.0, 0.0]);
        let back = plane_from_mesh.inverse();
        let landmarks = [
            [3.0, 0.0, 0.0],
            [-3.0, 0.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, -3.0, 0.0],
        ];
        TruthRecord::read(&serde_json::json!({
            "id": "a",
            "print_from_mesh": print_from_mesh,
            "plane": { "n": [0.4_f64.sin(), 0.0, 0.4_f64.cos()], "d": 0.0 },
            "landmarks": landmarks.map(|point| back.apply(point)),
            "char_height_px": 60.0,
        }))
        .expect("the record is whole")
    }

    fn errors(found: &PrintFromMesh) -> TruthErrors {
        record()
            .measure(found, Some(1.0))
            .expect("the truth is usable")
    }

    #[test]
    fn the_true_map_has_no_error() {
        let found = errors(&rotated_map(0.0, [0.0, 0.0]).0);
        assert!(found.angle_deg < 1e-9 && found.tre_pct < 1e-9 && !found.mirrored);
        assert!(found.pass());
    }

    #[test]
    fn rotation_and_shift_are_measured() {
        let rotated = errors(&rotated_map(7.0_f64.to_radians(), [0.0, 0.0]).0);
        assert!((rotated.angle_deg - 7.0).abs() < 1e-9);
        assert!(!rotated.pass());
        let back = errors(&rotated_map((-4.0_f64).to_radians(), [0.0, 0.0]).0);
        assert!((back.angle_deg - 4.0).abs() < 1e-9);
        let shifted = errors(&rotated_map(0.0, [3.0, 0.0]).0);
        assert!((shifted.tre_pct - 5.0).abs() < 1e-9, "{}", shifted.tre_pct);
        assert!(shifted.angle_deg < 1e-9);
        let upside_down = errors(&rotated_map(std::f64::consts::PI, [0.0, 0.0]).0);
        assert!((upside_down.angle_deg - 180.0).abs() < 1e-9 && !upside_down.mirrored);
    }

    #[test]
    fn normal_error_is_the_tilt_up_to_180_degrees() {
        let record = record();
        let plane = |tilt_rad: f64| {
            let (s, c) = (0.4 + tilt_rad).sin_cos();
            let axes = [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]];
            Rigid3::to_frame(axes, [7.0, 0.0, 0.0])
        };
        let error = |tilt_deg: f64| record.normal_error_deg(&plane(tilt_deg.to_radians()));
        for tilt_deg in [0.0, 1e-6, -3.0, 90.0, 179.0] {
            let found = error(tilt_deg).expect("the truth is usable");
            assert!((found - tilt_deg.abs()).abs() < 1e-9, "{found}");
        }
    }

    #[test]
    fn a_mirrored_map_is_recognized_and_never_passes() {
        let (mut map, _) = rotated_map(0.0, [0.0, 0.0]);
        map.0[0] = map.0[0].map(|value| -value);
        let found = errors(&map);
        assert!(found.mirrored);
        assert_eq!(found.angle_deg, 180.0);
        assert!(!found.pass());
    }

    #[test]
    fn a_poor_mask_fails_and_a_missing_one_does_not() {
        let (map, _) = rotated_map(0.0, [0.0, 0.0]);
        let pass = |iou| record().measure(&map, iou).map(|errors| errors.pass());
        assert_eq!(pass(Some(0.69)), Ok(false));
        assert_eq!(pass(Some(0.7)), Ok(true));
        assert_eq!(pass(None), Ok(true));
        let poor = record()
            .measure(&map, Some(0.4))
            .expect("the truth is usable");
        assert!((poor.severity() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn degenerate_truth_is_refused_with_its_reason() {
        let refuse = |change: fn(&mut TruthRecord)| {
            let mut record = record();
            change(&mut record);
            let value = serde_json::to_value(record).expect("a record is JSON");
            TruthRecord::read(&value).expect_err("the record is degenerate")
        };
        assert_eq!(refuse(|r| r.landmarks.clear()), TruthError::NoLandmarks);
        assert_eq!(refuse(|r| r.char_height_px = 0.0), TruthError::Height(0.0));
        assert_eq!(
            refuse(|r| r.plane.n = [0.0; 3]),
            TruthError::Normal([0.0; 3])
        );
        assert_eq!(
            refuse(|r| r.print_from_mesh.0[1] = [0.0; 4]),
            TruthError::Flat
        );
        let form = TruthRecord::read(&serde_json::json!({ "id": "a" }));
        assert!(matches!(form, Err(TruthError::Form(_))));
    }
}
