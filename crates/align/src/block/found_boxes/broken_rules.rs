//! Rules that are in pieces, lean or are doubled: thin strokes in line, where no characters stand.

use super::rules::Rule;
use super::text_image::PIXEL_MM;
use mocban_core::domain::cancel::poll;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Mask, PixelBox};

/// Largest lean of a rule, as the shift across over the length.
const MAX_LEAN: f64 = 0.012;
const LEANS: i32 = 6;
/// Width of the band along a line in which its pieces lie, mm.
const BAND_MM: f64 = 0.75;
/// A piece is at least this many times as long as thick.
const SLENDER: f64 = 2.2;
/// Strokes that are at most this wide and lie whole within this distance of a line belong to it, mm.
const FRAGMENT_WIDTH_MM: f64 = 0.8;
const FRAGMENT_MM: f64 = 1.0;

/// Which pieces make a rule.
#[derive(Debug, Clone, Copy)]
pub(super) struct PieceLimits {
    /// Largest thickness, mm.
    pub(super) thick_mm: f64,
    /// What is left of all pieces of a rule when this length is taken from each, as a fraction of the height of the
    /// image, is at least `least`.
    pub(super) short_mm: f64,
    pub(super) least: f64,
}

/// A thin stroke along y, in pixels.
#[derive(Debug, Clone, Copy)]
struct Piece {
    middle: [f64; 2],
    bounds: PixelBox,
    /// Number in the components, and pixels.
    label: usize,
    area: usize,
    /// Its length beyond that of a short one.
    weight: f64,
}

/// A line along y: x = at + lean (y - middle).
#[derive(Debug, Clone, Copy)]
struct RuleLine {
    at: f64,
    lean: f64,
    middle: f64,
    weight: f64,
}

impl RuleLine {
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        (x - self.at - self.lean * (y - self.middle)).abs()
    }
}

/// Finds rules along y that are in pieces and carved, where `may_be` allows a line at this position across, and erases them.
pub(super) fn take_broken_rules(
    strokes: &mut Mask,
    erased: &mut Mask,
    carved: &Mask,
    limits: &PieceLimits,
    may_be: impl Fn(f64) -> bool,
) -> Vec<Rule> {
    let thin = thin_strokes(strokes, (limits.thick_mm / PIXEL_MM) as usize);
    let components = ConnectedComponents::label(&thin);
    let parts = components.parts_of(&thin);
    // Pixels of each part that the block shows.
    let mut counts = vec![0_usize; parts.len()];
    for y in 0..thin.height() {
        for (x, is_carved) in carved.row(y).iter().enumerate() {
            if let Some(label) = components.label_at(x, y) {
                counts[label] += usize::from(*is_carved);
            }
        }
    }
    let mut pieces: Vec<Piece> = (parts.into_iter())
        .enumerate()
        .filter_map(|(label, part)| Piece::of(label, part, limits))
        .filter(|piece| 2 * counts[piece.label] >= piece.area)
        .collect();
    let least = limits.least * strokes.height() as f64;
    let middle = strokes.height() as f64 / 2.0;
    let mut is_of_rule = Vec::new();
    let (mut rules, mut lines) = (Vec::new(), Vec::new());
    while let Some(line) = best_line(&pieces, middle, &may_be) {
        if line.weight < least {
            break;
        }
        let band = BAND_MM / PIXEL_MM / 2.0;
        let (of_line, rest): (Vec<Piece>, Vec<Piece>) =
            (pieces.into_iter()).partition(|piece| line.distance(piece.middle) <= band);
        pieces = rest;
        // Rounding may leave out pieces at the edge of the band.
        if of_line.is_empty() {
            break;
        }
        poll();
        rules.push(rule_of(&of_line));
        lines.push(line);
        is_of_rule.extend(of_line.iter().map(|piece| piece.label));
    }
    if lines.is_empty() {
        return rules;
    }
    is_of_rule.sort_unstable();
    for y in 0..strokes.height() {
        for x in 0..strokes.width() {
            let label = components.label_at(x, y);
            if label.is_some_and(|label| is_of_rule.binary_search(&label).is_ok()) {
                strokes.set(x, y, false);
                erased.set(x, y, true);
            }
        }
    }
    erase_fragments(strokes, erased, &lines);
    rules
}

