//! The queue of pairs and blocks: leases, checkpoints, failures, and the task that writes them. Its functions take
//! connections. The handle of the catalog uses them; methods of the handle are in `jobs`, `blocks`, `records`,
//! `worker_requests.rs` and `lease_recovery.rs`.

pub(crate) mod checkpoint;
pub(crate) mod claim;
pub(crate) mod claim_tracker;
pub(crate) mod commit;
pub(crate) mod counters;
pub(crate) mod fragments;
pub(crate) mod kind;
pub(crate) mod lease;
pub(crate) mod pair_job;
pub(crate) mod provenance;
pub(crate) mod selection;
pub(crate) mod server_checkpoint;
pub(crate) mod stage_record;
