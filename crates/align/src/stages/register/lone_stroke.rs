//! Finds a whole stroke that only one of print and relief has: characters that look alike often differ by one stroke.
//!
//! Wood that broke off leaves ink without wood too. It leaves remnants that rise above the ground, and most losses end
//! within a stroke, so that wood lies at both ends of the ink that is left alone. A stroke that was never carved lies on
//! ground as deep as that beside other strokes, and most of its edge is paper. It may also lead beyond the scan, which ends
//! on ground there. Dry ink leaves tops without ink, which end within strokes as well.

use super::half_canvas::{HalfCanvas, is_at_border};
use super::ink_edge::{InkEdge, REACH};
use mocban_core::raster::Mask;
use mocban_core::raster::components::ConnectedComponents;
use std::collections::BTreeSet;

/// Range of areas, in squares of the stroke width, from which a piece of ink or of tops counts. Pixels at the border of the
/// common area are left out.
const AREAS: [f64; 2] = [0.8, 1.6];
/// Range of areas from which a piece no longer counts: it is a rule, a stain or a missing part of a print.
const LARGE_AREAS: [f64; 2] = [6.0, 8.0];
/// Range of the area of other strokes without a partner, in squares of the stroke width, from which a stroke is not the only
/// difference: wood was lost, the print is torn, or the pose is wrong.
const OTHERS: [f64; 2] = [1.0, 2.0];
/// Range of the fraction of a piece's edge at which its stroke ends. It is 1 for a stroke that touches no other, and about a
/// half for a loss within a stroke.
const FREE_EDGES: [f64; 2] = [0.68, 0.76];
/// Range of the fraction of a piece of ink that lies on remnants, from which it no longer counts.
const REMNANTS: [f64; 2] = [0.1, 0.2];
/// The same ranges for a piece at the border of the common area, and the range of areas of the ink that leads on beyond the
/// scan.
const AREAS_AT_BORDER: [f64; 2] = [0.3, 0.8];
const REMNANTS_AT_BORDER: [f64; 2] = [0.15, 0.3];
const BEYOND: [f64; 2] = [0.3, 1.0];
/// Least area where ink and tops agree in the stroke with which a piece is connected, in squares of the stroke width.
/// Neighbouring characters, rules, walls and stains are not connected with the character.
const LEAST_MATCHED: f64 = 3.0;
/// A pixel lies on a remnant if it rises above the ground at the same distance from the wood by this fraction of the
/// relief's depth.
const REMNANT: f64 = 0.2;
/// Ink that lies deeper than the ground by this fraction of the relief's depth lies on a surface seen through a hole.
const HOLE: f64 = 0.4;
/// Number of pixels from which the ground at a distance from the wood is measured.
const LEAST_GROUND: usize = 20;
/// Ink beyond the scan belongs to a piece that is at most this many steps away, pixels.
const BEYOND_PX: i64 = 3;

/// A piece of ink without wood, or of tops without ink.
#[derive(Debug, Default, Clone)]
struct StrokePiece {
    /// Number of pixels at the border of the common area, and of the others.
    at_border: usize,
    inner: usize,
    /// Number of inner pixels on remnants of wood.
    on_remnants: usize,
    /// Sum of how far the inner pixels rise above the ground, as fractions of the relief's depth.
    rise: f64,
    /// Number of pixels beside the piece, and of those at which its stroke ends.
    beside: usize,
    free: usize,
    /// Ink components beyond the scan into which the piece leads.
    beyond: BTreeSet<usize>,
}

/// Strokes of one of print and relief that are far from those of the other one.
pub(super) struct UnmatchedMasks<'a> {
    /// Ink far from the wood above the lowest level.
    pub(super) ink: &'a Mask,
    /// Tops above the highest level that are far from the ink.
    pub(super) tops: &'a Mask,
    /// Distances to the edge of the wood above the lowest level.
    pub(super) wood: &'a InkEdge,
    /// The highest and the lowest level.
    pub(super) levels: [u16; 2],
}

/// Returns how surely the print has a whole stroke that was not carved, and the wood one that was not printed, 0..=1.
/// `relief_levels` is the depth of the relief in levels.
pub(super) fn lone_strokes(
    canvas: &HalfCanvas,
    alone: &UnmatchedMasks,
    relief_levels: f64,
) -> [f64; 2] {
    let square = canvas.stroke_width.powi(2);
    let [tops, wood] = alone.levels.map(|level| canvas.mask(level));
    let ink = StrokePieces::of(alone.ink, &canvas.ink, &wood, square);
    let tops = StrokePieces::of(alone.tops, &tops, &canvas.ink, square);
    let areas =
        [&ink, &tops].map(|pieces| pieces.as_ref().map_or(0.0, |found| found.area / square));
    let of_ink = ink.and_then(|ink| of_ink(canvas, &ink, alone, relief_levels));
    let of_tops = tops.map_or(0.0, |tops| of_tops(canvas, &tops));
    let is_only = areas.map(|others| 1.0 - ramp(others, OTHERS));
    [of_ink.unwrap_or(0.0) * is_only[1], of_tops * is_only[0]]
}

