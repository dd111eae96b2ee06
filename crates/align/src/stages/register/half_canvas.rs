//! Print and depth map on a canvas of half the side length, so comparing masks takes a quarter of the time.

use super::ink_edge::InkEdge;
use crate::stages::normalize::PrintMasks;
use mocban_core::domain::Affine2;
use mocban_core::raster::{DepthMap, Grid, Mask, warp_depth, warp_mask};

/// Pixels within this many pixels of the border of the common area are at the border. Walls, stains and neighbouring strokes
/// lie there.
pub(super) const BORDER_PX: i64 = 2;

/// Print and depth map in one frame.
pub(super) struct HalfCanvas {
    /// Levels of the depth map; 0 where print or depth map holds no data.
    pub(super) levels: Grid<u16>,
    /// Ink where both hold data.
    pub(super) ink: Mask,
    /// Ink where the print holds data and the depth map does not.
    pub(super) beyond: Mask,
    /// Pixels with a speck of ink, see `PrintMasks::specks`.
    pub(super) specks: Mask,
    /// Distances to the edge of the ink.
    pub(super) edge: InkEdge,
    /// Mean width of the ink's strokes in pixels of this canvas, at least 1.
    pub(super) stroke_width: f64,
    /// Side of the pixels of a small print, in pixels of this canvas. 0 for other prints, whose pixels are smaller than
    /// strokes.
    pub(super) print_px: f64,
}

impl HalfCanvas {
    /// Warps print and depth map to the canvas, and clears the pixels where print or depth map has no data. The maps
    /// are those of the print, not of its masks.
    pub(super) fn new(
        depth: &DepthMap,
        print: &PrintMasks,
        canvas_from_print: &Affine2,
        print_from_depth: &Affine2,
        canvas_px: u32,
    ) -> Self {
        let side = canvas_px as usize / 2;
        let half_from_print = to_half(canvas_from_print);
        let half_from_depth = half_from_print.after(print_from_depth);
        let mut levels = warp_depth(depth, &half_from_depth, side, side);
        let half_from_masks = half_from_print.after(&print.print_from_masks());
        let paper = warp_mask(&print.known, &half_from_masks, side, side);
        let mut ink = warp_mask(&print.ink, &half_from_masks, side, side);
        let mut beyond = ink.zip_map(&paper, |ink, paper| ink && paper);
        let both = levels.data_mut().iter_mut().zip(ink.data_mut());
        let both = both.zip(beyond.data_mut());
        for (((level, ink), beyond), paper) in both.zip(paper.data()) {
            *beyond &= *level == 0;
            *level *= u16::from(*paper);
            *ink &= *level > 0;
        }
        Self {
            beyond,
            specks: scattered(&print.specks, &half_from_masks, side),
            print_px: (print.scale.enlargement()).map_or(0.0, |_| half_from_print.scale()),
            ..Self::of(levels, ink)
        }
    }

    /// Creates a canvas of levels and ink, without specks and without ink beyond the depth map. The ink must be clear where the level is 0.
    pub(super) fn of(levels: Grid<u16>, ink: Mask) -> Self {
        let edge = InkEdge::of(&ink);
        let [specks, beyond] = [(); 2].map(|()| Mask::new(ink.width(), ink.height(), false));
        Self {
            levels,
            ink,
            specks,
            beyond,
            stroke_width: stroke_width(&edge),
            print_px: 0.0,
            edge,
        }
    }

    /// Subtracts from a deviation of the ink's edge, in stroke widths, what the pixels of a small print add to it. This is
    /// `least` if pixels are as wide as strokes.
    pub(super) fn without_pixels(&self, deviation: f64, least: f64) -> f64 {
        let added = least * (self.print_px / self.stroke_width).powi(2);
        (deviation.powi(2) - added.powi(2)).max(0.0).sqrt()
    }

    /// Returns the stroke mask of a level above 0.
    pub(super) fn mask(&self, level: u16) -> Mask {
        self.levels.map(|l| *l >= level)
    }

