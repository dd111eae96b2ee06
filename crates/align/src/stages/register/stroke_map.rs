//! Maps where the mask of a threshold and the ink disagree by more than the spread of the ink explains.

use super::half_canvas::{BORDER_PX, HalfCanvas};
use super::ink_edge::{InkEdge, REACH};
use super::unmatched::tolerance_px;
use crate::stages::normalize::PrintMasks;
use mocban_core::domain::{Affine2, Disagreement};
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{DepthMap, Grid, Mask};

/// Smallest area beyond the tolerance of a piece, in squares of the stroke width. Ends of strokes that are rounded or
/// printed short have less.
const SMALLEST_PIECE: f64 = 0.15;
/// Pixels at which a mask and the ink disagree, with their number of pieces and their areas.
///
/// A piece has pixels that are farther from the other image than the spread of the ink and a tolerance. It extends from
/// there to the other image, or to where the spread explains the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokeMap {
    /// Values on the canvas on which masks are scored: [`Self::AGREE`], [`Self::MISSING_INK`] or
    /// [`Self::MISSING_WOOD`].
    pub grey: Grid<u8>,
    /// Number of pieces and their areas.
    pub disagreement: Disagreement,
}

impl StrokeMap {
    /// Mask and ink agree, or print or depth map has no data.
    pub const AGREE: u8 = 0;
    /// Stroke tops without ink near them.
    pub const MISSING_INK: u8 = 128;
    /// Ink without stroke tops near it.
    pub const MISSING_WOOD: u8 = 255;
    /// Both values of disagreement. Elsewhere the map is [`Self::AGREE`], which is 0.
    pub const DISAGREEMENTS: [u8; 2] = [Self::MISSING_INK, Self::MISSING_WOOD];

    /// Maps the disagreement of an alignment. `level` is the lowest depth-map level that is stroke. The map has
    /// `canvas_px` pixels on each side.
    pub fn of_alignment(
        depth: &DepthMap,
        print: &PrintMasks,
        canvas_from_print: &Affine2,
        print_from_depth: &Affine2,
        canvas_px: u32,
        level: u16,
    ) -> Self {
        let canvas = HalfCanvas::new(depth, print, canvas_from_print, print_from_depth, canvas_px);
        Self::of(&canvas, level, canvas_px)
    }

    /// Maps the disagreement of the mask of `level` and the ink. The map has `canvas_px` pixels on each side.
    pub(super) fn of(canvas: &HalfCanvas, level: u16, canvas_px: u32) -> Self {
        let mask = canvas.mask(level);
        let wood = InkEdge::of(&mask);
        let mut distances = canvas.distances_at_edges(|at| mask.data()[at], &canvas.edge);
        let spread = InkEdge::mean_near(&mut distances);
        let width = canvas.stroke_width;
        let tolerance = tolerance_px(width, canvas.print_px);
        // Heavy ink lies outside the strokes, and dry ink ends inside them.
        let sides = [
            (&mask, &canvas.edge, (-spread).max(0.0)),
            (&canvas.ink, &wood, spread.max(0.0)),
        ];
        let unknown = canvas.levels.map(|level| *level == 0);
        let smallest = (SMALLEST_PIECE * width * width).ceil() as usize;
        let [ink, wood] = sides.map(|(set, other, explained)| {
            let far = outside(set, other, explained + tolerance);
            let pieces = ConnectedComponents::label(&far);
            let (far, count) = pieces.apart_from(&unknown, BORDER_PX, smallest);
            if count == 0 {
                return (far, count);
            }
            let unexplained = outside(set, other, explained);
            let is_near = |distance: f32| f64::from(distance) > -tolerance;
            let whole = InkEdge::of(&far)
                .grid()
                .zip_map(&unexplained, |d, set| set && is_near(d));
            (whole, count)
        });
        let share = |part: &Mask, all: &Mask| part.count() as f64 / all.count().max(1) as f64;
        let disagreement = Disagreement {
            pieces: (ink.1 + wood.1) as u32,
            missing_ink: share(&ink.0, &mask),
            missing_wood: share(&wood.0, &canvas.ink),
        };
        let side = canvas_px as usize;
        if disagreement.pieces == 0 {
            let grey = Grid::new(side, side, Self::AGREE);
            return Self { grey, disagreement };
        }
        let at_half = |at: usize, length: usize| (at / 2).min(length - 1);
        let grey = Grid::from_fn(side, side, |x, y| {
            let [x, y] = [at_half(x, mask.width()), at_half(y, mask.height())];
            match (ink.0.at(x, y), wood.0.at(x, y)) {
                (true, _) => Self::MISSING_INK,
                (false, true) => Self::MISSING_WOOD,
                (false, false) => Self::AGREE,
            }
        });
        Self { grey, disagreement }
    }
}

/// Returns the pixels of a mask that lie more than `distance_px` pixels outside the area with this edge.
fn outside(mask: &Mask, edge: &InkEdge, distance_px: f64) -> Mask {
    let least = distance_px.min((REACH - 1) as f64) as f32;
    mask.zip_map(edge.grid(), |set, distance| set && distance < -least)
}

#[cfg(test)]
mod tests {
    use super::StrokeMap;
    use crate::stages::register::half_canvas::HalfCanvas;
    use mocban_core::raster::{Grid, Mask};

    const SIDE: usize = 96;
    const TOP: u16 = 1000;

    /// Returns whether a pixel lies on a bar. `bars` selects some of three bars of 64 px x 8 px. Each bar is
    /// `wider` pixels wider on each side.
    fn on_bar(bars: [bool; 3], wider: i64, x: usize, y: usize) -> bool {
        let mut tops = [16_i64, 40, 64].into_iter().zip(bars);
        (16 - wider..80 + wider).contains(&(x as i64))
            && tops.any(|(top, is)| is && (top - wider..top + 8 + wider).contains(&(y as i64)))
    }

