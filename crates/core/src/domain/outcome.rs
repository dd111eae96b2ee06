//! The numeric results of the stages. Images are stored separately, as artifacts.
//!
//! Outcomes are stored as JSON with exact numbers, so that a resumed run computes the same results.

use std::num::{NonZeroU32, NonZeroU64};

use serde::{Deserialize, Serialize};

use super::{
    Affine2, DisplacedPart, LengthUnit, Levelling, MaskReduction, MaskScale, MeshLosses,
    PrintOutline, Rigid3, ThresholdMetric,
};

/// The curved surface of the stroke tops. All lengths are in mesh units.
///
/// The height over the plane is `z = c[0] + c[1] x + c[2] y + c[3] x^2 + c[4] x y + c[5] y^2`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Curvature(pub [f64; 6]);

impl Curvature {
    /// Returns the height of the surface at a point of the plane, in mesh units.
    ///
    /// # Examples
    /// ```
    /// use mocban_core::domain::Curvature;
    ///
    /// let curvature = Curvature([0.0, 0.0, 0.0, 0.5, 0.0, 0.0]);
    /// assert_eq!(curvature.height(2.0, 9.0), 2.0);
    /// ```
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let c = &self.0;
        c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y
    }
}

/// Evidence for the side of the plane that was chosen as the carved one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SideEvidence {
    /// Fraction of the faces that are wound outward on the chosen side, weighted by projected area, 0..=1. `None` if
    /// there are no faces, and under the paper's method.
    pub winding: Option<f64>,
    /// Fraction of the visible area that lies close to the surface fitted to the chosen side, 0..=1. The paper's method
    /// stores `|a - b| / (a + b)` instead, where `a` and `b` measure the two sides: the mean distance of a side's
    /// points from their centroid.
    pub flatness: f64,
    /// Confidence of the choice, from 0 (a guess) to 1.
    pub confidence: f64,
}

/// A box around the part of a scan that shows the character. Tables, spikes and neighbours lie outside.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScanRegion {
    /// Maps mesh coordinates to the frame of the box, in mesh units.
    pub box_from_mesh: Rigid3,
    /// Lowest and highest x, y and z in the box.
    pub bounds: [[f64; 3]; 2],
}

impl ScanRegion {
    /// Returns whether a point of the mesh lies in the box.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let [low, high] = self.bounds;
        let at = self.box_from_mesh.apply(point);
        (0..3).all(|k| (low[k]..=high[k]).contains(&at[k]))
    }
}

/// Numeric result of the fit stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitOutcome {
    /// Maps mesh coordinates to the right-handed plane frame, in mesh units. The z axis points out of the block.
    pub plane_from_mesh: Rigid3,
    /// Curved surface of the stroke tops. `None` if the block is flat.
    #[serde(rename = "bow")]
    pub curvature: Option<Curvature>,
    /// Largest minus smallest height of the curved surface within the scan's bounds, in mesh units; 0 for a flat block.
    #[serde(rename = "bow_height")]
    pub curvature_height: f64,
    /// Fraction of the sampled points that are inliers of the fitted surface, 0..=1.
    pub inlier_ratio: f64,
    /// Root mean square distance of the inliers to the surface, in mesh units.
    pub rms: f64,
    /// Depth of the carving under the surface, in mesh units.
    pub relief: f64,
    /// Evidence for the chosen side.
    pub side: SideEvidence,
    /// The part of the scan that shows the character. `None` for the whole scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<ScanRegion>,
    /// The part of the print that shows the character. `None` for the whole print.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub print_outline: Option<PrintOutline>,
    /// Number of vertices in the file, duplicates included.
    pub vertices: u64,
    /// Number of triangles in the file; 0 for a point set.
    pub triangles: u64,
    /// Number of vertices of the file that were left out because they have no position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing_vertices: Option<NonZeroU64>,
    /// Number of faces of the file that were left out because they have fewer than three corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub incomplete_faces: Option<NonZeroU64>,
}

impl FitOutcome {
    /// Returns what was left out of the file's mesh.
    pub fn losses(&self) -> MeshLosses {
        let number = |found: Option<NonZeroU64>| found.map_or(0, NonZeroU64::get);
        MeshLosses {
            missing_vertices: number(self.missing_vertices),
            incomplete_faces: number(self.incomplete_faces),
        }
    }
}

/// Conversion of levels and pixels of a depth map to mesh units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepthScale {
    /// Height of level 1 over the fitted surface, in mesh units.
    pub height_min: f64,
    /// Height between two levels, in mesh units.
    pub height_per_level: f64,
    /// Side of a pixel, in mesh units.
    pub mesh_unit_per_px: f64,
    /// Maps plane x, y to depth-map pixels. Includes a reflection, so that the depth map reads like the print.
    pub depth_from_plane: Affine2,
    /// Curved surface from which heights are measured; `None` for the plane.
    #[serde(rename = "bow")]
    pub curvature: Option<Curvature>,
    /// Unit of the mesh, if known.
    pub unit: Option<LengthUnit>,
}

