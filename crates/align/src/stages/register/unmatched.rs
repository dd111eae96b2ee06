//! Finds strokes of one image that have no partner in the other, at the final pose.
//!
//! Missing ink or missing wood alone is common: ink is dry, and wood breaks off. A print of a similar character differs
//! in both ways: it has a stroke that the relief lacks, and lacks one that the relief has.

use super::half_canvas::{BORDER_PX, HalfCanvas};
use super::ink_edge::{InkEdge, REACH};
use super::lone_stroke::{UnmatchedMasks, lone_strokes};
use super::misfit::smooth_misfit;
use mocban_core::raster::Mask;
use mocban_core::raster::components::ConnectedComponents;

/// Distance from the strokes of the other image, as a fraction of the stroke width, from which a pixel has no partner.
/// Smaller distances are due to the spread of ink and to local misalignment.
const TOLERANCE: f64 = 0.3;
/// Least tolerance in pixels of the half canvas.
const TOLERANCE_PX: f64 = 1.5;
/// Least tolerance in pixels of a small print.
const TOLERANCE_PRINT_PX: f64 = 0.4;
/// Edge scatter that the pixels of a small print cause if they are as wide as strokes. Measured on right pairs with prints
/// of 12 to 24 px.
const PIXEL_SCATTER: f64 = 0.15;
/// Edges that deviate by at least this fraction of the stroke width do not count for the scatter.
const NEAR: f64 = 0.5;

/// Returns the distance from the strokes of the other image, in pixels of the half canvas, from which a pixel has no
/// partner. `stroke_width` and `print_px`, the side of the pixels of a small print, are in the same pixels. Distances of
/// [`REACH`] and more are not measured, so the result is smaller.
pub(super) fn tolerance_px(stroke_width: f64, print_px: f64) -> f64 {
    (TOLERANCE * stroke_width)
        .max(TOLERANCE_PRINT_PX * print_px)
        .clamp(TOLERANCE_PX, (REACH - 1) as f64)
}

/// Strokes without a partner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unmatched {
    /// Area of the largest connected piece of stroke tops without ink, in squares of the stroke width.
    pub(super) tops: f64,
    /// Area of the largest connected piece of ink without wood, in squares of the stroke width.
    pub(super) ink: f64,
    /// Mean absolute deviation of the distances from the ink's edge to the edge of the strokes, from their median, as a
    /// fraction of the stroke width. The median is the spread of the ink.
    pub(super) edge_scatter: f64,
    /// Area of the ink, in squares of the stroke width.
    pub(super) ink_area: f64,
    /// Displacement of whole strokes, see [`smooth_misfit`].
    pub(super) smooth_misfit: f64,
    /// How surely the print has a whole stroke that was not carved, and the wood one that was not printed, 0..=1, see
    /// [`lone_strokes`].
    pub(super) lone_strokes: [f64; 2],
}

impl Unmatched {
    /// Measures the strokes without a partner. `levels` are the highest and the lowest threshold of all metrics: only
    /// wood above the highest one surely prints, and only ink outside the lowest one surely lies on no wood.
    /// `relief_levels` is the depth of the relief in levels.
    pub(super) fn of(canvas: &HalfCanvas, [highest, lowest]: [u16; 2], relief_levels: f64) -> Self {
        let wood = InkEdge::of(&canvas.mask(lowest));
        let width = canvas.stroke_width;
        let tolerance = tolerance_px(width, canvas.print_px) as f32;
        let is_far = |distance: &f32| *distance < -tolerance;
        let unknown = canvas.levels.map(|level| *level == 0);
        let squares = |alone: &Mask| {
            let pieces = ConnectedComponents::label(alone);
            pieces.largest_apart_from(&unknown, BORDER_PX) as f64 / (width * width)
        };
        // A speck on a stroke is a trace of dry ink.
        let traces = InkEdge::of(
            &canvas
                .ink
                .zip_map(&canvas.specks, |ink, speck| ink || speck),
        );
        let tops = traces.grid().zip_map(&canvas.levels, |distance, level| {
            is_far(&distance) && level >= highest
        });
        let ink = wood
            .grid()
            .zip_map(&canvas.ink, |distance, ink| is_far(&distance) && ink);
        let alone = UnmatchedMasks {
            ink: &ink,
            tops: &tops,
            wood: &wood,
            levels: [highest, lowest],
        };
        Self {
            tops: squares(&tops),
            ink: squares(&ink),
            edge_scatter: edge_scatter(canvas, &wood),
            ink_area: canvas.ink.count() as f64 / (width * width),
            smooth_misfit: smooth_misfit(canvas, &wood),
            lone_strokes: lone_strokes(canvas, &alone, relief_levels),
        }
    }
}

