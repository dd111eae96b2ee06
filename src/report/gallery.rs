//! The pictures of a report's page and what is said of each: drawn elsewhere, plain data here.

use crate::catalog::VerdictEvent;
use crate::domain::{PairName, ThresholdMetric, Verdict};

/// All pictures of a page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gallery {
    /// The seed of what was drawn by lot.
    pub seed: u64,
    /// In the order in which they are shown.
    pub groups: Vec<GalleryGroup>,
}

/// Results that are shown for the same reason.
#[derive(Debug, Clone, PartialEq)]
pub struct GalleryGroup {
    /// Why they are shown.
    pub kind: GalleryReason,
    /// How many there are in the project.
    pub of: u64,
    /// Those that were drawn.
    pub shots: Vec<GalleryItem>,
}

/// Why a result is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GalleryReason {
    /// Reviewers failed it.
    Failed,
    /// Reviewers contradict each other on it.
    Conflict,
    /// It is off the true alignment.
    OffTruth,
    /// By lot.
    Lot,
}

impl GalleryReason {
    /// Every kind, in the order of the page.
    pub const ALL: [Self; 4] = [Self::Failed, Self::Conflict, Self::OffTruth, Self::Lot];
}

/// One result with its pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct GalleryItem {
    /// The pair.
    pub pair: PairName,
    /// The character, where it is told.
    pub character: Option<String>,
    /// Paths of mesh and print.
    pub files: [String; 2],
    /// The metrics that came to this result.
    pub metrics: Vec<ThresholdMetric>,
    /// Its numbers in words.
    pub numbers: String,
    /// What reviewers said of it, each with the reason and the note.
    pub said: Vec<String>,
    /// Print, relief laid on it, and overlay as JPEG, as far as they could be drawn.
    pub pictures: [Option<Vec<u8>>; 3],
    /// Why one of them is missing.
    pub trouble: Option<String>,
}

/// What a reviewer said in one act, such as `lan: fail, angle (“upper half”)`.
pub fn said(event: &VerdictEvent) -> String {
    let mut words = format!("{}: {}", event.reviewer, event.verdict);
    let reason = event.reason.filter(|_| event.verdict == Verdict::Fail);
    words.extend(reason.map(|reason| format!(", {}", reason.title())));
    let note = event.note.as_deref().filter(|note| !note.trim().is_empty());
    words.extend(note.map(|note| format!(" (\u{201c}{}\u{201d})", note.trim())));
    words
}
