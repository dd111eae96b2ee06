//! The catalog: a database of SQLite or PostgreSQL with the data of every pair and the job queue. No other module
//! contains SQL.
//!
//! `db` has the connections, the writer task and the errors, `queue` the job queue, `records` the data of pairs,
//! `blocks` the data and jobs of whole blocks, `audit` the checks and repairs, and `transfer` copies to another
//! catalog. One writer task owns the only write connection of this process and commits requests in groups. Reads use
//! separate connections, also during a run. Callers pass the current time as an argument.

mod audit;
mod blocks;
mod db;
mod handle;
mod new_catalog;
#[cfg(test)]
#[path = "../../../tests/support/postgres_server.rs"]
mod postgres_server;
#[cfg(test)]
mod query_plans;
mod queue;
mod records;
mod retry;
#[cfg(any(test, feature = "test-helpers"))]
#[expect(clippy::missing_errors_doc, reason = "only tests call these methods")]
mod test_helpers;
#[cfg(test)]
mod tests;
mod transfer;
// The same tests on PostgreSQL.
#[cfg(test)]
#[path = "tests/mod.rs"]
#[allow(
    clippy::duplicate_mod,
    reason = "the module's name selects the database"
)]
mod tests_on_postgres;

pub use audit::audited_pairs::{AuditPage, AuditedPair, AuditedResult};
pub use audit::fingerprint_hashes::FaultyFingerprint;
pub use audit::integrity::{CounterDrift, Drift};
pub use blocks::claim::OutstandingBlocks;
pub use blocks::control_points::ControlPointsChange;
pub use blocks::cut::{CutReply, CutSummary};
pub use blocks::fail::BlockRetry;
pub use blocks::import::BlockImportSummary;
pub use blocks::model::{
    BlockAttributes, BlockCheckpoint, BlockFailure, BlockFailureAction, BlockInputVersions,
    BlockLease, BlockSettings, BlockWork, CharacterMaps, CutOrigin, CutPair, MadeWith,
    NewCharacter, StoredCharacter,
};
pub use blocks::records::{
    AuditedBlock, BlockAttemptRecord, BlockDetail, BlockStageDetail, BlockState, KnownBlock,
    StoredBlockFailure,
};
pub use blocks::selection::BlockSelection;
pub use blocks::staleness::{BlockPlanEntry, BlockReason};
pub use db::commit_delay::Waiting;
pub use db::error::{CatalogError, LogLoss, Result};
pub use db::error_kind::CatalogErrorKind;
pub use db::lock_owner::{LockOwner, lock_owner};
pub use db::roles::{ROLES, initialize_database, roles_sql};
pub use handle::Catalog;
pub use mocban_core::domain::InputVersion;
pub use new_catalog::NewCatalog;
pub use queue::claim::ClaimRequest;
pub use queue::counters::JobCounts;
pub use queue::fingerprint::{Fingerprint, FingerprintIds, Fingerprints};
pub use queue::lease::{
    CheckpointOutcome, FailureAction, FingerprintId, InputVersions, Lease, MetricResult,
    StageCheckpoint, StageFailure,
};
pub use queue::plan::{FieldChange, Plan, PlanEntry, StaleReason};
pub use queue::recovery::{DeadWorker, LeaseHolder, Recovered};
pub use queue::requeue::RetrySelection;
pub use queue::selection::PairSelection;
pub use queue::shared_runs::SharedSettings;
pub use queue::staleness::RerunPolicy;
pub use queue::worker_list::{WorkerRecord, WorkerState};
pub use queue::workers::{Outstanding, WorkLeft, WorkerInfo, WorkerSettings};
pub use records::append_verdicts::{ImportedVerdicts, ListedVerdict};
pub use records::checksums::ChecksummedTable;
pub use records::faulty_rows::{FaultyRow, RowFault};
pub use records::import::{ImportChunk, ImportRow, ImportSummary, PairChange};
pub use records::manual_alignments::{ManualAlignment, StoredAlignment};
pub use records::model::{
    AttemptRecord, FailedPair, MetricRecord, PairAttributes, PairDetail, PairResults, StageCounts,
    StageRecord, StatusCounts, StoredFailure,
};
pub use records::pair_results::ResultPages;
pub use records::pair_work::{KnownInputs, PairWork};
pub use records::review_answers::{Answer, AnsweredOn, AttentionCheckAnswer, Shown};
pub use records::review_context::ReviewContext;
pub use records::review_rights::ReviewRights;
pub use records::set_apart::SetApart;
pub use records::verdict_rules::{InvalidVerdict, NOTE_CHARS, check_event, check_reviewer};
pub use records::verdicts::{NewVerdict, ReviewerVerdict, VerdictEvent};
pub use transfer::{CatalogCopy, CopiedTable, CopyProgress};
