//! What the catalog tells its readers: plain values, pairs always in the order of their names.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::catalog::records::verdicts::VerdictEvent;
use crate::domain::{
    ArtifactSet, ContentHash, Failure, FailureClass, JobStatus, LengthUnit, MetricOutcome,
    PairName, Reason, ReviewOrder, Stage, ThresholdMetric, UnixMillis, Verdict,
};

/// Counts of the whole project; `status --json` prints them with whether a process is at work.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StatusCounts {
    /// Version of this form.
    pub schema: u32,
    /// Pairs in the project.
    pub pairs: u64,
    /// Pairs by the state of their job; every status is there.
    pub jobs: BTreeMap<JobStatus, u64>,
    /// Pairs by stage; every stage is there.
    pub stages: BTreeMap<Stage, StageCounts>,
    /// Pairs whose results were made with other settings or inputs than the current ones.
    pub stale: u64,
    /// Pairs that are done with a result less confident than [`MetricOutcome::LOW_CONFIDENCE`].
    pub low_confidence: u64,
    /// Verdicts on current results, the newest of each reviewer.
    pub verdicts: BTreeMap<Verdict, u64>,
}

/// Pairs at one stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct StageCounts {
    /// Have this stage behind them.
    pub done: u64,
    /// Have it before them.
    pub pending: u64,
    /// Failed at it.
    pub failed: u64,
}

/// A failure as stored, with the stage it happened at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredFailure {
    /// Where it failed.
    pub stage: Stage,
    /// Class and message.
    #[serde(flatten)]
    pub failure: Failure,
    /// When.
    pub at: UnixMillis,
}

/// A failed pair in a list of failures.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailedPair {
    /// The pair.
    pub name: PairName,
    /// Quarantined or backing off.
    pub status: JobStatus,
    /// What happened.
    #[serde(flatten)]
    pub failure: StoredFailure,
}

/// The current result of one stage of one pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageRecord {
    /// Which stage.
    pub stage: Stage,
    /// The stage's numbers as JSON; read them with [`StageRecord::parse`].
    pub outcome: Value,
    /// Its artifacts by role.
    pub files: ArtifactSet,
    /// Hash over outcome and files; the same bytes give the same hash.
    pub result_hash: ContentHash,
    /// Hash of the settings it was computed with, earlier stages' included.
    pub fingerprint_hash: ContentHash,
    /// Those settings: revision and settings of this stage.
    pub fingerprint_fields: Value,
    /// Content of the mesh it was computed from.
    pub mesh_hash: ContentHash,
    /// Content of the print it was computed from; `None` for stages that do not see the print.
    pub print_hash: Option<ContentHash>,
    /// Time it took to compute, milliseconds.
    pub ms: u64,
    /// When it was stored.
    pub at: UnixMillis,
}

impl StageRecord {
    /// The outcome as its type in `domain`, such as `FitOutcome`.
    ///
    /// # Errors
    /// When the stored JSON is not of that type, as after an upgrade that changed it.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, serde_json::Error> {
        T::deserialize(&self.outcome)
    }
}

/// One reviewer's newest verdict on a current result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ReviewerVerdict {
    /// Who read it.
    pub reviewer: String,
    /// The judgement.
    pub verdict: Verdict,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// The order in which results came to the reviewer; [`ReviewOrder::Adjudicate`] marks a word on a conflict.
    pub review_order: Option<ReviewOrder>,
}

/// One metric's current result of one pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricRecord {
    /// The numbers.
    #[serde(flatten)]
    pub outcome: MetricOutcome,
    /// Hash over the numbers and the pictures a reviewer sees; verdicts are bound to it.
    pub result_hash: ContentHash,
    /// Verdicts on this very result, by reviewer.
    pub verdicts: Vec<ReviewerVerdict>,
    /// Verdicts on an older result of this pair and metric, not counted any more.
    pub older_verdicts: u64,
}

/// What was said of a pair when it was imported.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    /// The character, where it is told.
    pub character: Option<String>,
    /// The block, where it is told.
    pub block: Option<String>,
    /// Every other column.
    pub meta: Map<String, Value>,
}

/// One pair with its current results, for report and export.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairResults {
    /// What was said of it at import.
    #[serde(flatten)]
    pub attributes: PairAttributes,
    /// Where its job stands.
    pub status: JobStatus,
    /// Next stage; `None` when done.
    pub next_stage: Option<Stage>,
    /// Why it failed, when it is quarantined or backing off.
    pub failure: Option<StoredFailure>,
    /// Results of the stages behind it, in order.
    pub stages: Vec<StageRecord>,
    /// Results of the metrics that the method gave, in the order of [`ThresholdMetric::ALL`]; empty unless done.
    pub metrics: Vec<MetricRecord>,
    /// The true alignment as given, where there is one.
    pub truth: Option<Value>,
}

impl PairResults {
    /// The current result of a stage.
    pub fn stage(&self, stage: Stage) -> Option<&StageRecord> {
        self.stages.iter().find(|record| record.stage == stage)
    }

    /// The current result of a metric.
    pub fn metric(&self, metric: ThresholdMetric) -> Option<&MetricRecord> {
        self.metrics
            .iter()
            .find(|record| record.outcome.metric == metric)
    }

    /// Class of the failure.
    pub fn failure_class(&self) -> Option<FailureClass> {
        self.failure.as_ref().map(|stored| stored.failure.class)
    }

    /// Computing time of its current results in seconds.
    pub fn seconds(&self) -> f64 {
        self.stages.iter().map(|record| record.ms).sum::<u64>() as f64 / 1000.0
    }
}

/// One try of one stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AttemptRecord {
    /// Which stage.
    pub stage: Stage,
    /// `None` when it went well.
    pub failure: Option<Failure>,
    /// Computing time in milliseconds, where it is known.
    pub ms: Option<u64>,
    /// When it ended.
    pub at: UnixMillis,
}

/// Everything about one pair, for `show`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairDetail {
    /// Facts, state, results, failure, metrics with the verdicts that count.
    #[serde(flatten)]
    pub results: PairResults,
    /// Content of the mesh as last read.
    pub mesh_hash: Option<ContentHash>,
    /// Content of the print as last read.
    pub print_hash: Option<ContentHash>,
    /// Tries of the stage in hand.
    pub attempt: u32,
    /// Workers that died over it since its last finished stage.
    pub crashes: u32,
    /// When a pair that backs off is tried again.
    pub run_at: Option<UnixMillis>,
    /// Tries, oldest first.
    pub attempts: Vec<AttemptRecord>,
    /// Every verdict event of the pair, oldest first.
    pub verdict_log: Vec<VerdictEvent>,
}
