//! The precision of the edges of boxes.

/// Steps of an edge in a pixel.
const STEPS: f64 = 1000.0;

/// Rounds a coordinate in pixels to thousandths. Boxes have the precision that exported labels have, so that those which
/// nobody corrects keep their edges, and their pairs their results, when the labels are imported.
pub fn rounded_edge(edge: f64) -> f64 {
    (edge * STEPS).round() / STEPS
}