impl DepthScale {
    /// Returns the height over the fitted surface, in mesh units, of a depth-map level 1..=65535.
    pub fn height(&self, level: u16) -> f64 {
        self.height_min + f64::from(level.saturating_sub(1)) * self.height_per_level
    }
}

/// Numeric result of the depth stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepthOutcome {
    /// Width of the map in pixels.
    pub width: u32,
    /// Height of the map in pixels.
    pub height: u32,
    /// Conversion of levels and pixels to mesh units.
    pub scale: DepthScale,
    /// Fraction of pixels with data, 0..=1.
    pub coverage: f64,
}

/// The threshold that a metric selected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThresholdChoice {
    /// The metric.
    pub metric: ThresholdMetric,
    /// Lowest depth-map level that counts as stroke.
    pub level: u16,
    /// Score of the metric at this level.
    pub score: f64,
    /// Whether the best level is the first or the last of the searched range.
    pub at_bound: bool,
}

/// One interpretation of the print as ink and background. A print has several interpretations if its polarity or its
/// stains are ambiguous. The register stage selects one of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct InkHypothesis {
    /// Grey level (0..=65535) between ink and background.
    pub threshold_print: f64,
    /// Whether the print is light on dark, like a rubbing.
    pub light_on_dark: bool,
    /// Maps print pixels to canvas pixels. The longest side of the ink's bounding box gets a fixed length, and the
    /// centroid of the ink is at the centre of the canvas.
    pub canvas_from_print: Affine2,
}

/// Heights of stroke tops and background over the fitted surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReliefHeights {
    /// Height at which most of the stroke tops lie, in mesh units.
    pub top: f64,
    /// Median height of the carved background, in mesh units.
    pub ground: f64,
    /// Depth below `top` at which the stroke tops end and the walls begin, as a fraction of [`Self::depth`].
    pub tops_end: f64,
    /// Standard deviation of the logarithm of [`Self::tops_end`]: about 0.1 on new blocks, and above 0.5 where wear has
    /// rounded the strokes.
    #[serde(default)]
    pub tops_end_log_deviation: f64,
}

impl ReliefHeights {
    /// Returns the depth of the carving, `top - ground`, in mesh units.
    pub fn depth(&self) -> f64 {
        self.top - self.ground
    }

    /// Returns the depth-map level, 1..=65535, of the height `top - share * depth`.
    ///
    /// # Examples
    /// ```
    /// use mocban_core::domain::{Affine2, DepthScale, ReliefHeights};
    ///
    /// let relief = ReliefHeights {
    ///     top: 0.0,
    ///     ground: -1.0,
    ///     tops_end: 0.08,
    ///     tops_end_log_deviation: 0.1,
    /// };
    /// let scale = DepthScale {
    ///     height_min: -1.0,
    ///     height_per_level: 0.001,
    ///     mesh_unit_per_px: 0.02,
    ///     depth_from_plane: Affine2::IDENTITY,
    ///     curvature: None,
    ///     unit: None,
    /// };
    /// let level = relief.level_at(&scale, relief.tops_end);
    /// assert!((scale.height(level) - -0.08).abs() < 0.001);
    /// ```
    pub fn level_at(&self, scale: &DepthScale, share: f64) -> u16 {
        let height = self.top - share * self.depth();
        let steps = (height - scale.height_min) / scale.height_per_level;
        (1.0 + steps.round()).clamp(1.0, 65_535.0) as u16
    }
}

/// Numeric result of the normalize stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NormalizeOutcome {
    /// Side of the square canvas in pixels.
    pub canvas_px: u32,
    /// Interpretations of the print, most likely first; at least one.
    pub inks: Vec<InkHypothesis>,
    /// Heights from which the soft stroke mask is computed; `None` under the paper's method.
    pub relief: Option<ReliefHeights>,
    /// Thresholds selected before registration. The paper's method selects one for each of its metrics except the
    /// ensemble. The default method selects none.
    pub thresholds: Vec<ThresholdChoice>,
    /// EXIF orientation of the print (2 to 8), if its pixels were turned to make it upright.
    #[serde(
        default,
        rename = "print_turned",
        skip_serializing_if = "Option::is_none"
    )]
    pub print_orientation: Option<u8>,
    /// Name of the colour profile of the print, if it could not be applied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ignored_profile: Option<String>,
    /// How many times the masks of a small print are larger than the print, on each side. `None` if they are not larger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub print_enlargement: Option<NonZeroU32>,
    /// How the masks of a large print are reduced. `None` if they are not smaller than the print.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub print_reduction: Option<MaskReduction>,
}

impl NormalizeOutcome {
    /// Returns the size of the masks relative to the print.
    pub fn mask_scale(&self) -> MaskScale {
        match (self.print_reduction, self.print_enlargement) {
            (Some(reduction), _) => MaskScale::Reduced(reduction),
            (None, Some(times)) => MaskScale::enlarged(times.get()),
            (None, None) => MaskScale::Same,
        }
    }
}

