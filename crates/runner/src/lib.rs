//! Runs the stages of pairs and blocks, several pairs at a time, and checks a project.
//!
//! [`run()`] prepares a run and starts the `scheduler`. For each pair that `prefetch` leases, the scheduler starts a
//! `pair_task`, and the task a thread, which runs each `pair_stage` through `pair_pipeline`. The task hands computed
//! stages to a `checkpointer`, which stores them while the next stage is computed. `policy` decides what follows a
//! failure. Whole blocks run before pairs, one at a time: `block/task.rs` leases a block and runs its stages,
//! and `block/pipeline` reads their files. [`check`] compares a project with its catalog and repairs it. Every call fails
//! if the catalog, an input or an artifact cannot be read or written. `# Errors` names other reasons.
//!
//! **Invariant:** a kill at any moment costs the stages in progress and uncommitted ones, nothing else; and a worker whose
//! lease was lost stores no row. Files that it wrote before stay, until `check --repair` or `check --collect` removes
//! files without a row.
//!
//! # A lost lease
//! Files of the catalog: `src/` is in `crates/catalog`, `queue/` in its `src`, and `commit/` in `queue/`. Names in
//! capitals are statements of `queue/lease.rs`, but `RECOVER` and `OVERDUE` of `src/lease_recovery.rs`, `DUE` of `queue/claim.rs`.
//! ```text
//!   ready ---- claim: queue/claim.rs ----> leased ------ ADVANCE of the last stage ----> done
//!     ^                                            |
//!     +---- RELEASE, SEND_BACK, RECOVER, OVERDUE --+---- FAIL, or RECOVER, OVERDUE after too many crashes ----> quarantined
//!     +---- DUE ---- backoff <---- FAIL -----------+
//! ```
//!
//! A write under a lease is stored if the worker has not ended, its last heartbeat was at most 50 s old when the write was
//! prepared (`RunContext::alive_since`), and the job has the token of the lease; a checkpoint of a block, or of a pair on
//! PostgreSQL, also needs the stage of the lease. A release needs only worker and token. A checkpoint is no heartbeat. A
//! repair, a new cut of its block and a recovery give a job a new token, and retiring a pair removes its job. A job is
//! recovered when its worker has sent no heartbeat for 50 s (`Timing` in `run_context.rs`), when a run starts alone on
//! SQLite, or when its deadline is more than 60 s past and another worker has read the catalog without a gap for two stage
//! timeouts. On PostgreSQL, 7 s without lock and heartbeat are enough, if the process that recovers has seen the worker
//! since the last gap in its reads (`Liveness` in `worker_session.rs`).
//!
//! | what is refused | where it is noticed | by | what happens |
//! |---|---|---|---|
//! | a checkpoint of a pair | `checkpointer.rs` | SQLite: `ADVANCE`; PostgreSQL: `ADVANCED_ON_SERVER` | this and later results are dropped; the stage that runs is cancelled |
//! | a checkpoint of a block, or versions of its files | `block/checkpoint.rs`, `block/task.rs` | `ADVANCE`, `LEASED` | the task ends; no stage runs meanwhile |
//! | a failure | `checkpointer.rs`, `block/checkpoint.rs` | `FAIL` | the failure is not stored |
//! | a heartbeat | `worker_session.rs`, for `scheduler.rs` | `HEARTBEAT` | the process becomes a new worker: see below |
//! | files written more than 30 minutes ago (pairs on SQLite: not checked) | as a checkpoint | `is_late` | nothing is stored; the job stays leased to this worker, which claims it again |
//! | a release | `checkpointer.rs`; others ignore it | `RELEASE` | the pair ends as `LeaseLost`, a block as `Released` |
//!
//! A job that loses its lease while it runs ends as `LeaseLost`, which counts neither as done nor as failed; after a
//! refused heartbeat, a pair may also end as `Released`. A pair recovered from a worker that did not end may have killed it, so
//! no other pair runs beside it (on PostgreSQL: on its host): in its own process until it has ended, in others until its next
//! stage is stored. After a refused heartbeat, `prefetch.rs` releases what has not started, and the process ends its old id,
//! registers as a new worker and recovers the jobs of the old id, which count no crash. The new id ends the waits for
//! `RunContext::expired`, which cancels the stages that run: in `Checkpointer::closed` for `pair_task.rs`, and in `on_thread` of
//! `block/task.rs`. Heartbeats do not show that another worker recovered a job, or that a repair or a new cut reset it: the stage
//! runs on, and its next write is refused. If the connection to a server breaks, writes are sent again until a stop ends the
//! waits, and `stored_before` (`queue/lease.rs`) finds what was stored without a reply.
//!
//! Read 18 files to follow a lease. Pairs: `run_context.rs`, `worker_session.rs`, `scheduler.rs`, `prefetch.rs`, `pair_task.rs`,
//! `checkpointer.rs`; in the catalog `src/worker_requests.rs`, `src/lease_recovery.rs`, `queue/kind.rs`, `queue/lease.rs`,
//! `queue/claim.rs`, `queue/checkpoint.rs`, `commit/writer.rs`, `commit/group_commit.rs`; for PostgreSQL
//! `commit/write_connection.rs`, `queue/server_checkpoint.rs`. Blocks: `block/task.rs`, `block/checkpoint.rs`. Leases are also
//! taken away by `run.rs`, `jobs/requeue.rs` (`send_back`), `jobs/retired.rs`, `audit/repair.rs` and `blocks/cut.rs`.
//!
//! **Cancellation.** A stage that takes too long, is stopped, or whose result could not be stored any more is cancelled: inner
//! loops poll the token of their thread ([`mocban_core::domain::cancel`]) and unwind to `pair_task.rs` (`block/task.rs`), which
//! waits up to 500 ms for the thread; then its memory no longer counts. Other threads take the token along as a `ThreadToken`.

mod artifacts_owner;
mod block;
mod block_stages;
mod blocking;
pub mod check;
mod checkpointer;
mod claim_size;
mod error;
mod event_log;
mod events;
mod failed_stage;
mod folder_check;
mod free_memory;
mod input_changes;
mod input_reads;
mod memory_budget;
pub mod memory_estimate;
mod options;
mod pair_context;
mod pair_pipeline;
mod pair_stage;
mod pair_task;
mod policy;
mod prefetch;
mod retry;
mod run;
mod run_context;
mod run_end;
mod run_guard;
mod run_metrics;
mod run_plan;
mod run_selection;
mod scheduler;
mod stage_files;
mod stage_inputs;
mod stage_output;
mod stop;
#[cfg(test)]
mod tests;
mod worker_session;

pub use artifacts_owner::claim_artifacts;
pub use block_stages::{
    BlockArtifacts, BlockFile, BlockInputs, BlockStageError, BlockStageOutput, BlockStages,
    CharacterOutput, CutFiles,
};
pub use error::RunError;
pub use events::{BlockSummary, CutPairs, RunEvent, RunSummary};
pub use free_memory::default_memory_limit;
pub use options::{NamedWork, RunOptions, RunPart};
pub use run::{fingerprints, run};
pub use run_guard::is_running;
pub use run_metrics::RunMetrics;
pub use run_plan::{RunPlan, changes_method, plan, planned_blocks};
pub use stage_output::{metric_results, result_hash};
pub use stop::{Stop, StopLevel};
