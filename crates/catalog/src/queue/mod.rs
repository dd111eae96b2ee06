//! The work queue: leases, checkpoints, failures, recovery of dead workers, staleness.

mod api;
pub(crate) mod block_settings;
pub(crate) mod checkpoint;
pub(crate) mod claim;
pub(crate) mod claim_start;
pub(crate) mod commit;
pub(crate) mod counters;
pub(crate) mod fail;
pub(crate) mod fingerprint;
pub(crate) mod fragments;
pub(crate) mod job_counts;
pub(crate) mod lease;
pub(crate) mod plan;
pub(crate) mod recovery;
pub(crate) mod requeue;
pub(crate) mod retired;
mod run_plan;
pub(crate) mod selection;
pub(crate) mod server_checkpoint;
pub(crate) mod server_claim;
pub(crate) mod shared_runs;
pub(crate) mod staleness;
pub(crate) mod worker_list;
pub(crate) mod worker_lock;
pub(crate) mod workers;
