//! Runs the stages of a project's pairs, several pairs at a time.
//!
//! `run` prepares a run and starts the `scheduler`. For each pair that `prefetch` leases, the scheduler starts a
//! `pair_task` and the task starts a `compute_thread`. The thread calls the stages through `stage_executor`. The task
//! sends computed stages to a `checkpointer`, which stores them while the next stage is computed. `policy` decides what
//! follows a failure. Whole blocks run before pairs, one at a time: `block_slot` leases a block, and a `block_task`
//! runs its stages through `block_stages`. The code map in `lib.rs` says where a lost lease is noticed.

mod artifacts_owner;
mod block_artifacts;
mod block_checkpoint;
mod block_inputs;
mod block_memory;
mod block_pipeline;
mod block_plan;
mod block_progress;
mod block_size;
mod block_slot;
mod block_stages;
mod block_task;
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
mod pair_task;
mod policy;
mod prefetch;
mod run;
mod run_context;
mod run_end;
mod run_guard;
mod run_metrics;
mod run_plan;
mod run_selection;
mod scheduler;
mod stage_executor;
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
pub use events::{BlockSummary, RunEvent, RunSummary};
pub use free_memory::default_memory_limit;
pub use options::{NamedWork, RunOptions, RunPart};
pub use run::{fingerprints, run};
pub use run_guard::is_running;
pub use run_metrics::RunMetrics;
pub use run_plan::{RunPlan, plan};
pub use stage_output::{metric_results, result_hash};
pub use stop::{Stop, StopLevel};
