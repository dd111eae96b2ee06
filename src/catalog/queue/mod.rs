//! The work queue: leases, checkpoints, failures, recovery, staleness.

pub(crate) mod alike;
pub(crate) mod checkpoint;
pub(crate) mod claim;
pub(crate) mod counters;
pub(crate) mod fail;
pub(crate) mod fingerprint;
pub(crate) mod job_counts;
pub(crate) mod lease;
pub(crate) mod plan;
pub(crate) mod recovery;
pub(crate) mod requeue;
pub(crate) mod staleness;
pub(crate) mod workers;
