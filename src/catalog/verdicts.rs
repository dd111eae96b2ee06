//! Verdicts: an append-only log; the newest of each reader on a result counts.

use serde::Serialize;

use super::{Catalog, Result};
use crate::domain::{ContentHash, PairName, Reason, ThresholdMetric, UnixMillis, Verdict};

/// A verdict to store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewVerdict {
    /// The pair.
    pub pair: PairName,
    /// One metric's result, or those of all metrics.
    pub metric: Option<ThresholdMetric>,
    /// The judgement.
    pub verdict: Verdict,
    /// Who read it.
    pub reader: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// In the reader's words.
    pub note: Option<String>,
}

/// One line of the verdict log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerdictEvent {
    /// Number in the log.
    pub id: i64,
    /// Number of the act; one act judges one or all metrics of a pair.
    pub act: i64,
    /// The pair.
    pub pair: PairName,
    /// The metric.
    pub metric: ThresholdMetric,
    /// The result that was judged.
    pub result_hash: ContentHash,
    /// The judgement.
    pub verdict: Verdict,
    /// Who read it.
    pub reader: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// In the reader's words.
    pub note: Option<String>,
    /// When.
    pub at: UnixMillis,
    /// When it was taken back, if it was.
    pub undone_at: Option<UnixMillis>,
    /// Whether the pair's current result is still the one that was judged.
    pub current: bool,
}

impl Catalog {
    /// Appends verdicts on the current results, all or none.
    ///
    /// # Errors
    /// When a pair is not there or has no result; then nothing is stored.
    pub async fn verdict_set(&self, verdicts: Vec<NewVerdict>, now: UnixMillis) -> Result<()> {
        let _ = (verdicts, now);
        todo!()
    }

    /// Takes back the newest act that is not taken back yet, of one reader or of anybody; says which.
    /// The log keeps both.
    ///
    /// # Errors
    /// When there is none.
    pub async fn verdict_undo(
        &self,
        reader: Option<&str>,
        now: UnixMillis,
    ) -> Result<Vec<VerdictEvent>> {
        let _ = (reader, now);
        todo!()
    }

    /// The log, oldest first, of one pair or of all.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn verdict_log(&self, pair: Option<&PairName>) -> Result<Vec<VerdictEvent>> {
        let _ = pair;
        todo!()
    }
}
