//! The automatic results against the alignments that people made by hand, on the pairs that have one.

use std::collections::BTreeMap;

use serde::Serialize;

use super::accumulate::share;
use super::ground_truth::MAX_ANGLE_DEG;
use super::pair_artifacts::{PairArtifacts, PairArtifactsError};
use super::stats::{median, quantile};
use crate::catalog::{PairResults, StoredAlignment};
use crate::domain::{Affine2, DepthOutcome, Stage, ThresholdMetric};
use crate::store::Project;

/// How far one metric's results lie from the alignments by hand.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ManualAlignmentErrors {
    /// Results that have an alignment by hand.
    pub n: u64,
    /// Share turned by at most 5 degrees against it.
    pub angle_le_5deg: Option<f64>,
    /// Median turn against it, degrees.
    pub angle_median_deg: Option<f64>,
    /// 95th percentile of the turn, degrees.
    pub angle_p95_deg: Option<f64>,
    /// Median shift of the relief's centre, percent of the relief's longer side.
    pub shift_median_pct: Option<f64>,
    /// 95th percentile of the shift, percent.
    pub shift_p95_pct: Option<f64>,
    /// Median difference in scale, percent.
    pub scale_median_pct: Option<f64>,
    /// 95th percentile of the difference in scale, percent.
    pub scale_p95_pct: Option<f64>,
    /// Results in mirror writing against it; they count as turned by 180 degrees.
    pub mirrored: u64,
}

/// What somebody did who laid a relief anew.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ManualCorrection {
    /// By how much it was turned, degrees in (-180, 180], clockwise on the screen.
    pub turned_deg: f64,
    /// By how much its centre was shifted, print pixels, x right and y down.
    pub shifted_px: [f64; 2],
    /// By what it was enlarged.
    pub scaled: f64,
    /// Whether it was mirrored as well, left and right of the relief before it was turned.
    pub mirrored: bool,
}

impl ManualCorrection {
    /// From one way of laying a relief of so many pixels on its print to another; `None` when one flattens it.
    pub fn between(found: &Affine2, by_hand: &Affine2, depth_px: [u32; 2]) -> Option<Self> {
        let back = found.inverse()?;
        by_hand.inverse()?;
        let mirrored = by_hand.after(&back).determinant() < 0.0;
        let read_alike = if mirrored {
            by_hand.after(&Affine2::mirror(depth_px[0]))
        } else {
            *by_hand
        };
        let turn = read_alike.after(&back);
        let centre = depth_px.map(|side| (f64::from(side) - 1.0) / 2.0);
        let ([x, y], [u, v]) = (found.apply(centre), by_hand.apply(centre));
        Some(Self {
            turned_deg: turn.angle_deg(),
            shifted_px: [u - x, v - y],
            scaled: turn.scale(),
            mirrored,
        })
    }
}

/// One result's distance from the alignment by hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManualErrors {
    /// Turn, degrees in 0..=180; 180 when mirrored.
    angle_deg: f64,
    /// Shift of the relief's centre, percent of its longer side.
    shift_pct: f64,
    /// Difference in scale, percent.
    scale_pct: f64,
    /// Whether one of the two reads in mirror writing.
    mirrored: bool,
}

impl ManualErrors {
    /// Between two ways of laying a relief of so many pixels on its print; `None` when one flattens it.
    fn between(found: &Affine2, by_hand: &Affine2, depth_px: [u32; 2]) -> Option<Self> {
        let moved = ManualCorrection::between(found, by_hand, depth_px)?;
        let [x, y] = moved.shifted_px;
        let longer = f64::from(depth_px[0].max(depth_px[1]));
        Some(Self {
            angle_deg: if moved.mirrored {
                180.0
            } else {
                moved.turned_deg.abs()
            },
            shift_pct: 100.0 * x.hypot(y) / (by_hand.scale() * longer),
            scale_pct: 100.0 * (moved.scaled - 1.0).abs(),
            mirrored: moved.mirrored,
        })
    }
}

/// The distances of a pair's results from its alignment by hand, by metric.
///
/// # Errors
/// When its results of fit or depth cannot be read.
pub(super) fn errors(
    project: &Project,
    pair: &PairResults,
    by_hand: &StoredAlignment,
) -> Result<BTreeMap<ThresholdMetric, ManualErrors>, PairArtifactsError> {
    if pair.metrics.is_empty() {
        return Ok(BTreeMap::new());
    }
    let aligned = PairArtifacts::new(project, pair);
    let depth: DepthOutcome = aligned.outcome(Stage::Depth)?;
    let Some(laid) = aligned.print_from_depth(&by_hand.made.print_from_mesh)? else {
        return Ok(BTreeMap::new());
    };
    let outcomes = pair.metrics.iter().map(|record| &record.outcome);
    let size = [depth.width, depth.height];
    Ok(outcomes
        .filter_map(|outcome| {
            let errors = ManualErrors::between(&outcome.print_from_depth, &laid, size)?;
            Some((outcome.metric, errors))
        })
        .collect())
}

/// The distances so far of one metric.
#[derive(Debug, Clone, Default)]
pub(super) struct ManualErrorSums(Vec<ManualErrors>);

