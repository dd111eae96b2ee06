//! The catalog: what is known of every pair, and the queue of work. The only room with SQL.
//!
//! One writer task owns the only write connection and commits in groups; readers have their own connections and
//! work while a run goes on. All times come in as arguments.

mod audit;
mod db;
mod handle;
mod queue;
mod records;
#[cfg(test)]
mod tests;

pub use audit::integrity::{AuditedPair, AuditedResult, CounterDrift, Drift};
pub use db::commit_delay::Waiting;
pub use db::error::{CatalogError, Result};
pub use db::error_kind::Trouble;
pub use db::lock_owner::{Holder, holder};
pub use handle::Catalog;
pub use queue::claim::{ClaimRequest, PairSelection};
pub use queue::counters::Counts;
pub use queue::fingerprint::{Recipe, RecipeIds, Recipes};
pub use queue::lease::{
    InputSeen, InputsSeen, Kept, Lease, MetricResult, RecipeId, Sentence, StageDone, StageFailed,
};
pub use queue::plan::{FieldChange, Plan, PlanEntry, WorkReason};
pub use queue::recovery::{Dead, LeaseHolder, Rescued};
pub use queue::requeue::RetrySelection;
pub use queue::staleness::Again;
pub use queue::workers::{Outstanding, WorkLeft, WorkerInfo};
pub use records::import::{ImportChunk, ImportRow, ImportSummary, PairChange};
pub use records::look::Look;
pub use records::manual_alignments::{ManualAlignment, StoredAlignment};
pub use records::model::{
    AttemptRecord, FailedPair, MetricRecord, PairDetail, PairFacts, PairResults, ReviewerVerdict,
    StageCounts, StageRecord, StatusCounts, StoredFailure,
};
pub use records::pages::ResultPages;
pub use records::pair_work::{KnownInputs, PairWork};
pub use records::review_answers::{Answer, AnsweredOn, AttentionCheckAnswer, Shown};
pub use records::verdicts::{NewVerdict, VerdictEvent};
