//! Results of queries, as plain values.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::Result;
use crate::db::row::{FromRow, Row, from_row};
use crate::db::rows::failure;
use crate::db::value::FromValue;
use crate::records::verdicts::{ReviewerVerdict, VerdictEvent};
use mocban_core::domain::{
    ArtifactSet, ContentHash, Failure, JobStatus, LengthUnit, MetricOutcome, PairName, Stage,
    ThresholdMetric, UnixMillis, Verdict,
};

/// Counts of the whole project, as in `status --json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StatusCounts {
    /// Version of this JSON schema.
    pub schema: u32,
    /// Number of pairs.
    pub pairs: u64,
    /// Number of retired pairs, for whatever cause. They are in no other count of pairs.
    pub retired: u64,
    /// Number of pairs by job status, all statuses included.
    pub jobs: BTreeMap<JobStatus, u64>,
    /// Number of pairs by stage, all stages included.
    pub stages: BTreeMap<Stage, StageCounts>,
    /// Number of pairs with stale results. A result is stale if its settings or inputs have changed since.
    pub stale: u64,
    /// Number of completed pairs for which a list names another mesh or print than before. The next run reads these files.
    pub other_files: u64,
    /// Number of completed pairs whose confidence by [`ThresholdMetric::DEFAULT`] is below
    /// [`MetricOutcome::LOW_CONFIDENCE`].
    pub low_confidence: u64,
    /// Number of verdicts on current results of completed pairs. Only the newest verdict of each reviewer counts.
    pub verdicts: BTreeMap<Verdict, u64>,
}

impl StatusCounts {
    /// Returns a clause if all pairs are retired, as [`all_retired`] does.
    pub fn all_retired(&self) -> Option<String> {
        all_retired(self.pairs, self.retired)
    }
}

/// Returns `all 2 pairs of the project are retired` if there are `retired` pairs and no others.
pub fn all_retired(pairs: u64, retired: u64) -> Option<String> {
    match (pairs, retired) {
        (1.., _) | (0, 0) => None,
        (0, 1) => Some("the only pair of the project is retired".to_owned()),
        (0, retired) => Some(format!("all {retired} pairs of the project are retired")),
    }
}

/// Counts of one stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct StageCounts {
    /// Pairs that completed the stage.
    pub done: u64,
    /// Pairs that have neither completed the stage nor failed at it.
    pub pending: u64,
    /// Pairs that failed at it.
    pub failed: u64,
}

/// A stored failure with its stage, of a pair or a block.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredFailure<S = Stage> {
    /// The stage that failed.
    pub stage: S,
    /// Class and message.
    #[serde(flatten)]
    pub failure: Failure,
    /// When.
    pub at: UnixMillis,
}

/// Reads the stored failure of a job, if there is one.
pub(crate) fn stored_failure<S: FromValue>(row: &Row) -> Result<Option<StoredFailure<S>>> {
    let (stage, at): (Option<S>, Option<_>) = (row.get("failed_stage")?, row.get("failed_at")?);
    let whole = stage.zip(failure(row)?).zip(at);
    Ok(whole.map(|((stage, failure), at)| StoredFailure { stage, failure, at }))
}

/// A quarantined pair in a list of failures.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailedPair {
    /// The pair.
    pub name: PairName,
    /// Status of its job.
    pub status: JobStatus,
    /// The failure.
    #[serde(flatten)]
    pub failure: StoredFailure,
}

/// The current result of one stage of one pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageRecord {
    /// The stage.
    pub stage: Stage,
    /// Outcome of the stage as JSON; parse it with [`StageRecord::parse`].
    pub outcome: Value,
    /// Its artifacts by role.
    pub files: ArtifactSet,
    /// Hash of the outcome and the artifacts. Equal bytes give equal hashes.
    pub result_hash: ContentHash,
    /// Hash of the settings of this stage and of all earlier stages.
    pub fingerprint_hash: ContentHash,
    /// Revision and settings of this stage.
    pub fingerprint_fields: Value,
    /// Hash of the mesh that the result was computed from.
    pub mesh_hash: ContentHash,
    /// Hash of the print that the result was computed from. `None` if the stage does not read the print.
    pub print_hash: Option<ContentHash>,
    /// Computing time in milliseconds.
    pub ms: u64,
    /// When the result was stored.
    pub at: UnixMillis,
}

from_row! { StageRecord { stage, outcome as Json, files as Json, result_hash, fingerprint_hash, fingerprint_fields as Json, mesh_hash, print_hash, ms, at } }

impl StageRecord {
    /// Parses the outcome as a type of `domain`, such as `FitOutcome` for the stage `Fit`.
    ///
    /// # Errors
    /// Returns an error if the stored JSON does not match the type, for example after an upgrade.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, serde_json::Error> {
        T::deserialize(&self.outcome)
    }
}

/// One metric's current result of one pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricRecord {
    /// The numbers.
    #[serde(flatten)]
    pub outcome: MetricOutcome,
    /// Hash of the numbers, except the confidence, and of the images that reviewers see. A verdict refers to a result
    /// by this hash.
    pub result_hash: ContentHash,
    /// Verdicts on this result, by reviewer.
    pub verdicts: Vec<ReviewerVerdict>,
    /// Number of verdicts on other results of this pair and metric, which do not count. Of a reviewer's verdicts on one
    /// result, only the newest is included.
    pub older_verdicts: u64,
}