impl Piece {
    fn of(label: usize, (bounds, area): (PixelBox, usize), limits: &PieceLimits) -> Option<Self> {
        let (width, length) = (bounds.width() as f64, bounds.height() as f64);
        let thick = area as f64 / length;
        let weight = length - limits.short_mm / PIXEL_MM;
        let is_straight = width <= 2.0 * thick + 1.0 + 2.0 * MAX_LEAN * length;
        let is_slender = length >= SLENDER * thick;
        (weight > 0.0 && is_straight && is_slender).then(|| Self {
            middle: [
                f64::midpoint(bounds.x0 as f64, bounds.x1 as f64),
                f64::midpoint(bounds.y0 as f64, bounds.y1 as f64),
            ],
            bounds,
            label,
            area,
            weight,
        })
    }
}

/// Returns the strokes that are at most this wide across.
fn thin_strokes(strokes: &Mask, widest: usize) -> Mask {
    let mut thin = Mask::new(strokes.width(), strokes.height(), false);
    for y in 0..strokes.height() {
        let row = strokes.row(y);
        let mut x = 0;
        while let Some(gap) = row[x..].iter().position(|set| *set) {
            let begin = x + gap;
            let end = begin + row[begin..].iter().take_while(|set| **set).count();
            if end - begin <= widest {
                thin.data_mut()[y * row.len() + begin..y * row.len() + end].fill(true);
            }
            x = end;
        }
    }
    thin
}

/// Returns the line with the most pieces.
fn best_line(pieces: &[Piece], middle: f64, may_be: &impl Fn(f64) -> bool) -> Option<RuleLine> {
    let band = BAND_MM / PIXEL_MM;
    let mut best: Option<RuleLine> = None;
    for step in -LEANS..=LEANS {
        let lean = MAX_LEAN * f64::from(step) / f64::from(LEANS);
        let mut at: Vec<(f64, f64)> = pieces
            .iter()
            .map(|piece| {
                (
                    piece.middle[0] - lean * (piece.middle[1] - middle),
                    piece.weight,
                )
            })
            .filter(|(at, _)| may_be(*at))
            .collect();
        at.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut first, mut sum, mut moment) = (0, 0.0, 0.0);
        for last in 0..at.len() {
            sum += at[last].1;
            moment += at[last].1 * at[last].0;
            while at[last].0 - at[first].0 > band {
                sum -= at[first].1;
                moment -= at[first].1 * at[first].0;
                first += 1;
            }
            if best.is_none_or(|best| sum > best.weight) {
                best = Some(RuleLine {
                    at: moment / sum,
                    lean,
                    middle,
                    weight: sum,
                });
            }
        }
    }
    best
}

fn rule_of(pieces: &[Piece]) -> Rule {
    let all: f64 = pieces.iter().map(|piece| piece.weight).sum();
    let moment: f64 = pieces
        .iter()
        .map(|piece| piece.weight * piece.middle[0])
        .sum();
    let length = pieces.iter().map(|piece| piece.bounds.height()).sum();
    let low = pieces.iter().map(|piece| piece.bounds.x0).min();
    let high = pieces.iter().map(|piece| piece.bounds.x1).max();
    Rule {
        at: moment / all,
        edges: [
            low.unwrap_or(0) as f64 - 0.5,
            high.unwrap_or(0) as f64 + 0.5,
        ],
        length,
    }
}

/// Erases the strokes that lie whole on one of the lines.
fn erase_fragments(strokes: &mut Mask, erased: &mut Mask, lines: &[RuleLine]) {
    let components = ConnectedComponents::label(strokes);
    let reach = FRAGMENT_MM / PIXEL_MM;
    let parts = components.parts_of(strokes);
    let is_fragment: Vec<bool> = (parts.iter())
        .map(|(bounds, _)| {
            let y = f64::midpoint(bounds.y0 as f64, bounds.y1 as f64);
            let ends = [bounds.x0, bounds.x1].map(|x| x as f64);
            let is_thin = bounds.width() as f64 * PIXEL_MM <= FRAGMENT_WIDTH_MM;
            let is_on = |line: &RuleLine| ends.iter().all(|x| line.distance([*x, y]) <= reach);
            is_thin && lines.iter().any(is_on)
        })
        .collect();
    for (bounds, _) in parts
        .iter()
        .zip(&is_fragment)
        .filter(|(_, is)| **is)
        .map(|(part, _)| part)
    {
        for y in bounds.y0..=bounds.y1 {
            for x in bounds.x0..=bounds.x1 {
                if components
                    .label_at(x, y)
                    .is_some_and(|label| is_fragment[label])
                {
                    strokes.set(x, y, false);
                    erased.set(x, y, true);
                }
            }
        }
    }
}
