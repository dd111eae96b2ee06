//! Errors of results against manual alignments, for the pairs that were aligned manually.

use std::collections::BTreeMap;

use serde::Serialize;

use super::ground_truth::MAX_ANGLE_DEG;
use super::pair_artifacts::{PairArtifacts, PairArtifactsError};
use super::stats::{Rate, median, quantile};
use mocban_catalog::{PairResults, StoredAlignment};
use mocban_core::domain::{Affine2, DepthOutcome, Stage, ThresholdMetric};
use mocban_store::Project;

/// One metric's errors against manual alignments.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ManualAlignmentErrors {
    /// Results of pairs with a manual alignment.
    pub n: u64,
    /// Share with an angle error of at most 5 degrees.
    pub angle_le_5deg: Option<f64>,
    /// Median angle error, in degrees.
    pub angle_median_deg: Option<f64>,
    /// 95th percentile of the angle error, in degrees.
    pub angle_p95_deg: Option<f64>,
    /// Median shift of the relief's centre, in percent of the longer side of the relief.
    pub shift_median_pct: Option<f64>,
    /// 95th percentile of the shift, in percent.
    pub shift_p95_pct: Option<f64>,
    /// Median difference in scale, in percent.
    pub scale_median_pct: Option<f64>,
    /// 95th percentile of the difference in scale, in percent.
    pub scale_p95_pct: Option<f64>,
    /// Results that are mirrored relative to the manual alignment. Their angle error counts as 180 degrees.
    pub mirrored: u64,
}

/// How a manual alignment differs from a result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ManualCorrection {
    /// Rotation, in degrees in (-180, 180], clockwise on the screen.
    pub rotation_deg: f64,
    /// Shift of the relief's centre, in print pixels, x right and y down.
    pub shift_px: [f64; 2],
    /// Factor of the scale.
    pub scale: f64,
    /// Whether the relief was also mirrored left to right, before it was rotated.
    pub mirrored: bool,
}

impl ManualCorrection {
    /// Returns the correction that turns `found` into `manual`, or `None` if either map is singular. Both map depth-map
    /// pixels to print pixels.
    pub fn between(found: &Affine2, manual: &Affine2, depth_px: [u32; 2]) -> Option<Self> {
        let depth_from_print = found.inverse()?;
        manual.inverse()?;
        let mirrored = manual.after(&depth_from_print).determinant() < 0.0;
        let unmirrored = if mirrored {
            manual.after(&Affine2::mirror(depth_px[0]))
        } else {
            *manual
        };
        let change = unmirrored.after(&depth_from_print);
        let centre = depth_px.map(|side| (f64::from(side) - 1.0) / 2.0);
        let ([x, y], [u, v]) = (found.apply(centre), manual.apply(centre));
        Some(Self {
            rotation_deg: change.angle_deg(),
            shift_px: [u - x, v - y],
            scale: change.scale(),
            mirrored,
        })
    }
}

/// One result's errors against a manual alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManualErrors {
    /// Rotation, in degrees in 0..=180. It is 180 if the result is mirrored relative to the manual alignment.
    angle_deg: f64,
    /// Shift of the relief's centre, in percent of the relief's longer side.
    shift_pct: f64,
    /// Difference in scale, in percent.
    scale_pct: f64,
    /// Whether one of the two is mirrored.
    mirrored: bool,
}

impl ManualErrors {
    /// Returns the errors of the map `found` against the map `manual`, or `None` if either map is singular.
    fn between(found: &Affine2, manual: &Affine2, depth_px: [u32; 2]) -> Option<Self> {
        let correction = ManualCorrection::between(found, manual, depth_px)?;
        let [x, y] = correction.shift_px;
        let longer = f64::from(depth_px[0].max(depth_px[1]));
        Some(Self {
            angle_deg: if correction.mirrored {
                180.0
            } else {
                correction.rotation_deg.abs()
            },
            shift_pct: 100.0 * x.hypot(y) / (manual.scale() * longer),
            scale_pct: 100.0 * (correction.scale - 1.0).abs(),
            mirrored: correction.mirrored,
        })
    }
}

#[cfg(any(test, feature = "test-helpers"))]
impl ManualErrors {
    /// Returns errors of an unmirrored result.
    pub const fn of(angle_deg: f64, shift_pct: f64, scale_pct: f64) -> Self {
        Self {
            angle_deg,
            shift_pct,
            scale_pct,
            mirrored: false,
        }
    }
}

/// Returns the errors of a pair's results against its manual alignment, by metric.
///
/// # Errors
/// Returns an error if the pair's result of the fit or depth stage cannot be read.
pub fn errors(
    project: &Project,
    pair: &PairResults,
    manual: &StoredAlignment,
) -> Result<BTreeMap<ThresholdMetric, ManualErrors>, PairArtifactsError> {
    if pair.metrics.is_empty() {
        return Ok(BTreeMap::new());
    }
    let artifacts = PairArtifacts::new(project, pair);
    let depth: DepthOutcome = artifacts.outcome(Stage::Depth)?;
    let Some(manual) = artifacts.print_from_depth(&manual.made.print_from_mesh)? else {
        return Ok(BTreeMap::new());
    };
    let outcomes = pair.metrics.iter().map(|record| &record.outcome);
    let size = [depth.width, depth.height];
    Ok(outcomes
        .filter_map(|outcome| {
            let errors = ManualErrors::between(&outcome.print_from_depth, &manual, size)?;
            Some((outcome.metric, errors))
        })
        .collect())
}

