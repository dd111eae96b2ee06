//! The runner takes the pairs of a project through their stages, several at a time.
//!
//! The way of one pair:
//!
//! 1. `run` takes the run's lock, recovers the leases of dead processes, and sends pairs whose inputs or settings have
//!    changed back to the first outdated stage. Then it starts the `scheduler`.
//! 2. `prefetch` leases pairs from the catalog, for free slots and a little ahead, and checks their memory against
//!    `memory_budget`. The `scheduler` starts one task for each pair, as far as there are slots.
//! 3. `pair_task` follows its pair from the first stage without a current result to the last one. It starts a
//!    `compute_thread`, on which `stage_executor` calls the stages one after another; `pair_context` holds what they
//!    share in memory.
//! 4. Each computed stage goes to the pair's `checkpointer`, which writes its files and then, in one transaction, its
//!    row, while the thread computes the next stage. The catalog moves the job to its next stage in that transaction.
//! 5. The task reports how the pair ended. A failure is stored with what `policy` decides: retry later, retry with no
//!    other pair beside it, or quarantine.
//!
//! A lease can be lost, because this process was suspended and another one took the pair. Each write names the lease's
//! token, and the catalog refuses one that is not current. The `checkpointer` notices that first: on
//! `CheckpointOutcome::LeaseLost` its task ends, no later stage is stored, and the pair ends as `PairEnd::LeaseLost`.
//! `worker_session` notices it for the whole process, when a heartbeat comes after the leases have expired: the process
//! registers as a new worker.

mod baseline;
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

pub use baseline::run_without_catalog;
pub use error::RunError;
pub use events::{RunEvent, RunSummary};
pub use free_memory::default_memory_limit;
pub use options::RunOptions;
pub use run::{fingerprints, plan, run};
pub use stage_output::result_hash;
pub use stop::{Stop, StopLevel};
