//! Correction of a depth map whose stroke tops do not lie on the fitted surface.

use serde::{Deserialize, Serialize};

/// Number of nodes along each side of a coarse grid.
const COARSE_NODES: usize = 4;
/// Number of nodes along each side of a depth map. Each cell of a coarse grid is divided into four.
const NODES: usize = 2 * COARSE_NODES - 1;

/// Smooth heights of the stroke tops over the fitted surface, from which the heights of a levelled depth map are measured.
///
/// The print shows them: a scan that drifts, or that was stitched from views that do not meet, has strokes under solid
/// ink that one threshold of the fitted surface cannot separate from the ground.
///
/// ```
/// use mocban_core::domain::Levelling;
///
/// let mut levelling = Levelling::default();
/// levelling.heights[0] = [0.6; 7];
/// // Nodes lie on the first and the last pixels, and heights between them are interpolated.
/// assert_eq!(levelling.height_at([5.0, 0.0], [61, 61]), 0.6);
/// assert!((levelling.height_at([5.0, 5.0], [61, 61]) - 0.3).abs() < 1e-12);
/// assert_eq!(levelling.height_at([5.0, 60.0], [61, 61]), 0.0);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredLevelling")]
pub struct Levelling {
    /// Heights in mesh units, row by row, at evenly spaced pixels of the depth map from the first to the last.
    pub heights: [[f64; NODES]; NODES],
}

/// A stored levelling. Results of earlier revisions have the heights of a coarse grid.
#[derive(Deserialize)]
struct StoredLevelling {
    heights: Vec<Vec<f64>>,
}

impl TryFrom<StoredLevelling> for Levelling {
    type Error = String;

    fn try_from(stored: StoredLevelling) -> Result<Self, Self::Error> {
        if let Some(coarse) = square(&stored.heights) {
            return Ok(Self::from(coarse));
        }
        let fine = square(&stored.heights).map(|heights| Self { heights });
        fine.ok_or_else(|| format!("a levelling needs {NODES} rows of {NODES} heights"))
    }
}

/// Returns `N` rows of `N` heights; `None` if there are more or fewer.
fn square<const N: usize>(rows: &[Vec<f64>]) -> Option<[[f64; N]; N]> {
    let rows: Vec<[f64; N]> = rows
        .iter()
        .map(|row| row.as_slice().try_into().ok())
        .collect::<Option<_>>()?;
    rows.try_into().ok()
}

impl From<[[f64; COARSE_NODES]; COARSE_NODES]> for Levelling {
    /// Creates the levelling that has the same height everywhere as a coarse grid.
    fn from(coarse: [[f64; COARSE_NODES]; COARSE_NODES]) -> Self {
        let height = |x: usize, y: usize| {
            let [left, right] = [x / 2, x.div_ceil(2)];
            let [above, below] = [y / 2, y.div_ceil(2)];
            let along = |row: usize| coarse[row][left].midpoint(coarse[row][right]);
            along(above).midpoint(along(below))
        };
        Self {
            heights: std::array::from_fn(|y| std::array::from_fn(|x| height(x, y))),
        }
    }
}

impl Levelling {
    /// Number of nodes along each side.
    pub const NODES: usize = NODES;
    /// Number of nodes along each side of a coarse grid, from which a levelling can be made.
    pub const COARSE_NODES: usize = COARSE_NODES;

    /// Returns the height at a pixel of a depth map of this width and height, in mesh units.
    pub fn height_at(&self, px: [f64; 2], size: [usize; 2]) -> f64 {
        self.height_between([0, 1].map(|axis| Self::cell::<NODES>(px[axis], size[axis])))
    }

    /// Returns the height between four nodes, in mesh units. `cells` are the column and the row of the first of them, each with
    /// the offset from it, see [`Self::cell`].
    #[inline]
    pub fn height_between(&self, cells: [(usize, f64); 2]) -> f64 {
        let weights = weights_between(cells);
        weights
            .iter()
            .map(|([x, y], weight)| weight * self.heights[*y][*x])
            .sum()
    }

    /// Returns the column and row of the four nodes around a pixel, and the weight of each, for a grid of `N` x `N` nodes.
    pub fn weights<const N: usize>(px: [f64; 2], size: [usize; 2]) -> [([usize; 2], f64); 4] {
        weights_between([0, 1].map(|axis| Self::cell::<N>(px[axis], size[axis])))
    }

    /// Returns the last of `N` nodes before a place along a side of a depth map, and the offset of the place from it in distances
    /// between nodes, 0..=1. `px` and `side` are in pixels.
    pub fn cell<const N: usize>(px: f64, side: usize) -> (usize, f64) {
        let last = (side.max(2) - 1) as f64;
        let at = (px / last * (N - 1) as f64).clamp(0.0, (N - 1) as f64);
        let first = (at as usize).min(N - 2);
        (first, at - first as f64)
    }
}

/// Returns the column and row of four nodes, and the weight of each.
#[inline]
fn weights_between([(x, u), (y, v)]: [(usize, f64); 2]) -> [([usize; 2], f64); 4] {
    [
        ([x, y], (1.0 - u) * (1.0 - v)),
        ([x + 1, y], u * (1.0 - v)),
        ([x, y + 1], (1.0 - u) * v),
        ([x + 1, y + 1], u * v),
    ]
}

#[cfg(test)]
mod tests {
    use super::{COARSE_NODES, Levelling, NODES};

    #[test]
    fn coarse_heights_of_earlier_results_are_the_same_everywhere() {
        let coarse: [[f64; COARSE_NODES]; COARSE_NODES] =
            std::array::from_fn(|y| std::array::from_fn(|x| (3 * x * x + 5 * y + x * y) as f64));
        let text = serde_json::json!({ "heights": coarse }).to_string();
        let read: Levelling = serde_json::from_str(&text).expect("a coarse grid");
        assert_eq!(read, Levelling::from(coarse));
        let size = [61, 31];
        for (x, y) in (0..61).flat_map(|x| (0..31).map(move |y| (x, y))) {
            let px = [f64::from(x), f64::from(y)];
            let nodes = Levelling::weights::<COARSE_NODES>(px, size);
            let wanted: f64 = nodes.iter().map(|([x, y], w)| w * coarse[*y][*x]).sum();
            let found = read.height_at(px, size);
            assert!((found - wanted).abs() < 1e-9, "{px:?}: {found}, {wanted}");
        }
        let text = serde_json::to_string(&read).expect("a levelling");
        assert_eq!(serde_json::from_str::<Levelling>(&text).ok(), Some(read));
        let uneven = [[0.0; NODES]; COARSE_NODES];
        let other = serde_json::json!({ "heights": uneven });
        let error = serde_json::from_value::<Levelling>(other).expect_err("rows of other lengths");
        assert!(error.to_string().contains("7 rows of 7"), "{error}");
    }
}