/// Returns the scatter of the ink's edge over the edge of the strokes, see [`Unmatched::edge_scatter`].
pub(super) fn edge_scatter(canvas: &HalfCanvas, strokes: &InkEdge) -> f64 {
    let width = canvas.stroke_width;
    let mut distances = canvas.distances_at_edges(|at| canvas.ink.data()[at], strokes);
    let scatter = mean_deviation(&mut distances, NEAR * width) / width;
    canvas.without_pixels(scatter, PIXEL_SCATTER)
}

/// Returns the mean of the absolute deviations from the median, of the values that deviate by less than `most`. Returns
/// 0 if there are no values.
fn mean_deviation(values: &mut [f32], most: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let half = values.len() / 2;
    let median = *values.select_nth_unstable_by(half, f32::total_cmp).1;
    let deviations = values.iter().map(|value| f64::from((value - median).abs()));
    let (sum, count) = deviations
        .filter(|deviation| *deviation < most)
        .fold((0.0, 0_u32), |(sum, count), d| (sum + d, count + 1));
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    use super::{TOLERANCE_PX, Unmatched, mean_deviation, tolerance_px};
    use crate::stages::register::half_canvas::HalfCanvas;
    use mocban_core::raster::{Grid, Mask};

    const SIDE: usize = 96;
    const TOP: u16 = 1000;

    /// Measures a block and a print of three bars of 64 x 8 px. `wood` and `ink` state which bars the block and the
    /// print have. The ink is shifted up by `shift` px.
    fn unmatched(wood: [bool; 3], ink: [bool; 3], shift: usize) -> Unmatched {
        let on_bar = |bars: [bool; 3], x: usize, y: usize| {
            let bar = (y / 8)
                .checked_sub(2)
                .filter(|row| row % 3 == 0)
                .map(|row| row / 3);
            (16..80).contains(&x) && bar.is_some_and(|bar| bar < 3 && bars[bar])
        };
        let level = |x, y| if on_bar(wood, x, y) { TOP } else { 1 };
        let canvas = HalfCanvas::of(
            Grid::from_fn(SIDE, SIDE, level),
            Mask::from_fn(SIDE, SIDE, |x, y| on_bar(ink, x, y + shift)),
        );
        Unmatched::of(&canvas, [TOP, TOP], f64::from(TOP))
    }

    #[test]
    fn strokes_without_a_partner_are_measured_in_stroke_widths() {
        let all = [true; 3];
        let same = unmatched(all, all, 0);
        assert_eq!((same.tops, same.ink), (0.0, 0.0));
        let missing = [true, false, true];
        // A bar of 64 x 8 pixels at a stroke width of about 8 pixels.
        let bare = unmatched(all, missing, 0);
        assert!((6.0..9.0).contains(&bare.tops), "{bare:?}");
        assert_eq!(bare.ink, 0.0);
        let lost = unmatched(missing, all, 0);
        assert!((6.0..9.0).contains(&lost.ink), "{lost:?}");
        assert_eq!(lost.tops, 0.0);
    }

    #[test]
    fn tolerance_grows_with_the_strokes_up_to_the_largest_measured_distance() {
        assert_eq!(tolerance_px(1.0, 0.0), TOLERANCE_PX);
        assert_eq!(tolerance_px(20.0, 0.0), 6.0);
        assert_eq!(tolerance_px(30.0, 0.0), 7.0);
        // Pixels of a small print that are as wide as strokes.
        assert_eq!(tolerance_px(10.0, 10.0), 4.0);
    }

    #[test]
    fn strokes_with_traces_of_ink_are_not_alone() {
        let level = |x: usize, y: usize| {
            let across = (40..48).contains(&y) && (16..80).contains(&x);
            let down = y < 20 && (40..48).contains(&x);
            if across || down { TOP } else { 1 }
        };
        let ink = Mask::from_fn(SIDE, SIDE, |x, y| y < 20 && level(x, y) == TOP);
        let mut canvas = HalfCanvas::of(Grid::from_fn(SIDE, SIDE, level), ink);
        assert!(Unmatched::of(&canvas, [TOP, TOP], f64::from(TOP)).tops > 5.0);
        canvas.specks = Mask::from_fn(SIDE, SIDE, |x, y| x % 4 == 0 && y % 3 == 0);
        assert!(Unmatched::of(&canvas, [TOP, TOP], f64::from(TOP)).tops < 0.2);
    }

    #[test]
    fn small_shifts_leave_no_strokes_alone() {
        let shifted = unmatched([true; 3], [true; 3], 2);
        assert_eq!((shifted.tops, shifted.ink), (0.0, 0.0));
        assert!(shifted.edge_scatter > 0.15, "{shifted:?}");
        assert!(unmatched([true; 3], [true; 3], 0).edge_scatter < 0.02);
    }

    #[test]
    fn mean_deviation_leaves_out_far_values() {
        let values = &mut [4.0, 1.0, 2.0, 9.0, 3.0];
        assert_eq!(mean_deviation(values, 10.0), 2.0);
        assert_eq!(mean_deviation(values, 3.0), 1.0);
        assert_eq!(mean_deviation(&mut [], 3.0), 0.0);
    }
}