/// Returns how surely a piece of ink is a whole stroke, or `None` if there is little ground beside the wood.
fn of_ink(
    canvas: &HalfCanvas,
    pieces: &StrokePieces,
    alone: &UnmatchedMasks,
    relief_levels: f64,
) -> Option<f64> {
    let square = canvas.stroke_width.powi(2);
    let ground = ground_levels(canvas, alone.wood, alone.levels[1])?;
    let rise = |at: usize| {
        let level = f64::from(canvas.levels.data()[at]);
        (level - ground[distance_bin(alone.wood.at(at))]) / relief_levels.max(1.0)
    };
    let unknown = canvas.levels.map(|level| *level == 0);
    let around = ConnectedComponents::label(&unknown).touching_border();
    let beyond_ink = canvas.beyond.zip_map(&around, |ink, around| ink && around);
    let beyond = ConnectedComponents::label(&beyond_ink);
    let beyond_areas = beyond.parts_of(&beyond_ink);
    let measured = pieces.measured(canvas, &beyond, rise);
    let remnants = |piece: &StrokePiece| piece.on_remnants as f64 / piece.inner.max(1) as f64;
    let is_in_hole = |piece: &StrokePiece| -piece.rise / piece.inner.max(1) as f64 > HOLE;
    let whole = |piece: &StrokePiece| {
        let is_plain = f64::from(u8::from(!is_in_hole(piece)));
        piece.whole(square) * (1.0 - ramp(remnants(piece), REMNANTS)) * is_plain
    };
    let leads_on = |piece: &StrokePiece| {
        let areas = piece.beyond.iter().map(|label| beyond_areas[*label].1);
        let is_plain = 1.0 - ramp(remnants(piece), REMNANTS_AT_BORDER);
        let area_beyond = areas.sum::<usize>() as f64 / square;
        if is_in_hole(piece) {
            0.0
        } else {
            piece.at_border(square) * ramp(area_beyond, BEYOND) * is_plain
        }
    };
    Some(surest(&measured, square, |piece| {
        whole(piece).max(leads_on(piece))
    }))
}

/// Returns the largest score of a piece. It is lower if the other pieces have a large area and low scores: these are losses.
fn surest(pieces: &[StrokePiece], square: f64, score: impl Fn(&StrokePiece) -> f64) -> f64 {
    let scores: Vec<f64> = pieces.iter().map(score).collect();
    let losses = pieces.iter().zip(&scores);
    let losses: Vec<f64> = losses
        .map(|(piece, score)| (1.0 - score) * piece.area() / square)
        .collect();
    let all: f64 = losses.iter().sum();
    let only = scores.iter().zip(losses);
    only.map(|(score, own)| score * (1.0 - ramp(all - own, OTHERS)))
        .fold(0.0, f64::max)
}

/// Returns how surely a piece of tops is a whole stroke.
fn of_tops(canvas: &HalfCanvas, pieces: &StrokePieces) -> f64 {
    let square = canvas.stroke_width.powi(2);
    let none =
        ConnectedComponents::label(&Mask::new(canvas.ink.width(), canvas.ink.height(), false));
    let measured = pieces.measured(canvas, &none, |_| 0.0);
    surest(&measured, square, |piece| piece.whole(square))
}

impl StrokePiece {
    /// Returns the number of all pixels.
    fn area(&self) -> f64 {
        (self.inner + self.at_border) as f64
    }

    /// Returns how surely the piece is a whole stroke by its area and its edges. `square` is the square of the stroke width.
    fn whole(&self, square: f64) -> f64 {
        let free = self.free as f64 / self.beside.max(1) as f64;
        let area = self.area() / square;
        ramp(self.inner as f64 / square, AREAS)
            * ramp(free, FREE_EDGES)
            * (1.0 - ramp(area, LARGE_AREAS))
    }

    /// Returns how surely the piece is a stroke that crosses the border of the common area, by its area.
    fn at_border(&self, square: f64) -> f64 {
        if self.at_border == 0 {
            return 0.0;
        }
        ramp(self.inner as f64 / square, AREAS_AT_BORDER)
    }
}

/// Returns 0 below a range, 1 above it, and a linear function in between.
fn ramp(value: f64, [from, to]: [f64; 2]) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

