//! The strokes of a page, divided into text and rules.

use super::broken_rules::{PieceLimits, take_broken_rules};
use super::rules::{Rule, erase_thin, take_rules};
use super::text_image::{PIXEL_MM, TextImage};
use mocban_core::raster::Mask;

/// Least value of strokes, of 255.
const STROKE: u8 = 128;
/// Largest fraction of the strokes beyond a frame in pieces.
const BEYOND_PIECES: f64 = 0.02;
/// Least part of a rule that the block shows. Lines of a stamp over dense text have up to 0.86, but less than
/// [`MIN_THIN`] of their rows meet a carved stroke that is at most [`THIN_CARVED_MM`] wide; rules have at least 0.4.
const MIN_CARVED: f64 = 0.75;
const MIN_THIN: f64 = 0.35;
const THIN_CARVED_MM: f64 = 1.2;
/// The same for thick lines of the frame.
const MOST_CARVED: f64 = 0.9;
/// Distance within which two rules are the same, mm.
const SAME_RULE_MM: f64 = 0.6;
/// Pieces of the frame.
const FRAME_PIECES: PieceLimits = PieceLimits {
    thick_mm: 2.4,
    short_mm: 3.0,
    least: 0.15,
};
/// A frame in pieces has two lines on a side, one of which may be doubled.
const FRAME_LINES: usize = 3;
/// Half the width of a line of the frame, mm.
const FRAME_HALF_MM: f64 = 1.2;
/// Pieces of rules between columns, and how far they may lie from the edge of a column, in distances of columns.
const COLUMN_PIECES: PieceLimits = PieceLimits {
    thick_mm: 0.6,
    short_mm: 1.0,
    least: 0.05,
};
const EDGE_REACH: f64 = 0.12;
/// The same anywhere: those beside the strip at the fold may lie within the columns that were found.
const LONG_PIECES: PieceLimits = PieceLimits {
    thick_mm: 0.6,
    short_mm: 3.5,
    least: 0.15,
};
/// Pieces of a rule across the page.
const CROSS_PIECES: PieceLimits = PieceLimits {
    thick_mm: 0.75,
    short_mm: 2.5,
    least: 0.28,
};

/// Text and rules of a page.
#[derive(Debug, Clone)]
pub(super) struct PageRules {
    /// Strokes of text in the pixels of the image.
    pub(super) text: Mask,
    /// Pixels of rules.
    pub(super) erased: Mask,
    /// All rules along y and along x.
    pub(super) found: [Vec<Rule>; 2],
    /// Strokes that the block shows, and the same transposed.
    carved: [Mask; 2],
}

impl PageRules {
    /// Takes frame and rules out of the strokes of an image.
    pub(super) fn of(image: &TextImage) -> Self {
        let text: Mask = image.strokes().map(|value| *value >= STROKE);
        let carved: Mask = image.relief.map(|value| *value >= STROKE);
        let mut rules = Self {
            erased: Mask::new(text.width(), text.height(), false),
            text,
            found: [Vec::new(), Vec::new()],
            carved: [carved.clone(), carved.transposed()],
        };
        let whole = rules.text.clone();
        rules.take(false, |text, erased, _| take_rules(text, erased));
        // A rule crosses those along the other axis.
        let without = std::mem::replace(&mut rules.text, whole);
        rules.take(true, |text, erased, _| take_rules(text, erased));
        for (text, is_left) in rules.text.data_mut().iter_mut().zip(without.data()) {
            *text &= is_left;
        }
        rules.take_carved();
        for is_across in [false, true] {
            for _ in 0..FRAME_LINES {
                if rules.take(is_across, take_outer_pieces) == 0 {
                    break;
                }
            }
        }
        rules
    }

    /// Erases rules in pieces: those near the edges of columns, which are given in pixels with their pitch, and those
    /// across the page. Returns whether there are any.
    pub(super) fn erase_broken(&mut self, edges: &[f64], pitch: f64) -> bool {
        let is_at_edge = |x: f64| {
            let mut distances = edges.iter().map(|edge| (edge - x).abs());
            distances.any(|distance| distance <= EDGE_REACH * pitch)
        };
        let mut found = self.take(false, |text, erased, carved| {
            take_broken_rules(text, erased, carved, &COLUMN_PIECES, is_at_edge)
        });
        for (is_across, limits) in [(false, &LONG_PIECES), (true, &CROSS_PIECES)] {
            found += self.take(is_across, |text, erased, carved| {
                take_broken_rules(text, erased, carved, limits, |_| true)
            });
        }
        found > 0
    }

