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
//! **Invariant:** a kill at any moment costs at most the stages in progress, and a worker whose lease was lost stores
//! nothing.
//!
//! # A lost lease
//!
//! ```text
//!             claim                    checkpoint of the last stage
//!   ready ------------> leased ------------------------------------> done
//!     ^                  |  ^ |
//!     |   release        |  | | checkpoint, heartbeat: the lease is renewed
//!     +------------------+  +-+
//!     |                  |
//!     |                  | the worker sends no heartbeat for a lease (PostgreSQL: 7 s without its lock), or its stage is
//!     |                  | overdue: recovery; or a repair or a new cut of its block resets the job
//!     |   a new fencing token
//!     +------------------+------------> quarantined, if the job has crashed too many workers
//! ```
//!
//! | who finds out | by | what happens |
//! |---|---|---|
//! | `checkpointer.rs` | a checkpoint of a pair is refused | this and later results are dropped; the stage that runs is cancelled |
//! | `block/checkpoint.rs`, `block/task.rs` | a checkpoint of a block, or the versions of its files, are refused | the task ends; no stage runs meanwhile |
//! | `pair_failure.rs`, `block/checkpoint.rs` | a failure is refused | the failure is not stored |
//! | `worker_session.rs` | a heartbeat is refused | all stages that run are cancelled (`scheduler.rs`, `prefetch.rs`); the process releases what it has not started, registers as a new worker, and recovers the jobs of its old id |
//! | `checkpointer.rs`, `block/checkpoint.rs` | files were written more than 30 minutes ago (pairs on a server, blocks) | nothing is stored; the job stays leased to this worker, which claims it again |
//! | `checkpointer.rs` | a release is refused | the pair ends as `LeaseLost`; a block ends as released |
//!
//! The pair or block ends as `LeaseLost`, which counts neither as done nor as failed. Stages stored before stay. The job of a
//! retired pair is removed, which ends its lease too. A pair that another worker recovered runs alone until its next stage
//! is stored, because it may have killed the worker. `liveness.rs` decides
//! when a worker counts as dead, `timing.rs` has the times, and the statements are in
//! `crates/catalog/src/queue`. If heartbeats fail with an error for as long as a lease lasts, the run finishes the stages in
//! progress and ends with that error.
//!
//! # Cancellation
//!
//! A stage that takes too long, is stopped, or whose result could not be stored any more is cancelled: inner loops poll the token of their thread
//! ([`mocban_core::domain::cancel`]) and unwind to `compute_thread.rs`, which waits for the end of the thread before its
//! memory is given to others. Work on other threads, such as those of `rayon`, takes the token along as a `ThreadToken`.

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
pub use run_plan::{RunPlan, plan};
pub use stage_output::{metric_results, result_hash};
pub use stop::{Stop, StopLevel};
