//! What makes pages in libraries unlike clean ones: how the text stands, and how the rules are.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::page_rule::PageRule;
use crate::draw::{number_within, within};
use crate::kind::NumberRange;
use crate::polygon::BoundsMm;

/// Lengths of the pieces of a broken rule, and of the gaps between them, mm.
const PIECE_MM: NumberRange = [2.0, 24.0];
const GAP_MM: NumberRange = [0.6, 9.0];
/// Largest distance between the ends of a leaning rule across its direction, mm.
const LEAN_MM: f64 = 2.2;
/// Distances of a second rule from the frame, outwards, mm.
const DOUBLE_MM: NumberRange = [0.9, 2.4];
/// Lengths of ridges beyond the frame, and halves of their widths, mm.
const RIDGE_MM: NumberRange = [0.8, 9.0];
const RIDGE_HALF_MM: NumberRange = [0.2, 0.8];

/// Probabilities and ranges from which the appearance of a page is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AppearanceRanges {
    /// Probability that notes fill their rows, which are as far apart as those of the text.
    pub tall_notes: f64,
    /// Probability that rules are in pieces, lean or are doubled, and that ridges print beyond the frame.
    pub broken_rules: f64,
    /// Probability that the sheet is torn along its middle.
    pub torn_fold: f64,
    /// Probability that the page has few characters.
    pub sparse: f64,
    /// Probability that the page has two registers of text.
    pub registers: f64,
    /// Probability that the strokes are printed thinner than they are carved.
    pub thin_ink: f64,
    /// Number of blots on the sheet.
    pub blots: NumberRange,
    /// Number of stamps on the sheet.
    pub stamps: NumberRange,
}

impl AppearanceRanges {
    /// A clean page.
    pub(super) const CLEAN: Self = Self {
        tall_notes: 0.0,
        broken_rules: 0.0,
        torn_fold: 0.0,
        sparse: 0.0,
        registers: 0.0,
        thin_ink: 0.0,
        blots: [0.0, 0.0],
        stamps: [0.0, 0.0],
    };
}

/// The appearance of one carved page.
#[derive(Debug, Clone)]
pub(super) struct PageAppearance {
    /// How notes stand, if they fill their rows.
    pub notes: Option<TallNotes>,
    /// Largest fraction of the rows of a column that hold characters, on a page with few of them.
    pub filled: Option<f64>,
    /// Fraction of the rows that the upper of two registers has.
    pub upper: Option<f64>,
    /// How rules are, if they are broken.
    pub rules: Option<BrokenRules>,
}

/// Notes that fill their rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct TallNotes {
    /// Distance of their rows, in distances of rows of the text.
    pub pitch: f64,
    /// Height of their em square, in distances of their rows.
    pub height: f64,
    /// Distance of the two notes of a row, in halves of the column's width.
    pub offset: f64,
    /// Width of a note, in halves of that distance.
    pub width: f64,
}

/// How the rules of a page are broken.
#[derive(Debug, Clone)]
pub(super) struct BrokenRules {
    /// Fraction of the rules that are in pieces.
    pieces: f64,
    /// Fraction of a rule in pieces that is left.
    left: f64,
    /// Largest distance between the ends of a rule across its direction, mm.
    lean_mm: f64,
    /// Distances of second rules from the frame, mm.
    doubled: Vec<f64>,
    /// Number of ridges beyond the frame.
    ridges: u32,
    rng: ChaCha8Rng,
}

impl PageAppearance {
    /// Draws the appearance of a page.
    pub(super) fn draw(ranges: &AppearanceRanges, rng: &mut ChaCha8Rng) -> Self {
        let mut has = |probability: f64| rng.random_bool(probability);
        let [notes, sparse, registers, rules] = [
            has(ranges.tall_notes),
            has(ranges.sparse),
            has(ranges.registers),
            has(ranges.broken_rules),
        ];
        Self {
            notes: notes.then(|| TallNotes {
                pitch: rng.random_range(0.8..1.04),
                height: rng.random_range(0.78..0.95),
                offset: rng.random_range(0.78..0.95),
                width: rng.random_range(1.65..1.92),
            }),
            filled: sparse.then(|| rng.random_range(0.12..0.6)),
            upper: registers.then(|| rng.random_range(0.3..0.7)),
            rules: rules.then(|| BrokenRules::draw(rng)),
        }
    }
}