    /// Maps a block and a print of bars. The ink is `spread` pixels wider on each side and lies `shift` pixels higher.
    fn map(wood: [bool; 3], ink: [bool; 3], spread: i64, shift: usize) -> StrokeMap {
        let level = |x, y| if on_bar(wood, 0, x, y) { TOP } else { 1 };
        let ink = Mask::from_fn(SIDE, SIDE, |x, y| on_bar(ink, spread, x, y + shift));
        let canvas = HalfCanvas::of(Grid::from_fn(SIDE, SIDE, level), ink);
        StrokeMap::of(&canvas, TOP, 2 * SIDE as u32)
    }

    fn count(map: &StrokeMap, value: u8) -> usize {
        map.grey.map(|grey| *grey == value).count()
    }

    const ALL: [bool; 3] = [true; 3];
    const WITHOUT_MIDDLE: [bool; 3] = [true, false, true];

    #[test]
    fn a_missing_bar_is_mapped_where_it_is_missing() {
        let bare = map(ALL, WITHOUT_MIDDLE, 0, 0);
        // A pixel of the half canvas is four pixels of the map.
        let bar = 4 * 64 * 8;
        assert_eq!(count(&bare, StrokeMap::MISSING_INK), bar);
        assert_eq!(count(&bare, StrokeMap::MISSING_WOOD), 0);
        assert_eq!(bare.grey.at(2 * 16, 2 * 40), StrokeMap::MISSING_INK);
        assert_eq!(bare.grey.at(2 * 16 - 1, 2 * 40), StrokeMap::AGREE);
        assert_eq!(bare.disagreement.pieces, 1);
        assert!((bare.disagreement.missing_ink - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(bare.disagreement.missing_wood, 0.0);

        let lost = map(WITHOUT_MIDDLE, ALL, 0, 0);
        assert_eq!(count(&lost, StrokeMap::MISSING_WOOD), bar);
        assert_eq!(count(&lost, StrokeMap::MISSING_INK), 0);
        assert!((lost.disagreement.missing_wood - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(lost.disagreement.missing_ink, 0.0);
    }

    #[test]
    fn each_missing_bar_is_one_piece() {
        let both = map([true, true, false], [true, false, true], 0, 0);
        assert_eq!(both.disagreement.pieces, 2);
        assert!((both.disagreement.missing_ink - 0.5).abs() < 1e-12);
        assert!((both.disagreement.missing_wood - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_gap_in_the_ink_is_mapped_up_to_the_ink() {
        let level = |x, y| if on_bar(ALL, 0, x, y) { TOP } else { 1 };
        let is_gap = |x: usize, y: usize| (36..60).contains(&x) && (40..48).contains(&y);
        let ink = Mask::from_fn(SIDE, SIDE, |x, y| on_bar(ALL, 0, x, y) && !is_gap(x, y));
        let canvas = HalfCanvas::of(Grid::from_fn(SIDE, SIDE, level), ink);
        let map = StrokeMap::of(&canvas, TOP, 2 * SIDE as u32);
        let differs = |x: usize, y: usize| map.grey.at(2 * x, 2 * y) == StrokeMap::MISSING_INK;
        for at in 0..SIDE * SIDE {
            let (x, y) = (at % SIDE, at / SIDE);
            assert_eq!(differs(x, y), is_gap(x, y), "{x} {y}");
        }
        assert_eq!(map.disagreement.pieces, 1);
    }

    #[test]
    fn spread_and_small_shifts_give_an_empty_map() {
        for (spread, shift) in [(0, 0), (0, 2), (2, 0), (3, 0), (-1, 0), (-2, 0), (2, 1)] {
            let map = map(ALL, ALL, spread, shift);
            let agree = count(&map, StrokeMap::AGREE);
            assert_eq!(agree, map.grey.data().len(), "{spread} {shift}");
            assert_eq!(map.disagreement.pieces, 0);
        }
        // The bars are 8 px wide, so a shift by 5 px is neither spread nor small.
        assert!(map(ALL, ALL, 0, 5).disagreement.pieces > 0);
    }

    #[test]
    fn small_pieces_and_pieces_at_the_border_are_left_out() {
        let pieces = |extra: fn(usize, usize) -> bool| {
            let level = |x, y| match (x, on_bar(ALL, 0, x, y)) {
                (94.., _) => 0,
                (_, true) => TOP,
                (_, false) => 1,
            };
            let levels = Grid::from_fn(SIDE, SIDE, level);
            let ink = Mask::from_fn(SIDE, SIDE, |x, y| {
                x < 94 && (on_bar(ALL, 0, x, y) || extra(x, y))
            });
            let canvas = HalfCanvas::of(levels, ink);
            StrokeMap::of(&canvas, TOP, 2 * SIDE as u32)
                .disagreement
                .pieces
        };
        assert_eq!(pieces(|_, _| false), 0);
        assert_eq!(
            pieces(|x, y| (30..36).contains(&x) && (82..88).contains(&y)),
            1
        );
        assert_eq!(
            pieces(|x, y| (30..32).contains(&x) && (82..84).contains(&y)),
            0
        );
        // Beside pixels without data, and at the border of the canvas.
        assert_eq!(
            pieces(|x, y| (88..94).contains(&x) && (82..88).contains(&y)),
            0
        );
        assert_eq!(pieces(|x, y| (30..36).contains(&x) && y >= 90), 0);
    }
}
