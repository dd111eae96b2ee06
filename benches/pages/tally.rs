//! Counts of found boxes against the truth.

use mocban_align::block::{CharacterBox, FoundBox, check_label_fit};
use mocban_core::domain::{BoxMatches, box_iou};

use super::page::RegisteredPage;

/// Confidence from which the position of a character counts as sure.
const SURE: f64 = 0.5;
/// Overlap from which a box holds a part of a character.
const TOUCHING: f64 = 0.1;

/// Counts of one page.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PageTally {
    /// Pixels of the page per mm.
    px_per_mm: f64,
    /// Characters, boxes, and pairs of both.
    whole: u64,
    found: u64,
    matched: u64,
    /// The same for notes alone: notes, and notes with a box.
    notes: u64,
    notes_matched: u64,
    /// Boxes that hold nothing of a character, and how many of them are placed with confidence.
    spurious: u64,
    accepted: u64,
    /// Boxes with the name of the character that they match.
    named: u64,
}

impl PageTally {
    /// Counts the boxes of a page.
    pub(super) fn of(page: &RegisteredPage, found: &[FoundBox]) -> Self {
        let truth = page.truth.true_boxes();
        let boxes: Vec<[f64; 4]> = found.iter().map(|one| one.page_box).collect();
        let counts = BoxMatches::of(&truth, &boxes, 0.5);
        let whole = page.truth.characters.iter().filter(|one| one.on_page);
        let notes: Vec<_> = whole.filter(|one| one.part.note).collect();
        let is_near =
            |bounds: [f64; 4], least: f64| boxes.iter().any(|one| box_iou(*one, bounds) >= least);
        let notes_matched = notes
            .iter()
            .filter_map(|one| one.box_px)
            .filter(|bounds| is_near(*bounds, 0.5));
        let labels: Vec<CharacterBox> = found
            .iter()
            .map(|one| CharacterBox {
                name: one.name(),
                text: None,
                page_box: one.page_box,
            })
            .collect();
        let placed = page.place(&labels);
        let spurious: Vec<usize> = (0..boxes.len())
            .filter(|k| {
                truth
                    .iter()
                    .all(|one| box_iou(one.bounds, boxes[*k]) < TOUCHING)
            })
            .collect();
        let accepted = spurious
            .iter()
            .filter(|k| placed.characters[**k].confidence >= SURE);
        let named = found.iter().filter(|one| {
            page.truth.characters.iter().any(|character| {
                character.name == one.name()
                    && character
                        .box_px
                        .is_some_and(|bounds| box_iou(bounds, one.page_box) >= 0.5)
            })
        });
        Self {
            px_per_mm: page.truth.px_per_mm,
            whole: counts.whole,
            found: counts.found,
            matched: counts.matched,
            notes: notes.len() as u64,
            notes_matched: notes_matched.count() as u64,
            spurious: spurious.len() as u64,
            accepted: accepted.count() as u64,
            named: named.count() as u64,
        }
    }

    fn plus(self, other: &Self) -> Self {
        Self {
            px_per_mm: 0.0,
            whole: self.whole + other.whole,
            found: self.found + other.found,
            matched: self.matched + other.matched,
            notes: self.notes + other.notes,
            notes_matched: self.notes_matched + other.notes_matched,
            spurious: self.spurious + other.spurious,
            accepted: self.accepted + other.accepted,
            named: self.named + other.named,
        }
    }

    fn ratios(&self) -> [f64; 2] {
        [self.found, self.whole].map(|all| self.matched as f64 / all.max(1) as f64)
    }

    /// Returns the counts as text.
    pub(super) fn line(&self) -> String {
        let [precision, recall] = self.ratios();
        format!(
            "{:.1} px/mm, {} characters, P {precision:.3} R {recall:.3}, notes {} of {}, spurious {} ({} accepted), named {}",
            self.px_per_mm,
            self.whole,
            self.notes_matched,
            self.notes,
            self.spurious,
            self.accepted,
            self.named
        )
    }
}

/// Returns the sums of several pages as text.
pub(super) fn sum_line(name: &str, tallies: &[PageTally]) -> String {
    let sum = tallies.iter().fold(PageTally::default(), PageTally::plus);
    let [precision, recall] = sum.ratios();
    let note_recall = sum.notes_matched as f64 / sum.notes.max(1) as f64;
    let least = |k: usize| {
        tallies
            .iter()
            .map(|one| one.ratios()[k])
            .fold(1.0, f64::min)
    };
    format!(
        "== {name}: {} pages, {} characters, P {precision:.4} (least {:.3}) R {recall:.4} (least {:.3}), notes {note_recall:.3} of {}, \
         spurious {} ({} accepted), named {:.4}",
        tallies.len(),
        sum.whole,
        least(0),
        least(1),
        sum.notes,
        sum.spurious,
        sum.accepted,
        sum.named as f64 / sum.matched.max(1) as f64,
    )
}

/// Which labels are accepted: right ones, mirrored ones and turned ones.
pub(super) type LabelAnswers = [bool; 3];

/// Checks labels as drawn by hand, and the same for the mirrored and the turned page.
pub(super) fn label_answers(page: &RegisteredPage) -> LabelAnswers {
    let whole = page.truth.characters.iter().filter(|one| one.on_page);
    let boxes: Vec<[f64; 4]> = whole
        .filter_map(|one| one.box_px)
        .enumerate()
        .map(|(k, bounds)| drawn(k, bounds))
        .collect();
    let [width, height] = page.ink.size().map(|side| side as f64 - 1.0);
    let changes: [&dyn Fn([f64; 4]) -> [f64; 4]; 3] = [
        &|bounds| bounds,
        &|[left, top, right, bottom]| [width - right, top, width - left, bottom],
        &|[left, top, right, bottom]| [width - right, height - bottom, width - left, height - top],
    ];
    changes.map(|change| {
        let labels: Vec<CharacterBox> = boxes
            .iter()
            .map(|bounds| CharacterBox {
                name: String::new(),
                text: None,
                page_box: change(*bounds),
            })
            .collect();
        check_label_fit(&page.ink, &labels).is_ok()
    })
}

/// Moves the edges of a box by up to a tenth of its size outwards or a twentieth inwards, as a hand does.
fn drawn(number: usize, [left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
    let (width, height) = (right - left, bottom - top);
    let outwards = |edge: usize| {
        let hash = (4 * number + edge).wrapping_mul(2_654_435_761) >> 7;
        (hash % 151) as f64 / 1_000.0 - 0.05
    };
    [
        left - outwards(0) * width,
        top - outwards(1) * height,
        right + outwards(2) * width,
        bottom + outwards(3) * height,
    ]
}
