//! Correction of a depth map whose stroke tops do not lie on the fitted surface.

use serde::{Deserialize, Serialize};

/// Number of nodes along each side of a depth map.
const NODES: usize = 4;

/// Smooth heights of the stroke tops over the fitted surface, from which the heights of a levelled depth map are measured.
///
/// The print shows them: a scan that drifts, or that was stitched from views that do not meet, has strokes under solid
/// ink that one threshold of the fitted surface cannot separate from the ground.
///
/// ```
/// use mocban_core::domain::Levelling;
///
/// let mut levelling = Levelling::default();
/// levelling.heights[0] = [0.6; 4];
/// // Nodes lie on the first and the last pixels, and heights between them are interpolated.
/// assert_eq!(levelling.height_at([5.0, 0.0], [61, 61]), 0.6);
/// assert!((levelling.height_at([5.0, 10.0], [61, 61]) - 0.3).abs() < 1e-12);
/// assert_eq!(levelling.height_at([5.0, 60.0], [61, 61]), 0.0);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Levelling {
    /// Heights in mesh units, row by row, at evenly spaced pixels of the depth map from the first to the last.
    pub heights: [[f64; NODES]; NODES],
}

impl Levelling {
    /// Number of nodes along each side.
    pub const NODES: usize = NODES;

    /// Returns the height at a pixel of a depth map of this width and height, in mesh units.
    pub fn height_at(&self, px: [f64; 2], size: [usize; 2]) -> f64 {
        let weights = Self::weights(px, size);
        weights
            .iter()
            .map(|([x, y], weight)| weight * self.heights[*y][*x])
            .sum()
    }

    /// Returns the column and row of the four nodes around a pixel, and the weight of each.
    pub fn weights(px: [f64; 2], size: [usize; 2]) -> [([usize; 2], f64); 4] {
        let along = |axis: usize| {
            let last = (size[axis].max(2) - 1) as f64;
            let at = (px[axis] / last * (NODES - 1) as f64).clamp(0.0, (NODES - 1) as f64);
            let first = (at as usize).min(NODES - 2);
            (first, at - first as f64)
        };
        let ((x, u), (y, v)) = (along(0), along(1));
        [
            ([x, y], (1.0 - u) * (1.0 - v)),
            ([x + 1, y], u * (1.0 - v)),
            ([x, y + 1], (1.0 - u) * v),
            ([x + 1, y + 1], u * v),
        ]
    }
}
