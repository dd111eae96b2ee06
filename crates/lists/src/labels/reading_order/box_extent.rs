//! A box reduced to its centre and size.

use std::ops::RangeInclusive;

/// Share of boxes that may be larger than characters; one may be in any case.
const TOO_LARGE: f64 = 0.04;
/// Boxes below this share of the largest of the others do not count for the usual size.
const SMALLEST_FULL: f64 = 0.6;
/// Boxes below this share of the usual size are small.
const SMALL: f64 = 0.7;
/// Sizes of characters in the size of notes.
const LARGE: RangeInclusive<f64> = 1.6..=3.5;
/// Smallest number of columns in which characters stand among notes.
const MIN_COLUMNS: usize = 3;

/// Centre and size of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoxExtent {
    /// Centre, to the right.
    pub(super) u: f64,
    /// Centre, downwards.
    pub(super) v: f64,
    /// The larger of width and height.
    pub(super) size: f64,
    pub(super) height: f64,
}

impl BoxExtent {
    /// Returns centre and size of a box from left, top, right and bottom.
    pub(super) fn of(bounds: [f64; 4]) -> Self {
        // Larger values would overflow when they are squared.
        let finite = |edge: f64| {
            if edge.is_finite() {
                edge.clamp(-1e100, 1e100)
            } else {
                0.0
            }
        };
        let [x0, y0, x1, y1] = bounds.map(finite);
        let (width, height) = ((x1 - x0).abs(), (y1 - y0).abs());
        Self {
            u: f64::midpoint(x0, x1),
            v: f64::midpoint(y0, y1),
            size: width.max(height),
            height,
        }
    }

    /// Returns whether the box is small, such as a note, if full boxes have this size.
    pub(super) fn is_small(&self, full_size: f64) -> bool {
        self.size < SMALL * full_size
    }
}

/// Returns the usual size of boxes that are not notes.
pub(super) fn full_size(extents: &[BoxExtent]) -> f64 {
    let mut sizes: Vec<f64> = extents.iter().map(|extent| extent.size).collect();
    sizes.sort_by(f64::total_cmp);
    if sizes.is_empty() {
        return 0.0;
    }
    let larger = ((sizes.len() as f64 * TOO_LARGE) as usize).max(1);
    let large = sizes[sizes.len().saturating_sub(1 + larger)];
    let first = sizes.partition_point(|size| *size < SMALLEST_FULL * large);
    let full = &sizes[first..];
    let usual = full[full.len() / 2];
    among_notes(extents, usual).unwrap_or(usual)
}

/// Returns the median size of the large boxes if a page consists nearly only of notes of a usual size. Characters among
/// notes stand in several columns, titles in one or two.
fn among_notes(extents: &[BoxExtent], usual: f64) -> Option<f64> {
    let is_large = |extent: &&BoxExtent| LARGE.contains(&(extent.size / usual));
    let mut large: Vec<&BoxExtent> = extents.iter().filter(is_large).collect();
    large.sort_by(|a, b| a.u.total_cmp(&b.u));
    let columns = large.chunk_by(|a, b| b.u - a.u <= usual).count();
    if columns < MIN_COLUMNS {
        return None;
    }
    large.sort_by(|a, b| a.size.total_cmp(&b.size));
    Some(large[large.len() / 2].size)
}