impl BrokenRules {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let doubled = rng.random_range(0..3_usize);
        Self {
            pieces: rng.random(),
            left: rng.random_range(0.25..0.85),
            lean_mm: LEAN_MM * rng.random::<f64>(),
            doubled: (0..doubled).map(|_| within(DOUBLE_MM, rng)).collect(),
            ridges: number_within([0.0, 24.0], rng),
            rng: rng.clone(),
        }
    }

    /// Breaks rules, leans those between columns by up to some distance, and adds second rules and ridges around a frame.
    pub(super) fn apply(
        mut self,
        rules: &[PageRule],
        inner: BoundsMm,
        outer: BoundsMm,
    ) -> Vec<PageRule> {
        let mut broken = Vec::new();
        for rule in rules {
            let is_inside = rule
                .ends
                .iter()
                .any(|[u, _]| *u > inner.min[0] && *u < inner.max[0])
                && rule.ends[0][0] == rule.ends[1][0];
            let rule = if is_inside {
                self.leaning(*rule)
            } else {
                *rule
            };
            self.add_pieces(rule, &mut broken);
        }
        for index in 0..self.doubled.len() {
            let distance = self.doubled[index];
            let is_left = self.rng.random_bool(0.5);
            let u = if is_left {
                outer.min[0] - distance
            } else {
                outer.max[0] + distance
            };
            let rule = PageRule {
                ends: [[u, outer.min[1]], [u, outer.max[1]]],
                half_width_mm: self.rng.random_range(0.1..0.3),
            };
            let rule = self.leaning(rule);
            self.add_pieces(rule, &mut broken);
        }
        for _ in 0..self.ridges {
            broken.push(self.ridge(outer));
        }
        broken
    }

    fn leaning(&mut self, mut rule: PageRule) -> PageRule {
        let lean = self.lean_mm * self.rng.random_range(-0.5..0.5);
        rule.ends[0][0] -= lean / 2.0;
        rule.ends[1][0] += lean / 2.0;
        rule
    }

    /// Adds a rule, or the pieces that are left of it.
    fn add_pieces(&mut self, rule: PageRule, broken: &mut Vec<PageRule>) {
        if !self.rng.random_bool(self.pieces) {
            broken.push(rule);
            return;
        }
        let [from, to] = rule.ends;
        let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
        let mut t = -within(PIECE_MM, &mut self.rng);
        while t < length {
            let piece = within(PIECE_MM, &mut self.rng);
            let ends = [t.max(0.0), (t + piece).min(length)];
            t += piece + within(GAP_MM, &mut self.rng);
            if ends[1] - ends[0] < 1.0 || !self.rng.random_bool(self.left) {
                continue;
            }
            let shift = self.rng.random_range(-0.25..0.25);
            let across = [(from[1] - to[1]) / length, (to[0] - from[0]) / length];
            let point = |at: f64| {
                [0, 1].map(|i| from[i] + (to[i] - from[i]) * at / length + shift * across[i])
            };
            broken.push(PageRule {
                ends: ends.map(point),
                half_width_mm: rule.half_width_mm * self.rng.random_range(0.7..1.2),
            });
        }
    }

    /// Draws a piece of ground beyond the frame that was not cut deep enough, and prints.
    fn ridge(&mut self, outer: BoundsMm) -> PageRule {
        let rng = &mut self.rng;
        let axis = rng.random_range(0..2_usize);
        let is_max = rng.random_bool(0.5);
        let distance = rng.random_range(0.6..2.6);
        let edge = if is_max {
            outer.max[axis] + distance
        } else {
            outer.min[axis] - distance
        };
        let along = rng.random_range(outer.min[1 - axis]..outer.max[1 - axis]);
        let length = within(RIDGE_MM, rng);
        let tilt = rng.random_range(-0.5..0.5);
        let mut ends = [[0.0; 2]; 2];
        for (end, side) in ends.iter_mut().zip([-0.5, 0.5]) {
            end[axis] = edge + side * tilt;
            end[1 - axis] = along + side * length;
        }
        PageRule {
            ends,
            half_width_mm: within(RIDGE_HALF_MM, rng),
        }
    }
}
