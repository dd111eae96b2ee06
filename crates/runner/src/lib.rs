//! Runs the stages of pairs and blocks, several pairs at a time, and checks a project.
//!
//! [`run()`] prepares a run and starts the `scheduler`. For each pair that `prefetch` leases, the scheduler starts a
//! `pair_task`, and the task a `compute_thread`, which calls the stages through `pair_pipeline`. The task hands computed
//! stages to a `checkpointer`, which stores them while the next stage is computed. `policy` decides what follows a failure.
//! Whole blocks run before pairs, one at a time: `block/slot.rs` leases a block, `block/task.rs` runs its stages, and
//! `block/pipeline` reads their files. [`check`] compares a project with its catalog and repairs it.
//!
//! Every call fails if the catalog, an input or an artifact cannot be read or written. `# Errors` names other reasons.
//!
//! **Invariant:** a kill at any moment costs the stages in progress and uncommitted ones, nothing else; and a worker whose
//! lease was lost stores no row. Files that it wrote before stay, until `check --repair` or `check --collect` removes those
//! without a row.
//!
//! # A lost lease
//!
//! ```text
//!             claim                    checkpoint of the last stage
//!   ready ------------> leased ------------------------------------> done
//!     ^                  |  ^ |
//!     |   release        |  | | checkpoint: the deadline of the next stage; heartbeat of the worker: its leases stay valid
//!     +------------------+  +-+
//!     |                  |
//!     |                  | the worker sends no heartbeat for 50 s (PostgreSQL: 7 s without lock and heartbeat, unless it
//!     |                  | was never seen connected; SQLite: at once, if a run starts alone), or its stage is overdue: recovery; or a repair
//!     |                  | or a new cut of its block resets the job
//!     |   a new fencing token
//!     +------------------+------------> quarantined, if the job has crashed too many workers
//! ```
//!
//! A lease is valid while the last heartbeat of its worker is at most 50 s old (`RunContext::alive_since`) and its job has its
//! token. A checkpoint does not renew it. A passed deadline ends nothing by itself: another worker recovers the job if the
//! deadline is more than 60 s past and it has read the catalog without a gap for two stage timeouts.
//!
//! | who finds out | by | refused by (in `crates/catalog/src`) | what happens |
//! |---|---|---|---|
//! | `checkpointer.rs` | a checkpoint of a pair is refused | SQLite: `ADVANCE` in `queue/checkpoint.rs`; PostgreSQL: `queue/server_checkpoint.rs` | this and later results are dropped; the stage that runs is cancelled |
//! | `block/checkpoint.rs` | a checkpoint of a block is refused | `ADVANCE`; then `IS_DONE` in `blocks/cut.rs` finds a cut that was stored without a reply | the task ends; no stage runs meanwhile |
//! | `block/task.rs` | the versions of the files of a block are refused | `LEASED` in `blocks/queue.rs` | the same |
//! | `pair_failure.rs`, `block/checkpoint.rs` | a failure is refused | `FAIL` in `queue/fail.rs` | the failure is not stored |
//! | `worker_session.rs` | a heartbeat is refused | `HEARTBEAT` in `queue/claim.rs` | `prefetch.rs` releases what has not started; the process registers as a new worker, and recovers the jobs of its old id. The new id ends the waits for `RunContext::expired`, which cancels the stages that run: in `Checkpointer::closed` for `pair_task.rs`, and in `on_thread` of `block/task.rs`. Heartbeats do not show that another worker recovered a job, or that a repair or a new cut reset it: the stage runs on, and its next write is refused |
//! | the catalog | files were written more than 30 minutes ago | pairs on PostgreSQL: `is_late` in `queue/commit/server_commit.rs`; blocks: `store` in `queue/checkpoint.rs`; pairs on SQLite: not checked | nothing is stored; the job stays leased to this worker, which claims it again. Here it is a refused checkpoint |
//! | `checkpointer.rs`, `block/task.rs` | a release is refused | `RELEASE` in `queue/claim.rs` | the pair ends as `LeaseLost`, the block as `Released` |
//!
//! In the other rows, a pair or block that ran ends as `LeaseLost`, which counts neither as done nor as failed. Stages
//! stored before stay. On PostgreSQL, `queue/commit/known_leases.rs` finds refused writes of pairs that an earlier commit
//! without a reply has stored. The job of a retired pair is removed, which ends its lease too. A pair that another worker
//! recovered may have killed the worker, so it runs with no other pair beside it (on PostgreSQL: on its host): in its process
//! until it ends, in others until its next stage is stored. `liveness.rs` decides when a
//! worker counts as dead, and `timing.rs` has the times. If heartbeats fail with an error for as long as a lease lasts, or
//! the log of SQLite is lost, the run finishes the stages in progress and ends with that error. An unavailable server is waited
//! for; a heartbeat that comes too late is refused.
//!
//! # Cancellation
//!
//! A stage that takes too long, is stopped, or whose result could not be stored any more is cancelled: inner loops poll the
//! token of their thread ([`mocban_core::domain::cancel`]) and unwind to `compute_thread.rs` (`block/task.rs`), which waits
//! up to 500 ms for the end of the thread; after that its memory no longer counts. After an immediate stop, the task of a pair
//! does not wait. Work on other threads, such as those of `rayon`, takes the token along as a `ThreadToken`.

mod artifacts_owner;
mod block;
mod block_stages;
mod blocking;
pub mod check;
mod checkpointer;
mod claim_size;
mod compute_thread;
mod error;
mod event_log;
mod events;
mod folder_check;
mod free_memory;
mod input_changes;
mod input_reads;
mod liveness;
mod memory_budget;
pub mod memory_estimate;
mod options;
mod pair_context;
mod pair_failure;
mod pair_pipeline;
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
mod timing;
mod worker_session;

pub use artifacts_owner::claim_artifacts;
pub use block_stages::{
    BlockArtifacts, BlockFile, BlockInputs, BlockStageError, BlockStageOutput, BlockStages,
    CharacterOutput, CutFiles,
};
pub use error::RunError;
pub use events::{BlockSummary, RunEvent, RunSummary};
pub use free_memory::default_memory_limit;
pub use options::{NamedWork, RunOptions, RunPart};
pub use run::{fingerprints, run};
pub use run_guard::is_running;
pub use run_metrics::RunMetrics;
pub use run_plan::{RunPlan, changes_method, plan, planned_blocks};
pub use stage_output::{metric_results, result_hash};
pub use stop::{Stop, StopLevel};
