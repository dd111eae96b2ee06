//! The images of the HTML report and the texts next to them, as plain data. `export` draws the images.

use mocban_catalog::VerdictEvent;
use mocban_core::domain::{PairName, ThresholdMetric, Verdict};

/// All images of a report.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gallery {
    /// Seed of the random choice.
    pub seed: u64,
    /// In the order in which they are shown.
    pub groups: Vec<GalleryGroup>,
}

/// Results that are shown for the same reason.
#[derive(Debug, Clone, PartialEq)]
pub struct GalleryGroup {
    /// The reason.
    pub reason: GalleryReason,
    /// Number of such results in the project.
    pub total: u64,
    /// The results whose images are shown.
    pub items: Vec<GalleryItem>,
}

/// Why a result is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GalleryReason {
    /// Reviewers failed it.
    Failed,
    /// Reviewers disagree on it.
    Conflict,
    /// It misses the ground truth.
    OffTruth,
    /// Its confidence is low.
    LowConfidence,
    /// It was chosen at random.
    Random,
}

impl GalleryReason {
    /// Every reason, in the order of the report.
    pub const ALL: [Self; 5] = [
        Self::Failed,
        Self::Conflict,
        Self::OffTruth,
        Self::LowConfidence,
        Self::Random,
    ];
}

/// One result with its images.
#[derive(Debug, Clone, PartialEq)]
pub struct GalleryItem {
    /// The pair.
    pub pair: PairName,
    /// The character. `None` if it is not known.
    pub character: Option<String>,
    /// File names of mesh and print.
    pub files: [String; 2],
    /// The metrics whose results look like this.
    pub metrics: Vec<ThresholdMetric>,
    /// Scores and errors as text.
    pub numbers: String,
    /// Verdicts, each with reviewer, reason and note.
    pub verdicts: Vec<String>,
    /// Print, aligned relief and overlay as JPEG. An image that could not be drawn is `None`.
    pub images: [Option<Vec<u8>>; 3],
    /// Why an image is missing.
    pub problem: Option<String>,
}

/// Formats a verdict, such as `lan: fail, angle (“upper half”)`.
pub fn verdict_text(event: &VerdictEvent) -> String {
    let mut text = format!("{}: {}", event.reviewer, event.verdict);
    let reason = event.reason.filter(|_| event.verdict == Verdict::Fail);
    text.extend(reason.map(|reason| format!(", {}", reason.title())));
    let note = event.note.as_deref().filter(|note| !note.trim().is_empty());
    text.extend(note.map(|note| format!(" (\u{201c}{}\u{201d})", note.trim())));
    text
}