/// Attributes of a pair as imported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairAttributes {
    /// The user's id.
    pub name: PairName,
    /// Path of the mesh as stored: relative to the project, or absolute.
    pub mesh_path: String,
    /// Path of the print, likewise.
    pub print_path: String,
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
    /// Whether the block lay face down when scanned.
    pub scanned_face_down: Option<bool>,
    /// The character, if given.
    pub character: Option<String>,
    /// The block, if given.
    pub block: Option<String>,
    /// All other columns of the manifest.
    pub meta: Map<String, Value>,
    /// The alignment that is expected of a pair cut from a block, as JSON text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<String>,
}

impl PairAttributes {
    /// Returns whether a list has certainly named the pair. Its block, its unit and its side may have been typed, and a pair that
    /// was cut from a block has the character of its box.
    pub fn is_listed(&self) -> bool {
        self.prior.is_none() && (self.character.is_some() || !self.meta.is_empty())
    }

    /// Returns whether an import of folders would take something from the pair: folders give no columns but a block, whose pairs
    /// are named `BLOCK_STEM`.
    pub fn has_more_than_folders_give(&self) -> bool {
        let is_of_folder = |block: &str| {
            let stem = self.name.as_str().strip_prefix(block);
            stem.is_some_and(|stem| stem.starts_with('_'))
        };
        self.character.is_some()
            || self.scanned_face_down.is_some()
            || !self.meta.is_empty()
            || self
                .block
                .as_deref()
                .is_some_and(|block| !is_of_folder(block))
    }
}

from_row! { PairAttributes { name, mesh_path, print_path, unit, scanned_face_down, character, block, meta as Json, prior } }

/// Where the print of a pair lies on the page of its block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintPlace {
    /// Map (3 x 3) from pixels of the print to pixels of the page.
    pub page_from_crop: [[f64; 3]; 3],
    /// Edges of its box on the page in pixels: left, top, right, bottom.
    pub bounds: [f64; 4],
}

/// One pair with its current results, for report and export.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairResults {
    /// Attributes as imported.
    #[serde(flatten)]
    pub attributes: PairAttributes,
    /// Status of its job.
    pub status: JobStatus,
    /// Next stage. `None` if the pair is done.
    pub next_stage: Option<Stage>,
    /// The failure, if the pair is quarantined or backing off.
    pub failure: Option<StoredFailure>,
    /// Results of the completed stages, in order.
    pub stages: Vec<StageRecord>,
    /// Results of the computed metrics, in the order of [`ThresholdMetric::ALL`]. Empty if the pair is not done.
    pub metrics: Vec<MetricRecord>,
    /// The true alignment as given, if any, with the crop of the page that it is for, if the pair was cut from a block.
    pub truth: Option<Value>,
    /// Where its print lies on the page now, if it was cut from a block and has a true alignment.
    #[serde(skip)]
    pub print_place: Option<PrintPlace>,
}

impl PairResults {
    /// Returns the current result of a stage.
    pub fn stage(&self, stage: Stage) -> Option<&StageRecord> {
        self.stages.iter().find(|record| record.stage == stage)
    }

    /// Returns the current result of a metric.
    pub fn metric(&self, metric: ThresholdMetric) -> Option<&MetricRecord> {
        self.metrics
            .iter()
            .find(|record| record.outcome.metric == metric)
    }

    /// Returns the computing time of its current results in seconds.
    pub fn seconds(&self) -> f64 {
        self.stages.iter().map(|record| record.ms).sum::<u64>() as f64 / 1000.0
    }
}

/// One attempt at one stage, of a pair or a block.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AttemptRecord<S = Stage> {
    /// The stage.
    pub stage: S,
    /// The failure. `None` if the attempt succeeded.
    pub failure: Option<Failure>,
    /// Computing time in milliseconds, if known.
    pub ms: Option<u64>,
    /// When it ended.
    pub at: UnixMillis,
}

impl<S: FromValue> FromRow for AttemptRecord<S> {
    fn from_row(row: &Row) -> Result<Self> {
        Ok(Self {
            stage: row.get("stage")?,
            failure: failure(row)?,
            ms: row.get("ms")?,
            at: row.get("at")?,
        })
    }
}

/// Everything about one pair, for `show`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairDetail {
    /// Attributes, status, failure and current results, with each reviewer's newest verdicts.
    #[serde(flatten)]
    pub results: PairResults,
    /// Content of the mesh as last read.
    pub mesh_hash: Option<ContentHash>,
    /// Content of the print as last read.
    pub print_hash: Option<ContentHash>,
    /// Number of attempts at the current stage.
    pub attempt: u32,
    /// Number of worker deaths and overdue leases blamed on the pair since its last stored stage or requeue.
    pub crashes: u32,
    /// When the back-off ends.
    pub run_at: Option<UnixMillis>,
    /// Attempts, oldest first.
    pub attempts: Vec<AttemptRecord>,
    /// Every verdict event of the pair, oldest first.
    pub verdict_log: Vec<VerdictEvent>,
}
