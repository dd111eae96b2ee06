//! Artifact roles: the purpose of each file that a stage produces.

use super::ThresholdMetric;

/// Depth map with 16 bits per pixel, written by the depth stage.
pub const DEPTH: &str = "depth.png";
/// Ink mask on the canvas, written by register: 255 is ink.
pub const CANVAS_PRINT_MASK: &str = "canvas_print_mask.png";

/// Returns the role of the ink mask for interpretation `ink` of the print, counted from 0. Normalize writes the mask in
/// the frame of the print, in the size of `NormalizeOutcome::mask_scale`: 255 is ink, 64 is a
/// speck, 0 is background and 128 is unknown. Register stores the interpretation that it selects in
/// `RegisterOutcome::ink`.
pub fn print_mask(ink: usize) -> String {
    match ink {
        0 => "print_mask.png".to_owned(),
        other => format!("print_mask_{other}.png"),
    }
}

/// Returns the role of the map of missing ink and missing wood of a metric. Register writes the map on the canvas: 0
/// where mask and ink agree, 128 where ink is missing, 255 where wood is missing.
pub fn stroke_map(metric: ThresholdMetric) -> String {
    format!("stroke_map.{metric}.png")
}

/// Returns the role of a metric's stroke mask on the canvas. Register writes the mask: 255 is stroke.
pub fn canvas_depth_mask(metric: ThresholdMetric) -> String {
    format!("canvas_depth_mask.{metric}.png")
}