/// Similarity of the print mask and the depth mask of a metric on the canvas. See `stages::score` for the formulas.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Structural similarity (Wang et al. 2004), by default with Gaussian windows.
    pub ssim: f64,
    /// Structural similarity without the luminance factor.
    pub nl_ssim: f64,
    /// Intersection over union of the masks by pixel.
    pub iou: f64,
    /// Intersection over union of the masks' bounding boxes.
    pub iou_box: f64,
    /// Dice coefficient of the masks by pixel.
    pub dice: f64,
    /// Fraction of the canvas that is ink.
    pub density_print: f64,
    /// Fraction of the canvas that is stroke top.
    pub density_depth: f64,
}

/// Where the mask of a metric and the ink disagree by more than the spread of the ink explains. See
/// `stages::register::StrokeMap` for the tolerances.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Disagreement {
    /// Number of connected pieces of stroke tops without ink and of ink without wood.
    pub pieces: u32,
    /// Area of the stroke tops without ink, as a fraction of the mask's area.
    pub missing_ink: f64,
    /// Area of the ink without wood, as a fraction of the ink's area.
    pub missing_wood: f64,
}

/// Similarity of relief and print at the best pose, compared with competing poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseFeatures {
    /// Normalized correlation of relief and ink where both images have data, at most 1.
    pub correlation: f64,
    /// Fraction of the stroke tops that are covered by ink, 0..=1.
    pub tops_covered: f64,
    /// Fraction of the ink that is covered by stroke tops, 0..=1.
    pub ink_covered: f64,
    /// Score of the best pose at a different angle, divided by the score of the best pose.
    pub other_angle: f64,
    /// Score of the best pose of the mirrored relief, divided by the score of the best pose.
    pub mirrored: f64,
    /// Sensitivity of the pose to its start. The pose is refined from three starts with slightly different sizes. Two
    /// results differ by the mean distance between their depth-map corners. This is the largest difference from the
    /// best result, as a fraction of the map's longest side.
    #[serde(default)]
    pub spread: f64,
    /// Area of the largest connected piece of stroke tops without ink, in squares of the stroke width.
    #[serde(default, rename = "tops_alone")]
    pub unmatched_tops: f64,
    /// Area of the largest connected piece of ink without wood, in squares of the stroke width.
    #[serde(default, rename = "ink_alone")]
    pub unmatched_ink: f64,
    /// Mean deviation between the edges of ink and stroke tops, after the spread of the ink, as a fraction of the
    /// stroke width.
    #[serde(default)]
    pub edge_scatter: f64,
    /// Area of the ink, in squares of the stroke width: how many strokes the print shows.
    #[serde(default)]
    pub ink_area: f64,
}

/// Alignment and scores of one metric: one row of the catalog and of the export.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MetricOutcome {
    /// The metric.
    pub metric: ThresholdMetric,
    /// Lowest depth-map level that counts as stroke.
    pub threshold_level: u16,
    /// Height of this level over the fitted surface, in mesh units.
    pub threshold_depth: f64,
    /// Maps depth-map pixels to print pixels.
    pub print_from_depth: Affine2,
    /// Rotation of the depth map onto the print in degrees, in (-180, 180], positive clockwise on the screen.
    pub angle_deg: f64,
    /// Print pixels per depth-map pixel.
    pub scale: f64,
    /// Position of the depth map's centre relative to the centre of the print, in print pixels.
    pub shift_px: [f64; 2],
    /// Similarity of the masks on the canvas.
    pub scores: Scores,
    /// Where mask and ink disagree.
    pub disagreement: Disagreement,
    /// Score of the best pose minus the score of the best competing pose.
    pub margin: f64,
    /// Calibrated probability, 0..=1, that the alignment is correct: the angle error is at most 5 degrees, and the
    /// landmark error is at most 5 % of the character's height. `None` under the paper's method.
    pub confidence: Option<f64>,
    /// Whether the search for the scale or for the threshold ended at a limit of its range.
    pub at_bound: bool,
}

impl MetricOutcome {
    /// Results with a confidence below this value should be checked before use.
    pub const LOW_CONFIDENCE: f64 = 0.5;

    /// Returns whether the confidence is known and below [`Self::LOW_CONFIDENCE`].
    pub fn is_low_confidence(&self) -> bool {
        self.confidence
            .is_some_and(|confidence| confidence < Self::LOW_CONFIDENCE)
    }
}

/// Numeric result of the register stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegisterOutcome {
    /// Index of the selected interpretation of the print in [`NormalizeOutcome::inks`].
    pub ink: usize,
    /// One result per metric of the method, in the order of [`ThresholdMetric::ALL`].
    pub metrics: Vec<MetricOutcome>,
    /// Features of the pose, which is the same for all metrics. `None` under the paper's method.
    #[serde(default)]
    pub features: Option<PoseFeatures>,
    /// Correction of the depth map to which the thresholds refer. `None` if one threshold fits the whole character.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levelling: Option<Levelling>,
    /// The part of the print with a pose of its own. `None` if one pose fits the whole print.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displaced: Option<DisplacedPart>,
}
