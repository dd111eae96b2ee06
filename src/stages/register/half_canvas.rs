//! Print and depth map on a canvas of half the side length, so comparing masks takes a quarter of the time.

use super::ink_edge::InkEdge;
use crate::domain::Affine2;
use crate::raster::{DepthMap, Grid, Mask, warp_depth, warp_mask};
use crate::stages::normalize::PrintMasks;

/// Print and depth map in one frame.
pub(super) struct HalfCanvas {
    /// Levels of the depth map; 0 where print or depth map holds no data.
    pub(super) levels: Grid<u16>,
    /// Ink where both hold data.
    pub(super) ink: Mask,
    /// Pixels with a speck of ink, see `PrintMasks::specks`.
    pub(super) specks: Mask,
    /// Distances to the edge of the ink.
    pub(super) edge: InkEdge,
}

impl HalfCanvas {
    /// Warps print and depth map to the canvas, and clears the pixels where print or depth map has no data.
    pub(super) fn new(
        depth: &DepthMap,
        print: &PrintMasks,
        canvas_from_print: &Affine2,
        print_from_depth: &Affine2,
        canvas_px: u32,
    ) -> Self {
        let side = canvas_px as usize / 2;
        let half_from_print = Affine2::scale_shift(0.5, [-0.25, -0.25]).after(canvas_from_print);
        let half_from_depth = half_from_print.after(print_from_depth);
        let mut levels = warp_depth(depth, &half_from_depth, side, side);
        let paper = warp_mask(&print.known, &half_from_print, side, side);
        let mut ink = warp_mask(&print.ink, &half_from_print, side, side);
        let both = levels.data_mut().iter_mut().zip(ink.data_mut());
        for ((level, ink), paper) in both.zip(paper.data()) {
            *level *= u16::from(*paper);
            *ink &= *level > 0;
        }
        Self {
            specks: scattered(&print.specks, &half_from_print, side),
            ..Self::of(levels, ink)
        }
    }

    /// Creates a canvas of levels and ink, without specks. The ink must be clear where the level is 0.
    pub(super) fn of(levels: Grid<u16>, ink: Mask) -> Self {
        let edge = InkEdge::of(&ink);
        let specks = Mask::new(ink.width(), ink.height(), false);
        Self {
            levels,
            ink,
            specks,
            edge,
        }
    }

    /// Returns the stroke mask of a level above 0.
    pub(super) fn mask(&self, level: u16) -> Mask {
        self.levels.map(|l| *l >= level)
    }

    /// Estimates how far the ink spreads over the edge of the strokes, in pixels of this canvas. The result is negative
    /// if dry ink leaves the edge of the strokes bare. See [`InkEdge::mean_near`].
    pub(super) fn ink_spread(&self, level: u16) -> f64 {
        let levels = self.levels.data();
        InkEdge::mean_near(&mut self.distances_at_edges(|at| levels[at] >= level, &self.edge))
    }

    /// Returns the signed distance to `edge`, in pixels, at each boundary between a set and an unset pixel of a mask.
    /// `is_set` returns whether the mask is set at an index of the canvas. Boundaries beside a pixel without data are
    /// left out.
    pub(super) fn distances_at_edges(
        &self,
        is_set: impl Fn(usize) -> bool,
        edge: &InkEdge,
    ) -> Vec<f32> {
        let (width, height) = (self.levels.width(), self.levels.height());
        let levels = self.levels.data();
        let mut distances = Vec::new();
        let mut add = |one: usize, other: usize| {
            if levels[one].min(levels[other]) > 0 && is_set(one) != is_set(other) {
                distances.push(edge.at(one).midpoint(edge.at(other)));
            }
        };
        for at in 0..width * height {
            if (at + 1) % width > 0 {
                add(at, at + 1);
            }
            if at + width < width * height {
                add(at, at + width);
            }
        }
        distances
    }
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
    use crate::raster::{Grid, Mask};

    const SIDE: usize = 96;
    const TOP: u16 = 1000;

    /// Returns a canvas of two bars with a half width of 8 px, inked up to `ink_px` from their axes. The first bar has
    /// ink only in the rows of `is_inked`. The second bar has wood only in the rows of `is_carved`.
    fn canvas(
        ink_px: f64,
        is_inked: impl Fn(usize) -> bool,
        is_carved: impl Fn(usize) -> bool,
    ) -> HalfCanvas {
        let from_axis = |x: usize| (x % 48) as f64 - 23.5;
        let level = |x: usize, y: usize| {
            let on_bar = from_axis(x).abs() < 8.0 && (x < 48 || is_carved(y));
            if on_bar { TOP } else { 1 }
        };
        let ink = |x: usize, y: usize| from_axis(x).abs() < ink_px && (x > 48 || is_inked(y));
        HalfCanvas::of(
            Grid::from_fn(SIDE, SIDE, level),
            Mask::from_fn(SIDE, SIDE, ink),
        )
    }

    #[test]
    fn ink_spread_is_measured_from_dry_to_heavy_ink() {
        for spread in [-2.0, -1.0, 0.0, 1.0, 2.0, 4.0] {
            let found = canvas(8.0 + spread, |_| true, |_| true).ink_spread(TOP);
            assert!((found - spread).abs() < 0.1, "{found} for {spread}");
        }
    }

    #[test]
    fn missing_ink_and_missing_wood_do_not_change_the_spread() {
        let missing = |y: usize| !(30..60).contains(&y);
        for spread in [-1.0, 2.0] {
            let found = canvas(8.0 + spread, missing, missing).ink_spread(TOP);
            assert!((found - spread).abs() < 0.2, "{found} for {spread}");
        }
    }
}
