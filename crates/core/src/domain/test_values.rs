//! Plausible values for unit tests.

use super::{
    Affine2, Disagreement, FitOutcome, MetricOutcome, Rigid3, Scores, SideEvidence, ThresholdMetric,
};

/// Returns a sure fit of a flat block with a relief of one mesh unit, to the whole scan and the whole print.
pub fn flat_fit(plane_from_mesh: Rigid3) -> FitOutcome {
    FitOutcome {
        plane_from_mesh,
        curvature: None,
        curvature_height: 0.0,
        inlier_ratio: 1.0,
        rms: 0.0,
        relief: 1.0,
        side: SideEvidence {
            winding: None,
            flatness: 1.0,
            confidence: 1.0,
        },
        region: None,
        print_outline: None,
        vertices: 0,
        triangles: 0,
        missing_vertices: None,
        incomplete_faces: None,
    }
}

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