    /// Returns the intersection over union of the ink and the strokes of the best of several levels.
    pub(super) fn best_iou(&self, levels: impl IntoIterator<Item = u16>) -> f64 {
        let iou = |level: u16| {
            let pairs = self.levels.data().iter().zip(self.ink.data());
            let (both, any) = pairs.fold((0_u32, 0_u32), |(both, any), (at, ink)| {
                let is_stroke = *at >= level;
                (
                    both + u32::from(is_stroke && *ink),
                    any + u32::from(is_stroke || *ink),
                )
            });
            f64::from(both) / f64::from(any.max(1))
        };
        levels.into_iter().map(iou).fold(0.0, f64::max)
    }

    /// Returns the signed distance to `edge`, in pixels, at each boundary between a set and an unset pixel of a mask.
    /// `is_set` returns whether the mask is set at an index of the canvas. Boundaries beside a pixel without data are
    /// left out.
    pub(super) fn distances_at_edges(
        &self,
        is_set: impl Fn(usize) -> bool,
        edge: &InkEdge,
    ) -> Vec<f32> {
        let mut distances = Vec::new();
        self.each_adjacent_pair(|one, other| {
            if is_set(one) != is_set(other) {
                distances.push(edge.at(one).midpoint(edge.at(other)));
            }
        });
        distances
    }

    /// Calls a function with the indices of each two horizontally or vertically adjacent pixels that both have data.
    pub(super) fn each_adjacent_pair(&self, mut visit: impl FnMut(usize, usize)) {
        let (width, height) = (self.levels.width(), self.levels.height());
        let levels = self.levels.data();
        let mut visit_known = |one: usize, other: usize| {
            if levels[one].min(levels[other]) > 0 {
                visit(one, other);
            }
        };
        for row in (0..height).map(|y| y * width) {
            for at in row..row + width - 1 {
                visit_known(at, at + 1);
            }
            if row + width < width * height {
                for at in row..row + width {
                    visit_known(at, at + width);
                }
            }
        }
    }
}

/// Returns whether a pixel is near the unknown ones or the border of the canvas.
pub(super) fn is_at_border(unknown: &Mask, x: i64, y: i64) -> bool {
    let around = [
        (BORDER_PX, 0),
        (-BORDER_PX, 0),
        (0, BORDER_PX),
        (0, -BORDER_PX),
    ];
    around
        .iter()
        .any(|(dx, dy)| unknown.get(x + dx, y + dy).unwrap_or(true))
}

/// Returns a map to the canvas as a map to the half canvas.
pub(super) fn to_half(canvas_from_image: &Affine2) -> Affine2 {
    Affine2::resize(0.5).after(canvas_from_image)
}

/// Returns the mean width of the strokes with this edge, in pixels, at least 1. The mean distance to the edge of a stroke
/// is a quarter of its width.
fn stroke_width(edge: &InkEdge) -> f64 {
    let inside = edge.distances().iter().filter(|d| **d > 0.0);
    let (sum, count) = inside.fold((0.0, 0_u32), |(sum, count), d| {
        (sum + f64::from(*d), count + 1)
    });
    (4.0 * sum / f64::from(count.max(1))).max(1.0)
}

/// Returns the canvas pixels in which the centre of at least one set pixel of `mask` lies.
fn scattered(mask: &Mask, canvas_from_mask: &Affine2, side: usize) -> Mask {
    let mut canvas = Mask::new(side, side, false);
    for y in 0..mask.height() {
        for x in (0..mask.width()).filter(|x| mask.at(*x, y)) {
            let [u, v] = canvas_from_mask.apply([x as f64, y as f64]).map(f64::round);
            let is_inside = |at: f64| (0.0..side as f64).contains(&at);
            if is_inside(u) && is_inside(v) {
                canvas.set(u as usize, v as usize, true);
            }
        }
    }
    canvas
}

#[cfg(test)]
mod tests {
    use super::HalfCanvas;
    use mocban_core::raster::{Grid, Mask};

    #[test]
    fn pixels_as_wide_as_strokes_explain_a_part_of_a_deviation() {
        let bar = Mask::from_fn(40, 40, |x, _| (16..24).contains(&x));
        let canvas = HalfCanvas::of(Grid::new(40, 40, 1), bar);
        assert_eq!(canvas.without_pixels(0.25, 0.15), 0.25);
        let small = HalfCanvas {
            print_px: canvas.stroke_width,
            ..canvas
        };
        assert!((small.without_pixels(0.25, 0.15) - 0.2).abs() < 1e-9);
        assert_eq!(small.without_pixels(0.1, 0.15), 0.0);
    }
}