/// Pieces of strokes without a partner that are connected with strokes that have one.
struct StrokePieces {
    components: ConnectedComponents,
    is_wanted: Vec<bool>,
    /// Number of their pixels.
    area: f64,
    /// The strokes of which they are pieces.
    strokes: Mask,
}

impl StrokePieces {
    /// Labels the pieces in `alone`, a part of `strokes`. `partners` are the strokes of the other image. Returns `None` if
    /// no piece is large enough and connected with enough matched strokes.
    fn of(alone: &Mask, strokes: &Mask, partners: &Mask, square: f64) -> Option<Self> {
        let components = ConnectedComponents::label(alone);
        let areas = components.parts_of(alone);
        let is_large = |(_, area): &(_, usize)| *area as f64 > AREAS_AT_BORDER[0] * square;
        let mut is_wanted: Vec<bool> = areas.iter().map(is_large).collect();
        if !is_wanted.contains(&true) {
            return None;
        }
        let wholes = ConnectedComponents::label(strokes);
        let mut matched = vec![0_usize; wholes.parts_of(strokes).len()];
        let mut whole_of_piece = vec![0; is_wanted.len()];
        for y in 0..strokes.height() {
            for x in 0..strokes.width() {
                let Some(whole) = wholes.label_at(x, y) else {
                    continue;
                };
                matched[whole] += usize::from(partners.at(x, y));
                if let Some(piece) = components.label_at(x, y) {
                    whole_of_piece[piece] = whole;
                }
            }
        }
        for (is_wanted, whole) in is_wanted.iter_mut().zip(whole_of_piece) {
            *is_wanted &= matched[whole] as f64 >= LEAST_MATCHED * square;
        }
        let wanted = areas.iter().zip(&is_wanted).filter(|(_, wanted)| **wanted);
        let area = wanted.map(|((_, area), _)| *area as f64).sum();
        is_wanted.contains(&true).then(|| Self {
            components,
            is_wanted,
            area,
            strokes: strokes.clone(),
        })
    }

    /// Returns the piece at a pixel.
    fn at(&self, x: i64, y: i64) -> Option<usize> {
        self.strokes.get(x, y)?;
        let label = self.components.label_at(x as usize, y as usize);
        label.filter(|label| self.is_wanted[*label])
    }

    /// Measures the pieces. `rise` returns how far a pixel rises above the ground, as a fraction of the relief's depth.
    /// `beyond` is the ink beyond the scan.
    fn measured(
        &self,
        canvas: &HalfCanvas,
        beyond: &ConnectedComponents,
        rise: impl Fn(usize) -> f64,
    ) -> Vec<StrokePiece> {
        let unknown = canvas.levels.map(|level| *level == 0);
        let width = unknown.width();
        let mut measured = vec![StrokePiece::default(); self.is_wanted.len()];
        for at in (0..unknown.data().len()).filter(|at| !unknown.data()[*at]) {
            let (x, y) = ((at % width) as i64, (at / width) as i64);
            let Some(label) = self.at(x, y) else {
                let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)];
                let labels = beside.map(|(dx, dy)| self.at(x + dx, y + dy));
                for label in labels.into_iter().flatten().collect::<BTreeSet<_>>() {
                    measured[label].beside += 1;
                    measured[label].free += usize::from(!self.strokes.data()[at]);
                }
                continue;
            };
            let piece = &mut measured[label];
            if is_at_border(&unknown, x, y) {
                piece.at_border += 1;
                piece.beyond.extend(labels_near(beyond, &unknown, x, y));
            } else {
                let rise = rise(at);
                piece.inner += 1;
                piece.on_remnants += usize::from(rise > REMNANT);
                piece.rise += rise;
            }
        }
        measured
    }
}

/// Returns the components at most [`BEYOND_PX`] steps from a pixel of a grid.
fn labels_near(
    components: &ConnectedComponents,
    grid: &Mask,
    x: i64,
    y: i64,
) -> impl Iterator<Item = usize> {
    let in_row = move |dy: i64| {
        let reach = BEYOND_PX - dy.abs();
        (-reach..=reach).map(move |dx| (x + dx, y + dy))
    };
    let near = (-BEYOND_PX..=BEYOND_PX).flat_map(in_row);
    near.filter(|(x, y)| grid.get(*x, *y).is_some())
        .filter_map(|(x, y)| components.label_at(x as usize, y as usize))
}

/// Returns the index of a distance to the wood among the levels of [`ground_levels`].
fn distance_bin(distance: f32) -> usize {
    ((-distance).round().max(1.0) as usize).min(REACH) - 1
}

