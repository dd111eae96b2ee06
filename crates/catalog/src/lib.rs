//! The catalog: pairs, blocks, jobs, leases, results and verdicts in SQLite or PostgreSQL.
//!
//! - From the lowest to the highest, each imports only from those before it. `db`: connections, statements, errors; `queue`:
//!   leases, and what workers store under them; `handle.rs`: the open catalog; `jobs`: settings, stale and retired jobs, and
//!   counts; `records`: the data of pairs, verdicts and imports; `blocks`: the data of whole blocks; `worker_requests.rs` and
//!   `lease_recovery.rs`: both kinds of job; `audit`: checks and repairs; `transfer`: copies to another catalog
//! - A process has one write connection, which a task owns. It commits the requests of several pairs together, each at most
//!   250 ms after it arrived. Reads use other connections and go on during a run. Callers pass the current time.
//! - A statement has one text for both databases, which `db/dialect.rs` translates. Claims, and checkpoints of pairs, have a
//!   text for each database. In SQLite, the requests for pairs that are committed together are one transaction. In
//!   PostgreSQL, the checkpoints among them, and each claim, are one statement that commits by itself; claims begin behind
//!   the last claimed pair, because a snapshot that another session holds would keep dead rows in the way. Each request for a
//!   block is a transaction of its own.
//! - If the server is unavailable, the writer reconnects and repeats requests for pairs, and the runner those for blocks. The
//!   fencing token shows whether an earlier attempt was stored (`queue/lease.rs`). The write connection of a
//!   worker holds a lock, by which others see that it is gone.
//! - Rows that no run can compute again, such as verdicts, have checksums (`records/checksums.rs`).
//! - `db init --roles` gives the tables to group roles: the database refuses what a role may not do.
//!
//! Every call fails if a database operation fails. `# Errors` names other reasons, and what an error leaves behind.
//!
//! **Invariant:** no other crate contains SQL, and what a worker stores for a job whose lease it has lost is refused. Tests
//! of what both databases do run on both, if a PostgreSQL server can be started.

mod audit;
mod blocks;
mod db;
mod handle;
mod jobs;
mod lease_recovery;
mod new_catalog;
#[cfg(test)]
#[path = "../../../tests/support/postgres_server.rs"]
mod postgres_server;
#[cfg(test)]
mod query_plans;
mod queue;
mod records;
#[cfg(any(test, feature = "test-helpers"))]
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
mod worker_requests;

pub use audit::audited_pairs::{AuditPage, AuditedPair, AuditedResult};
pub use audit::fingerprint_hashes::FaultyFingerprint;
pub use audit::integrity::{CounterDrift, Drift};
pub use blocks::block_job::BlockJob;
pub use blocks::cut::{CutReply, CutSummary};
pub use blocks::import::BlockImportSummary;
pub use blocks::model::{
    BlockAttributes, BlockChange, BlockInputVersions, BlockProvenance, BlockWork, CharacterMaps,
    CutOrigin, CutPair, NewCharacter, StoredCharacter,
};
pub use blocks::queue::OutstandingBlocks;
pub use blocks::records::{AuditedBlock, BlockDetail, BlockStageDetail, BlockState, KnownBlock};
pub use blocks::selection::BlockSelection;
pub use blocks::staleness::{BlockPlanEntry, BlockReason};
pub use db::checksummed_table::ChecksummedTable;
pub use db::error::{CatalogError, LogLoss, Result};
pub use db::error_kind::CatalogErrorKind;
pub use db::lock_owner::{LockOwner, lock_owner};
pub use db::roles::{ROLES, initialize_database, roles_sql};
pub use handle::Catalog;
pub use jobs::block_settings::BlockSettings;
pub use jobs::fingerprint::{Fingerprint, FingerprintIds, Fingerprints};
pub use jobs::plan::{FieldChange, Plan, PlanEntry, StaleReason};
pub use jobs::requeue::RetrySelection;
pub use jobs::retired::{ImportedPair, LastImport, ListedRetiredPair, RetiredPair};
pub use jobs::shared_runs::SharedSettings;
pub use jobs::staleness::RerunPolicy;
pub use jobs::worker_list::{WorkerRecord, WorkerState};
pub use jobs::workers::{Outstanding, WorkLeft, WorkerInfo, WorkerSettings};
pub use lease_recovery::{DeadWorker, LeaseHolder, Recovered};
pub use mocban_core::domain::InputVersion;
pub use new_catalog::NewCatalog;
pub use queue::claim::ClaimRequest;
pub use queue::commit::writer::Waiting;
pub use queue::counters::JobCounts;
pub use queue::kind::JobKind;
pub use queue::lease::{CheckpointOutcome, Lease};
pub use queue::pair_job::PairJob;
pub use queue::provenance::{FingerprintId, InputVersions, PairProvenance};
pub use queue::selection::PairSelection;
pub use queue::stage_record::{FailureAction, MetricResult, StageCheckpoint, StageFailure};
pub use records::append_verdicts::{ImportedVerdicts, ListedVerdict};
pub use records::faulty_rows::{FaultyRow, RowFault};
pub use records::ignored_profiles::{IgnoredProfiles, ProfileCount};
pub use records::import::{ImportChunk, ImportRow, ImportSummary, ImportTerms, PairChange};
pub use records::joint_verdict::JointVerdict;
pub use records::listed_names::ListedNames;
pub use records::lost_values::{LostColumn, LostValues, has_value};
pub use records::manual_alignments::{ManualAlignment, StoredAlignment};
pub use records::model::{
    AttemptRecord, FailedPair, MetricRecord, PairAttributes, PairDetail, PairResults, PrintPlace,
    StageCounts, StageRecord, StatusCounts, StoredFailure, all_retired,
};
pub use records::pair_list::{MetricDifference, PairCursor, PairFilter, PairListPage, PairOrder};
pub use records::pair_work::{KnownInputs, PairWork};
pub use records::result_pages::ResultPages;
pub use records::review_answers::{Answer, AnsweredOn, AttentionCheckAnswer, Shown};
pub use records::review_context::ReviewContext;
pub use records::review_rights::ReviewRights;
pub use records::reviewer_names::person_name;
pub use records::same_files::{SameContents, SameFiles};
pub use records::scan_corrections::ScanCorrection;
pub use records::set_apart::SetApart;
pub use records::verdict_rules::{
    CLOCK_SKEW_MS, InvalidVerdict, NOTE_CHARS, check_event, reviewer_name,
};
pub use records::verdicts::{NewVerdict, ReviewerVerdict, VerdictEvent};
pub use transfer::rows::CopiedTable;
pub use transfer::{CatalogCopy, CopyProgress};