impl ManualErrorSums {
    /// Counts one result in.
    pub(super) fn add(&mut self, errors: ManualErrors) {
        self.0.push(errors);
    }

    /// What follows; `None` without any alignment by hand.
    pub(super) fn finish(self) -> Option<ManualAlignmentErrors> {
        let n = self.0.len() as u64;
        let of = |read: fn(&ManualErrors) -> f64| -> [Option<f64>; 2] {
            let mut values: Vec<f64> = self.0.iter().map(read).collect();
            [median(&mut values), quantile(&mut values, 0.95)]
        };
        let count = |is: fn(&ManualErrors) -> bool| self.0.iter().filter(|one| is(one)).count();
        let right = count(|errors| errors.angle_deg <= MAX_ANGLE_DEG);
        let [angle_median_deg, angle_p95_deg] = of(|errors| errors.angle_deg);
        let [shift_median_pct, shift_p95_pct] = of(|errors| errors.shift_pct);
        let [scale_median_pct, scale_p95_pct] = of(|errors| errors.scale_pct);
        (n > 0).then(|| ManualAlignmentErrors {
            n,
            angle_le_5deg: share(right as f64, n),
            angle_median_deg,
            angle_p95_deg,
            shift_median_pct,
            shift_p95_pct,
            scale_median_pct,
            scale_p95_pct,
            mirrored: count(|errors| errors.mirrored) as u64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{ManualCorrection, ManualErrorSums, ManualErrors};
    use crate::domain::Affine2;

    /// A relief of 101 x 51 px laid with its centre at (200, 100).
    fn laid(scale: f64, angle_deg: f64, shift: [f64; 2]) -> Affine2 {
        let back = Affine2::scale_shift(1.0, [-50.0, -25.0]);
        let centre = [200.0 + shift[0], 100.0 + shift[1]];
        Affine2::similarity(scale, angle_deg.to_radians(), centre).after(&back)
    }

    fn errors(found: &Affine2) -> ManualErrors {
        let by_hand = laid(2.0, 30.0, [0.0, 0.0]);
        ManualErrors::between(found, &by_hand, [101, 51]).expect("neither is flat")
    }

    #[test]
    fn turn_shift_and_scale_are_told_apart() {
        let near = |found: ManualErrors, wanted: [f64; 3]| {
            let told = [found.angle_deg, found.shift_pct, found.scale_pct];
            for (told, wanted) in told.into_iter().zip(wanted) {
                assert!((told - wanted).abs() < 1e-9, "{found:?}");
            }
        };
        near(errors(&laid(2.0, 30.0, [0.0, 0.0])), [0.0, 0.0, 0.0]);
        near(errors(&laid(2.0, 23.0, [0.0, 0.0])), [7.0, 0.0, 0.0]);
        // 202 px is the relief's longer side on the print.
        near(errors(&laid(2.0, 30.0, [6.06, 8.08])), [0.0, 5.0, 0.0]);
        near(errors(&laid(1.6, 30.0, [0.0, 0.0])), [0.0, 0.0, 25.0]);
        let flat =
            ManualErrors::between(&Affine2([[0.0; 3]; 2]), &laid(1.0, 0.0, [0.0; 2]), [9, 9]);
        assert_eq!(flat, None);
    }

    #[test]
    fn a_turn_is_told_the_same_whether_the_relief_was_mirrored_or_not() {
        let found = laid(2.0, 30.0, [0.0, 0.0]);
        let turned = laid(2.0, 42.5, [3.0, -4.0]);
        let moved = |by_hand: &Affine2| {
            ManualCorrection::between(&found, by_hand, [101, 51]).expect("neither is flat")
        };
        for (by_hand, mirrored) in [(turned, false), (turned.after(&Affine2::mirror(101)), true)] {
            let told = moved(&by_hand);
            assert_eq!(told.mirrored, mirrored);
            assert!((told.turned_deg - 12.5).abs() < 1e-9, "{told:?}");
            assert!((told.shifted_px[0] - 3.0).abs() < 1e-9, "{told:?}");
            assert!((told.shifted_px[1] + 4.0).abs() < 1e-9, "{told:?}");
            assert!((told.scaled - 1.0).abs() < 1e-9, "{told:?}");
        }
    }

    #[test]
    fn a_mirrored_result_is_as_far_off_as_can_be() {
        let mut mirrored = laid(2.0, 30.0, [0.0, 0.0]);
        // Up and down change places, so that the x axis stays where it was.
        mirrored = Affine2([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]).after(&mirrored);
        let found = errors(&mirrored);
        assert_eq!((found.angle_deg, found.mirrored), (180.0, true));
    }

    #[test]
    fn the_share_within_five_degrees_is_of_those_corrected() {
        let mut sums = ManualErrorSums::default();
        for angle_deg in [30.0, 31.0, 34.0, 40.0, 10.0] {
            sums.add(errors(&laid(2.0, angle_deg, [0.0, 0.0])));
        }
        let found = sums.finish().expect("five");
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
        assert_eq!(ManualErrorSums::default().finish(), None);
    }
}
