//! The runner takes the pairs of a project through their stages, several at a time.
//!
//! `run` prepares a run and starts the `scheduler`, which starts a `pair_task` for each pair that `prefetch` leases.
//! The task follows its pair's `compute_thread`, on which `stage_executor` calls the stages, and sends each computed
//! stage to its `checkpointer`, which stores it while the next one is computed. `policy` decides what a failure leads
//! to. The code map in `lib.rs` says where a lost lease is noticed.

mod checkpointer;
mod compute_thread;
mod error;
mod events;
mod free_memory;
mod input_changes;
mod memory_budget;
mod options;
mod pair_context;
mod pair_task;
mod policy;
mod prefetch;
mod run;
mod run_context;
mod scheduler;
mod stage_executor;
mod stage_inputs;
mod stage_output;
mod stop;
#[cfg(test)]
mod tests;
mod worker_session;

pub use error::RunError;
pub use events::{RunEvent, RunSummary};
pub use free_memory::default_memory_limit;
pub use options::RunOptions;
pub use run::{fingerprints, plan, run};
pub use stage_output::result_hash;
pub use stop::{Stop, StopLevel};
