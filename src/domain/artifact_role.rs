//! Roles of artifacts: what a file that a stage left behind is for.

use super::ThresholdMetric;

/// The depth map, 16 bits a pixel; from the depth stage.
pub const DEPTH: &str = "depth.png";
/// The print's ink in the print image's frame: 255 ink, 0 paper, 128 where nothing is known; from normalize.
pub const PRINT_MASK: &str = "print_mask.png";
/// The print mask on the canvas: 255 ink; from register.
pub const CANVAS_PRINT_MASK: &str = "canvas_print_mask.png";

/// A metric's depth mask on the canvas: 255 stroke; from register.
pub fn canvas_depth_mask(metric: ThresholdMetric) -> String {
    format!("canvas_depth_mask.{metric}.png")
}
