//! Small values for tests of the runner.

use serde_json::Map;

use crate::catalog::PairAttributes;
use crate::domain::{Affine2, MetricOutcome, PairName, Scores, ThresholdMetric};

/// Returns a pair without optional attributes.
pub(in crate::runner) fn pair_attributes(mesh_path: &str, print_path: &str) -> PairAttributes {
    PairAttributes {
        name: PairName::new("1").expect("a pair's name"),
        mesh_path: mesh_path.to_owned(),
        print_path: print_path.to_owned(),
        unit: None,
        scanned_face_down: None,
        character: None,
        block: None,
        meta: Map::new(),
    }
}

/// Returns a metric with plausible numbers.
pub(in crate::runner) fn metric_outcome(metric: ThresholdMetric) -> MetricOutcome {
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
            iou: 0.5,
            iou_box: 0.9,
            dice: 2.0 / 3.0,
            density_print: 0.2,
            density_depth: 0.21,
        },
        margin: 0.3,
        confidence: None,
        at_bound: false,
    }
}
