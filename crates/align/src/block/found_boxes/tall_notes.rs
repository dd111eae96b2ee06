//! Two notes side by side that are as high as the characters of the text.
//!
//! Such a row looks like a character of two parts. Four measures distinguish them: the gap between the notes is wide and in
//! the middle of the column, and both together are wider and have more strokes than a character.

use super::column_profile::{ColumnProfile, RowSpan};
use super::layout::CELL_MM;

/// For each measure, the value at which it says nothing, and the change by which it counts 1.
const WIDTH: [f64; 2] = [1.06, 0.06];
const STROKES: [f64; 2] = [1.25, 0.2];
const GAP_MM: [f64; 2] = [0.5, 0.8];
const OFF_MIDDLE: [f64; 2] = [0.03, 0.03];
/// Largest and least that one measure counts; a gap beside the middle counts at most twice as much against two notes.
const MOST: f64 = 1.5;
/// Least sum of all measures, and least sum on a page with fewer than [`FEW_ROWS`] such rows.
const MIN_EVIDENCE: f64 = 0.8;
const MIN_EVIDENCE_OF_FEW: f64 = 2.2;
pub(super) const FEW_ROWS: usize = 3;
/// Fewest characters that say what is usual.
const MIN_CHARACTERS: usize = 5;

/// What is usual for one character.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UsualCharacter {
    /// Width of its strokes, cells.
    width: f64,
    /// Number of strokes that a line across it meets.
    strokes: f64,
    /// Least evidence for two notes.
    min_evidence: f64,
}

impl UsualCharacter {
    /// Returns the medians of rows without a gap in the middle; `None` if there are few of them.
    pub(super) fn of(spans: impl Iterator<Item = RowSpan>) -> Option<Self> {
        let whole: Vec<RowSpan> = spans.filter(|span| span.gap.is_none()).collect();
        if whole.len() < MIN_CHARACTERS {
            return None;
        }
        let median = |value: &dyn Fn(&RowSpan) -> f64| {
            let mut values: Vec<f64> = whole.iter().map(value).collect();
            let middle = values.len() / 2;
            *values.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        Some(Self {
            width: median(&|span| span.width()).max(1.0),
            strokes: median(&|span| span.strokes).max(1.0),
            min_evidence: MIN_EVIDENCE,
        })
    }

    /// Returns the same for a page with few rows of notes, which need more evidence.
    pub(super) const fn of_few_notes(self) -> Self {
        Self {
            min_evidence: MIN_EVIDENCE_OF_FEW,
            ..self
        }
    }

    /// Returns the position across between two notes if a row looks like two rather than one character.
    pub(super) fn middle_of_two(&self, profile: &ColumnProfile, span: &RowSpan) -> Option<usize> {
        let [from, to] = span.gap?;
        let counts = |value: f64, [none, one]: [f64; 2]| ((value - none) / one).clamp(-MOST, MOST);
        let middle = f64::midpoint(from as f64, to as f64);
        let width = profile.width as f64;
        let off = (middle - profile.left as f64 - width / 2.0).abs() / width;
        let evidence = counts(span.width() / self.width, WIDTH)
            + counts(span.strokes / self.strokes, STROKES)
            + counts((to - from) as f64 * CELL_MM, GAP_MM)
            - ((off - OFF_MIDDLE[0]) / OFF_MIDDLE[1]).clamp(0.0, 2.0 * MOST);
        (evidence > self.min_evidence).then_some(usize::midpoint(from, to))
    }
}