    /// Takes out the rules that are carved but hardly printed, and forgets lines on the page that are not carved, such as a
    /// tear along the fold.
    fn take_carved(&mut self) {
        for is_across in [false, true] {
            let mut relief = self.carved[usize::from(is_across)].clone();
            let erased = if is_across {
                self.erased.transposed()
            } else {
                self.erased.clone()
            };
            let whole = relief.clone();
            let mut of_rules = Mask::new(relief.width(), relief.height(), false);
            let mut carved = take_rules(&mut relief, &mut of_rules);
            let is_among = |rule: &Rule, others: &[Rule]| {
                let mut distances = others.iter().map(|other| (other.at - rule.at).abs());
                distances.any(|distance| distance * PIXEL_MM <= SAME_RULE_MM)
            };
            let rules = std::mem::take(&mut self.found[usize::from(is_across)]);
            let (known, marks): (Vec<Rule>, Vec<Rule>) = rules
                .into_iter()
                .partition(|rule| is_among(rule, &carved) || is_carved(&whole, &erased, rule));
            carved.retain(|rule| !is_among(rule, &known));
            self.found[usize::from(is_across)] = known;
            self.take(is_across, |text, erased, relief| {
                for mark in &marks {
                    restore(text, erased, relief, &of_rules, mark);
                }
                for rule in &carved {
                    erase_thin(text, erased, rule);
                }
                for (erased, is_rule) in erased.data_mut().iter_mut().zip(of_rules.data()) {
                    *erased |= is_rule;
                }
                carved
            });
        }
    }

    /// Takes rules along y, or along x, out of the text. Returns their number.
    fn take(
        &mut self,
        is_across: bool,
        find: impl FnOnce(&mut Mask, &mut Mask, &Mask) -> Vec<Rule>,
    ) -> usize {
        let carved = &self.carved[usize::from(is_across)];
        let rules = if is_across {
            let (mut text, mut erased) = (self.text.transposed(), self.erased.transposed());
            let rules = find(&mut text, &mut erased, carved);
            (self.text, self.erased) = (text.transposed(), erased.transposed());
            rules
        } else {
            find(&mut self.text, &mut self.erased, carved)
        };
        let all = &mut self.found[usize::from(is_across)];
        let count = rules.len();
        all.extend(rules);
        all.sort_by(|a, b| a.at.total_cmp(&b.at));
        count
    }
}

/// Restores the text below a mark along y that is no rule, where the block shows strokes. Rules beside it stay erased.
fn restore(text: &mut Mask, erased: &mut Mask, relief: &Mask, of_rules: &Mask, mark: &Rule) {
    let spread = SAME_RULE_MM / PIXEL_MM;
    let first = (mark.edges[0] - spread).max(0.0) as usize;
    let last = ((mark.edges[1] + spread) as usize).min(text.width() - 1);
    for y in 0..text.height() {
        for x in first..=last {
            if erased.at(x, y) {
                erased.set(x, y, false);
                text.set(x, y, relief.at(x, y) && !of_rules.at(x, y));
            }
        }
    }
}

/// Returns whether the block shows the erased pixels of a line along y as a rule, and not as the text below a mark.
fn is_carved(relief: &Mask, erased: &Mask, rule: &Rule) -> bool {
    let width = relief.width();
    let first = rule.edges[0].max(0.0) as usize;
    let last = (rule.edges[1].max(0.0) as usize).min(width - 1);
    let widest = (THIN_CARVED_MM / PIXEL_MM) as usize;
    let [mut all, mut carved, mut rows, mut thin] = [0_usize; 4];
    for y in 0..relief.height() {
        let row = relief.row(y);
        let (mut is_erased, mut at_carved) = (false, None);
        for x in (first..=last).filter(|x| erased.at(*x, y)) {
            is_erased = true;
            all += 1;
            carved += usize::from(row[x]);
            at_carved = at_carved.or(row[x].then_some(x));
        }
        rows += usize::from(is_erased);
        if let Some(x) = at_carved {
            let begin = row[..x].iter().rposition(|set| !set).map_or(0, |k| k + 1);
            let length = row[begin..].iter().take_while(|set| **set).count();
            thin += usize::from(length <= widest);
        }
    }
    let part = carved as f64 / all.max(1) as f64;
    let is_thin = thin as f64 >= MIN_THIN * rows as f64;
    part >= MOST_CARVED || (part >= MIN_CARVED && is_thin)
}

/// Takes the pieces of rules along y that have nearly no strokes on one side.
fn take_outer_pieces(text: &mut Mask, erased: &mut Mask, carved: &Mask) -> Vec<Rule> {
    let mut before = vec![0_usize; text.width() + 1];
    for y in 0..text.height() {
        for (sum, is_stroke) in before[1..].iter_mut().zip(text.row(y)) {
            *sum += usize::from(*is_stroke);
        }
    }
    for x in 1..before.len() {
        before[x] += before[x - 1];
    }
    let all = before[text.width()];
    let most = BEYOND_PIECES * all as f64;
    let last = text.width() as f64;
    let half = FRAME_HALF_MM / PIXEL_MM;
    let is_outer = |x: f64| {
        let [low, high] = [x - half, x + half].map(|x| before[x.clamp(0.0, last) as usize]);
        low as f64 <= most || (all - high) as f64 <= most
    };
    take_broken_rules(text, erased, carved, &FRAME_PIECES, is_outer)
}
