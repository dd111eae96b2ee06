//! The characters of a block with the results of their pairs.

use serde::Serialize;

use crate::pictures::{BLUE, ORANGE, VERMILLION};
use mocban_catalog::{MetricRecord, PairResults, StoredCharacter};
use mocban_core::domain::{BlockCharacterState, JobStatus, ThresholdMetric, enum_names};
use mocban_results::Consensus;

/// Colour of characters whose pairs have no result yet.
const GREY: [u8; 3] = [120, 120, 120];
/// Positions with a lower confidence are marked as uncertain, and those below the second value as doubtful.
const SURE_POSITION: f64 = 0.8;
const DOUBTFUL_POSITION: f64 = 0.5;

/// What became of a character.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CharacterStatus {
    /// Its pair is aligned.
    Done,
    /// Its pair is aligned with low confidence.
    LowConfidence,
    /// Its pair failed, reviewers failed the result, or nothing was cut.
    Failed,
    /// Its pair has no result yet.
    Waiting,
}

enum_names! { pub CharacterStatus, "a status of a character":
    Done = "done", LowConfidence = "low_confidence", Failed = "failed", Waiting = "waiting",
}

impl CharacterStatus {
    /// Returns its colour.
    pub const fn colour(self) -> [u8; 3] {
        match self {
            Self::Done => BLUE,
            Self::LowConfidence => ORANGE,
            Self::Failed => VERMILLION,
            Self::Waiting => GREY,
        }
    }

    /// Returns its text in a legend.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Done => "pair done",
            Self::LowConfidence => "pair done, low confidence",
            Self::Failed => "pair failed, or not cut",
            Self::Waiting => "pair not run",
        }
    }
}

/// How sure the position of a character is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PositionConfidence {
    Sure,
    Uncertain,
    Doubtful,
}

impl PositionConfidence {
    pub(super) const ALL: [Self; 3] = [Self::Sure, Self::Uncertain, Self::Doubtful];

    /// Returns the class of a confidence, 0..=1. An unknown one is uncertain.
    pub(super) fn of(confidence: Option<f64>) -> Self {
        match confidence {
            Some(value) if value >= SURE_POSITION => Self::Sure,
            Some(value) if value < DOUBTFUL_POSITION => Self::Doubtful,
            _ => Self::Uncertain,
        }
    }

    /// Returns the colour behind the name.
    pub(super) const fn colour(self) -> [u8; 3] {
        match self {
            Self::Sure => [214, 234, 248],
            Self::Uncertain => [255, 224, 150],
            Self::Doubtful => [255, 178, 140],
        }
    }

    /// Returns its text in a legend.
    pub(super) const fn title(self) -> &'static str {
        match self {
            Self::Sure => "position sure (0.8 to 1)",
            Self::Uncertain => "uncertain (0.5 to 0.8)",
            Self::Doubtful => "doubtful (below 0.5)",
        }
    }
}

/// A character of a block with the result of its pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CharacterView {
    /// The label.
    pub label: String,
    /// The character, if the labels name it.
    pub character: Option<String>,
    /// Edges of its box on the page in pixels: left, top, right, bottom.
    #[serde(rename = "box")]
    pub bounds: [f64; 4],
    /// How sure its position is, from 0 to 1.
    pub position_confidence: Option<f64>,
    /// What became of it.
    pub status: CharacterStatus,
    /// Confidence of the result of its pair, from 0 to 1.
    pub confidence: Option<f64>,
    /// `IoU` of the masks of its pair.
    pub iou: Option<f64>,
    /// Why there is no result.
    pub reason: Option<String>,
    /// Whether its pair has a result that the 3D view can show.
    pub has_scan: bool,
}

impl CharacterView {
    /// Describes a character. `pair` is its pair with the results, if it was cut; see [`shown_record`].
    pub(super) fn new(
        stored: &StoredCharacter,
        pair: Option<&PairResults>,
        metric: Option<ThresholdMetric>,
    ) -> Self {
        let record = pair.and_then(|pair| shown_record(pair, metric));
        let failure = pair.and_then(|pair| pair.failure.as_ref());
        let failure = failure.map(|stored| stored.failure.message.clone());
        Self {
            label: stored.label.clone(),
            character: stored.character.clone(),
            bounds: stored.bounds,
            position_confidence: stored.confidence,
            status: status(stored, pair, record),
            confidence: record.and_then(|record| record.outcome.confidence),
            iou: record.map(|record| record.outcome.scores.iou),
            reason: stored.reason.clone().or(failure),
            has_scan: record.is_some(),
        }
    }
}