impl ManualAlignmentErrors {
    /// Returns the summary of one metric's errors, or `None` if there are no errors.
    pub fn of(found: &[ManualErrors]) -> Option<Self> {
        let median_and_p95 = |read: fn(&ManualErrors) -> f64| -> [Option<f64>; 2] {
            let mut values: Vec<f64> = found.iter().map(read).collect();
            [median(&mut values), quantile(&mut values, 0.95)]
        };
        let rate = |is: fn(&ManualErrors) -> bool| Rate::of(found.iter().map(is));
        let right = rate(|errors| errors.angle_deg <= MAX_ANGLE_DEG);
        let [angle_median_deg, angle_p95_deg] = median_and_p95(|errors| errors.angle_deg);
        let [shift_median_pct, shift_p95_pct] = median_and_p95(|errors| errors.shift_pct);
        let [scale_median_pct, scale_p95_pct] = median_and_p95(|errors| errors.scale_pct);
        (right.n > 0).then_some(Self {
            n: right.n,
            angle_le_5deg: right.share,
            angle_median_deg,
            angle_p95_deg,
            shift_median_pct,
            shift_p95_pct,
            scale_median_pct,
            scale_p95_pct,
            mirrored: rate(|errors| errors.mirrored).count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{ManualAlignmentErrors, ManualCorrection, ManualErrors};
    use mocban_core::domain::Affine2;

    /// Returns the map that places a relief of 101 x 51 px with its centre at (200, 100) + `shift`.
    fn placed(scale: f64, angle_deg: f64, shift: [f64; 2]) -> Affine2 {
        let back = Affine2::scale_shift(1.0, [-50.0, -25.0]);
        let centre = [200.0 + shift[0], 100.0 + shift[1]];
        Affine2::similarity(scale, angle_deg.to_radians(), centre).after(&back)
    }

    fn errors(found: &Affine2) -> ManualErrors {
        let manual = placed(2.0, 30.0, [0.0, 0.0]);
        ManualErrors::between(found, &manual, [101, 51]).expect("neither is singular")
    }

    #[test]
    fn rotation_shift_and_scale_are_separated() {
        let near = |found: ManualErrors, wanted: [f64; 3]| {
            let errors = [found.angle_deg, found.shift_pct, found.scale_pct];
            for (error, wanted) in errors.into_iter().zip(wanted) {
                assert!((error - wanted).abs() < 1e-9, "{found:?}");
            }
        };
        near(errors(&placed(2.0, 30.0, [0.0, 0.0])), [0.0, 0.0, 0.0]);
        near(errors(&placed(2.0, 23.0, [0.0, 0.0])), [7.0, 0.0, 0.0]);
        // 202 px is the relief's longer side on the print.
        near(errors(&placed(2.0, 30.0, [6.06, 8.08])), [0.0, 5.0, 0.0]);
        near(errors(&placed(1.6, 30.0, [0.0, 0.0])), [0.0, 0.0, 25.0]);
        let singular =
            ManualErrors::between(&Affine2([[0.0; 3]; 2]), &placed(1.0, 0.0, [0.0; 2]), [9, 9]);
        assert_eq!(singular, None);
    }

    #[test]
    fn the_rotation_does_not_depend_on_mirroring() {
        let found = placed(2.0, 30.0, [0.0, 0.0]);
        let rotated = placed(2.0, 42.5, [3.0, -4.0]);
        let correction = |manual: &Affine2| {
            ManualCorrection::between(&found, manual, [101, 51]).expect("neither is singular")
        };
        for (manual, mirrored) in [
            (rotated, false),
            (rotated.after(&Affine2::mirror(101)), true),
        ] {
            let moved = correction(&manual);
            assert_eq!(moved.mirrored, mirrored);
            assert!((moved.rotation_deg - 12.5).abs() < 1e-9, "{moved:?}");
            assert!((moved.shift_px[0] - 3.0).abs() < 1e-9, "{moved:?}");
            assert!((moved.shift_px[1] + 4.0).abs() < 1e-9, "{moved:?}");
            assert!((moved.scale - 1.0).abs() < 1e-9, "{moved:?}");
        }
    }

    #[test]
    fn a_mirrored_result_has_the_largest_angle_error() {
        let mut mirrored = placed(2.0, 30.0, [0.0, 0.0]);
        // Top and bottom are swapped, which leaves the x axis where it was.
        mirrored = Affine2([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]).after(&mirrored);
        let found = errors(&mirrored);
        assert_eq!((found.angle_deg, found.mirrored), (180.0, true));
    }

    #[test]
    fn shares_and_percentiles_are_over_the_corrected_pairs() {
        let results = [30.0, 31.0, 34.0, 40.0, 10.0]
            .map(|angle_deg| errors(&placed(2.0, angle_deg, [0.0, 0.0])));
        let found = ManualAlignmentErrors::of(&results).expect("five");
        assert_eq!(
            (found.n, found.angle_le_5deg, found.mirrored),
            (5, Some(0.6), 0)
        );
        let near = |found: Option<f64>, wanted: f64| {
            assert!((found.expect("five") - wanted).abs() < 1e-9, "{found:?}");
        };
        near(found.angle_median_deg, 4.0);
        // NumPy 2 `quantile([0, 1, 4, 10, 20], 0.95)`.
        near(found.angle_p95_deg, 18.0);
        assert_eq!(ManualAlignmentErrors::of(&[]), None);
    }
}
