//! What relief and print show when they do not match, so that a refusal says what was seen instead of guessing.

use std::fmt;

use super::half_canvas::HalfCanvas;
use mocban_core::domain::ReliefHeights;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{DepthMap, Mask};

/// A piece of a scan counts if it has at least this fraction of the area with data.
const PIECE: f64 = 0.15;
/// More pieces than this are strokes or gaps of one scan.
const MOST_PIECES: usize = 3;
/// A relief that is less deep than this fraction of the longer side of the scan is no carving. Carvings have several percent.
const FLAT: f64 = 0.012;
/// One half of the print agrees with the relief, and the other one does not, if its `IoU` is at least the first value and
/// exceeds that of the other half by the second.
const HALF_IOU: [f64; 2] = [0.75, 0.46];
/// Where a print is divided, as fractions of the canvas, which is centred on the ink.
const CUTS: [f64; 3] = [0.5, 0.45, 0.55];
/// The half that does not agree has at least this share of the strokes and ink of the other one. It is empty if the print is
/// not known there.
const LEAST_IN_HALF: f64 = 0.2;

/// Something unusual about a pair that does not match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Observation {
    /// Nothing.
    Nothing,
    /// The scan consists of this many large pieces.
    Pieces(usize),
    /// The relief has only this depth, as a fraction of the longer side of the scan.
    Flat(f64),
    /// Strokes and ink agree in this half of the print and not in the other.
    Half(&'static str),
}

impl fmt::Display for Observation {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => write!(
                to,
                "is it the print of another character, or is the sheet torn or folded?"
            ),
            Self::Pieces(count) => write!(
                to,
                "the scan shows {count} separate pieces: does one file hold several characters or pieces?"
            ),
            Self::Flat(share) => write!(
                to,
                "the face of the scan is nearly flat (its relief is {:.1} % of its length): does it show the back of the block?",
                100.0 * share
            ),
            Self::Half(half) => write!(
                to,
                "they agree in the {half} half of the print only: is the sheet folded, torn or covered there?"
            ),
        }
    }
}

impl Observation {
    /// Looks at a scan: its pieces, and whether it is carved.
    pub(super) fn of_scan(depth: &DepthMap, relief: &ReliefHeights) -> Self {
        let known = depth.levels.map(|level| *level != 0);
        let parts = ConnectedComponents::label(&known).parts_of(&known);
        let least = PIECE * known.count() as f64;
        let large = parts.iter().filter(|(_, area)| *area as f64 >= least);
        let pieces = large.count();
        if (2..=MOST_PIECES).contains(&pieces) {
            return Self::Pieces(pieces);
        }
        let longest = depth.levels.width().max(depth.levels.height()) as f64;
        let share = relief.depth() / (longest * depth.scale.mesh_unit_per_px);
        if share < FLAT {
            return Self::Flat(share);
        }
        Self::Nothing
    }

    /// Compares the halves of a canvas, on which relief and print have the best pose, at each of several levels: how deep the
    /// ink reaches depends on the print.
    pub(super) fn of_halves(canvas: &HalfCanvas, levels: impl IntoIterator<Item = u16>) -> Self {
        let at_level = |level| {
            let lines = overlaps_of_lines(&canvas.mask(level), &canvas.ink);
            CUTS.iter().find_map(|cut| agreeing_half(&lines, *cut))
        };
        let found = levels.into_iter().find_map(at_level);
        found.map_or(Self::Nothing, Self::Half)
    }

    /// Returns whether the scan, rather than the print, is the likelier cause.
    pub const fn is_of_scan(self) -> bool {
        matches!(self, Self::Pieces(_) | Self::Flat(_))
    }

    /// Returns the first observation that is not nothing.
    pub(super) fn or(self, other: impl FnOnce() -> Self) -> Self {
        if self == Self::Nothing { other() } else { self }
    }
}

/// Returns the half of two masks in which they agree, if they do so in one only. `lines` are the overlaps in their columns and
/// rows, which are divided at the fraction `cut`.
fn agreeing_half(lines: &[Vec<PartOverlap>; 2], cut: f64) -> Option<&'static str> {
    let [agrees, exceeds] = HALF_IOU;
    let names = [["left", "right"], ["upper", "lower"]];
    lines.iter().zip(names).find_map(|(lines, names)| {
        let (first, second) = lines.split_at((cut * lines.len() as f64) as usize);
        let halves = [first, second].map(PartOverlap::of_all);
        let is_alone = |half: &usize| {
            let (one, other) = (halves[*half], halves[1 - *half]);
            let is_filled = other.any as f64 >= LEAST_IN_HALF * one.any as f64;
            one.iou() >= agrees && one.iou() - other.iou() >= exceeds && is_filled
        };
        (0..2).find(is_alone).map(|half| names[half])
    })
}

/// Returns the overlaps of two masks in their columns and in their rows.
fn overlaps_of_lines(one: &Mask, other: &Mask) -> [Vec<PartOverlap>; 2] {
    let mut columns = vec![PartOverlap::default(); one.width()];
    let mut rows = vec![PartOverlap::default(); one.height()];
    for (y, row) in rows.iter_mut().enumerate() {
        for (column, (a, b)) in columns.iter_mut().zip(one.row(y).iter().zip(other.row(y))) {
            for line in [column, &mut *row] {
                line.both += u64::from(*a && *b);
                line.any += u64::from(*a || *b);
            }
        }
    }
    [columns, rows]
}

