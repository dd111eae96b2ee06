//! Plausible values for unit tests.

use super::{Affine2, Disagreement, MetricOutcome, Scores, ThresholdMetric};

/// Returns an outcome with the given `IoU`, the matching Dice and no confidence.
pub fn metric_outcome(metric: ThresholdMetric, iou: f64) -> MetricOutcome {
    MetricOutcome {
        metric,
        threshold_level: 30_000,
        threshold_depth: -0.25,
        print_from_depth: Affine2::similarity(0.5, 0.1, [3.0, 4.0]),
        angle_deg: 0.1_f64.to_degrees(),
        scale: 0.5,
        shift_px: [1.5, -2.5],
        scores: Scores {
            ssim: 0.81,
            nl_ssim: 0.82,
            iou,
            iou_box: 0.9,
            dice: 2.0 * iou / (1.0 + iou),
            density_print: 0.2,
            density_depth: 0.21,
        },
        disagreement: Disagreement {
            pieces: 3,
            missing_ink: 0.04,
            missing_wood: 0.02,
        },
        margin: 0.3,
        confidence: None,
        at_bound: false,
    }
}