/// Returns the result of a metric. Without one, returns that of the default metric, or else the first that the pair has.
pub(super) fn shown_record(
    pair: &PairResults,
    metric: Option<ThresholdMetric>,
) -> Option<&MetricRecord> {
    if let Some(metric) = metric {
        return pair.metric(metric);
    }
    let default = pair.metric(ThresholdMetric::DEFAULT);
    default.or_else(|| pair.metrics.first())
}

fn status(
    stored: &StoredCharacter,
    pair: Option<&PairResults>,
    record: Option<&MetricRecord>,
) -> CharacterStatus {
    if stored.state == BlockCharacterState::Left {
        return CharacterStatus::Failed;
    }
    match (pair.map(|pair| pair.status), record) {
        (Some(JobStatus::Quarantined), _) => CharacterStatus::Failed,
        (_, Some(record)) if Consensus::of(record) == Consensus::Failed => CharacterStatus::Failed,
        (_, Some(record)) if record.outcome.is_low_confidence() => CharacterStatus::LowConfidence,
        (_, Some(_)) => CharacterStatus::Done,
        (_, None) => CharacterStatus::Waiting,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::{CharacterStatus, CharacterView, PositionConfidence};
    use mocban_catalog::{PairResults, StoredCharacter};
    use mocban_core::domain::{BlockCharacterState, FailureClass, ThresholdMetric, Verdict};
    use mocban_results::test_fixtures;

    /// A character at a box of the page.
    pub(in crate::block_view) fn stored(
        label: &str,
        bounds: [f64; 4],
        state: BlockCharacterState,
    ) -> StoredCharacter {
        StoredCharacter {
            label: label.to_owned(),
            character: Some("明".to_owned()),
            bounds,
            confidence: Some(0.91),
            state,
            reason: None,
            maps: None,
            pair: Some(format!("b_{label}")),
        }
    }

    fn status(state: BlockCharacterState, pair: Option<&PairResults>) -> CharacterView {
        let stored = stored("c1", [0.0, 0.0, 9.0, 9.0], state);
        CharacterView::new(&stored, pair, None)
    }

    #[test]
    fn a_metric_that_is_asked_for_is_not_replaced_by_another() {
        let stored = stored("c1", [0.0, 0.0, 9.0, 9.0], BlockCharacterState::Cut);
        let by_paper = test_fixtures::done_by_paper("b_c1", 0.8, &[]);
        let status = |metric| CharacterView::new(&stored, Some(&by_paper), metric).status;
        let relief = Some(ThresholdMetric::Relief);
        assert_eq!(status(relief), CharacterStatus::Waiting);
        assert_eq!(status(None), CharacterStatus::Done);
        let mut only_first = by_paper.clone();
        only_first.metrics.truncate(1);
        let shown = CharacterView::new(&stored, Some(&only_first), None);
        assert_eq!(shown.status, CharacterStatus::Done);
    }

    #[test]
    fn the_status_is_that_of_the_pair() {
        let cut = |pair: &PairResults| status(BlockCharacterState::Cut, Some(pair)).status;
        let failed = test_fixtures::failed("b_c1", FailureClass::NoSolution, "no match");
        let rejected = test_fixtures::done("b_c1", 0.9, &[Verdict::Fail]);
        let low = test_fixtures::with_confidence("b_c1", 0.2);
        assert_eq!(cut(&failed), CharacterStatus::Failed);
        assert_eq!(cut(&rejected), CharacterStatus::Failed);
        assert_eq!(cut(&low), CharacterStatus::LowConfidence);
        assert_eq!(
            cut(&test_fixtures::with_confidence("b_c1", 0.9)),
            CharacterStatus::Done
        );
        assert_eq!(
            cut(&test_fixtures::pending("b_c1")),
            CharacterStatus::Waiting
        );
        let left = status(BlockCharacterState::Left, None);
        assert_eq!(
            (left.status, left.has_scan),
            (CharacterStatus::Failed, false)
        );
        let failed = status(BlockCharacterState::Cut, Some(&failed));
        assert_eq!(failed.reason.as_deref(), Some("no match"));
    }

    #[test]
    fn positions_have_three_classes() {
        let of = PositionConfidence::of;
        assert_eq!(of(Some(0.8)), PositionConfidence::Sure);
        assert_eq!(of(Some(0.79)), PositionConfidence::Uncertain);
        assert_eq!(of(Some(0.49)), PositionConfidence::Doubtful);
        assert_eq!(of(None), PositionConfidence::Uncertain);
    }
}