/// Numbers of pixels in a part of two masks: a row, a column, or a half.
#[derive(Clone, Copy, Default)]
struct PartOverlap {
    /// Set in both.
    both: u64,
    /// Set in one or both.
    any: u64,
}

impl PartOverlap {
    /// Adds the overlaps of all parts.
    fn of_all(parts: &[Self]) -> Self {
        let both = parts.iter().map(|part| part.both).sum();
        let any = parts.iter().map(|part| part.any).sum();
        Self { both, any }
    }

    /// Returns the `IoU`; 0 if both masks are empty there.
    fn iou(self) -> f64 {
        self.both as f64 / self.any.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::{HalfCanvas, Observation};
    use mocban_core::domain::{Affine2, DepthScale, ReliefHeights};
    use mocban_core::raster::{DepthMap, Grid, Mask};

    const SIDE: usize = 100;

    fn scan(is_known: impl Fn(usize, usize) -> bool) -> DepthMap {
        DepthMap {
            levels: Grid::from_fn(SIDE, SIDE, |x, y| u16::from(is_known(x, y))),
            scale: DepthScale {
                height_min: -1.0,
                height_per_level: 1e-4,
                mesh_unit_per_px: 0.1,
                depth_from_plane: Affine2::IDENTITY,
                curvature: None,
                unit: None,
            },
        }
    }

    fn relief(depth: f64) -> ReliefHeights {
        ReliefHeights {
            top: 0.0,
            ground: -depth,
            tops_end: 0.3,
            tops_end_log_deviation: 0.1,
        }
    }

    #[test]
    fn pieces_and_flat_faces_are_seen() {
        let whole = scan(|_, _| true);
        assert_eq!(
            Observation::of_scan(&whole, &relief(0.8)),
            Observation::Nothing
        );
        let flat = Observation::of_scan(&whole, &relief(0.05));
        assert!(
            flat.to_string()
                .contains("nearly flat (its relief is 0.5 %"),
            "{flat}"
        );
        let two = scan(|x, _| !(45..50).contains(&x));
        assert_eq!(
            Observation::of_scan(&two, &relief(0.8)),
            Observation::Pieces(2)
        );
        let strokes = scan(|x, _| x % 20 < 10);
        assert_eq!(
            Observation::of_scan(&strokes, &relief(0.8)),
            Observation::Nothing
        );
        // A crumb beside the block is no piece.
        let crumb = scan(|x, y| x < 90 || (x > 95 && y < 5));
        assert_eq!(
            Observation::of_scan(&crumb, &relief(0.8)),
            Observation::Nothing
        );
    }

    #[test]
    fn a_print_that_agrees_in_one_half_is_seen() {
        let bars = |x: usize, y: usize| (10..90).contains(&x) && y % 20 < 8;
        let canvas = |ink: &dyn Fn(usize, usize) -> bool| {
            let level = |x, y| if bars(x, y) { 1000 } else { 1 };
            HalfCanvas::of(
                Grid::from_fn(SIDE, SIDE, level),
                Mask::from_fn(SIDE, SIDE, ink),
            )
        };
        let seen =
            |ink: &dyn Fn(usize, usize) -> bool| Observation::of_halves(&canvas(ink), [1000]);
        assert_eq!(seen(&bars), Observation::Nothing);
        assert_eq!(
            seen(&|x, y| bars(x, y) && x < 50),
            Observation::Half("left")
        );
        assert_eq!(
            seen(&|x, y| bars(x, y) && y >= 50),
            Observation::Half("lower")
        );
        assert_eq!(seen(&|x, y| y % 20 > 12 && x < 90), Observation::Nothing);
    }

    #[test]
    fn a_half_that_agrees_at_one_level_is_seen_if_the_other_one_is_known() {
        let slope = |y: usize| 1000 - 40 * (y % 20) as u16;
        let canvas = |is_known: &dyn Fn(usize) -> bool| {
            let level = |x, y| if is_known(x) { slope(y) } else { 0 };
            // On the right, the ink is beside the tops.
            let ink = |x: usize, y: usize| is_known(x) && ((x < 50) == (y % 20 < 8));
            HalfCanvas::of(
                Grid::from_fn(SIDE, SIDE, level),
                Mask::from_fn(SIDE, SIDE, ink),
            )
        };
        let seen = |canvas: &HalfCanvas, levels: &[u16]| {
            Observation::of_halves(canvas, levels.iter().copied())
        };
        let whole = canvas(&|_| true);
        // The strokes are wider than the ink at this level.
        assert_eq!(seen(&whole, &[400]), Observation::Nothing);
        assert_eq!(seen(&whole, &[400, 700]), Observation::Half("left"));
        let part = canvas(&|x| x < 50);
        assert_eq!(seen(&part, &[400, 700]), Observation::Nothing);
    }
}