/// Returns the median level of the ground without ink at 1 to [`REACH`] pixels from the wood. Where there is little ground,
/// it is that of the distance before. Returns `None` if there is little ground beside the wood.
fn ground_levels(canvas: &HalfCanvas, wood: &InkEdge, lowest: u16) -> Option<Vec<f64>> {
    let width = canvas.levels.width();
    let unknown = canvas.levels.map(|level| *level == 0);
    let mut levels = vec![Vec::new(); REACH];
    for (at, level) in canvas.levels.data().iter().enumerate() {
        let is_ground = *level > 0 && *level < lowest && !canvas.ink.data()[at];
        if is_ground && !is_at_border(&unknown, (at % width) as i64, (at / width) as i64) {
            levels[distance_bin(wood.at(at))].push(*level);
        }
    }
    let mut before = None;
    let medians = levels.into_iter().map(|mut levels| {
        if levels.len() > LEAST_GROUND {
            let middle = levels.len() / 2;
            before = Some(f64::from(*levels.select_nth_unstable(middle).1));
        }
        before
    });
    medians.collect()
}

#[cfg(test)]
mod tests {
    use super::{UnmatchedMasks, lone_strokes};
    use crate::stages::register::half_canvas::HalfCanvas;
    use crate::stages::register::ink_edge::InkEdge;
    use mocban_core::raster::{Grid, Mask};

    const SIDE: usize = 128;
    const TOP: u16 = 1000;

    /// Strokes of 8 px: a bar from 16 to 112 and, from row 40 to the last row before `end`, one that is joined to it.
    fn is_stroke(x: usize, y: usize, end: usize) -> bool {
        let across = (32..40).contains(&y) && (16..112).contains(&x);
        across || (60..68).contains(&x) && (40..end).contains(&y)
    }

    /// Returns how surely one image of a block and a print has a stroke of its own.
    fn lone_stroke(level: impl Fn(usize, usize) -> u16, ink: impl Fn(usize, usize) -> bool) -> f64 {
        let levels = Grid::from_fn(SIDE, SIDE, level);
        let known = |x: usize, y: usize| levels.at(x, y) > 0;
        let mask =
            |wanted: bool| Mask::from_fn(SIDE, SIDE, |x, y| ink(x, y) && known(x, y) == wanted);
        let canvas = HalfCanvas {
            beyond: mask(false),
            ..HalfCanvas::of(levels.clone(), mask(true))
        };
        let strokes = canvas.mask(TOP);
        let wood = InkEdge::of(&strokes);
        let far = |from: &InkEdge, mask: &Mask| {
            from.grid()
                .zip_map(mask, |distance, is_set| distance < -2.0 && is_set)
        };
        let alone = UnmatchedMasks {
            ink: &far(&wood, &canvas.ink),
            tops: &far(&canvas.edge, &strokes),
            wood: &wood,
            levels: [TOP; 2],
        };
        let [ink, tops] = lone_strokes(&canvas, &alone, f64::from(TOP));
        ink.max(tops)
    }

    fn wood(end: usize) -> impl Fn(usize, usize) -> u16 {
        move |x, y| if is_stroke(x, y, end) { TOP } else { 1 }
    }

    fn ink(end: usize) -> impl Fn(usize, usize) -> bool {
        move |x, y| is_stroke(x, y, end)
    }

    #[test]
    fn a_whole_stroke_of_ink_or_wood_is_seen_and_equal_strokes_are_not() {
        assert_eq!(lone_stroke(wood(80), ink(80)), 0.0);
        assert!(lone_stroke(wood(40), ink(80)) > 0.95);
        assert!(lone_stroke(wood(80), ink(40)) > 0.95);
    }

    #[test]
    fn ink_on_a_loss_within_a_stroke_and_on_remnants_is_no_lone_stroke() {
        let loss = |x: usize, y: usize| (54..62).contains(&y) && is_stroke(x, y, 80);
        let broken = |x, y| if loss(x, y) { 1 } else { wood(80)(x, y) };
        assert_eq!(lone_stroke(broken, ink(80)), 0.0);
        let remnants = |x: usize, y: usize| match (is_stroke(x, y, 40), is_stroke(x, y, 80)) {
            (true, _) => TOP,
            (false, true) => 400,
            (false, false) => 1,
        };
        assert_eq!(lone_stroke(remnants, ink(80)), 0.0);
    }

    #[test]
    fn ink_that_leads_beyond_a_scan_is_seen_if_the_scan_ends_on_ground() {
        let cut = |end: usize| move |x: usize, y: usize| if y < 50 { wood(end)(x, y) } else { 0 };
        assert!(lone_stroke(cut(40), ink(80)) > 0.5);
        assert_eq!(lone_stroke(cut(80), ink(80)), 0.0);
        // The ink ends with the scan.
        assert_eq!(
            lone_stroke(cut(40), |x, y| y < 50 && is_stroke(x, y, 80)),
            0.0
        );
    }
}
