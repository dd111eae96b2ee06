//! What the catalog does with jobs and workers: counts, stale jobs, retired pairs, settings.

pub(crate) mod block_settings;
pub(crate) mod fingerprint;
pub(crate) mod job_counts;
pub(crate) mod plan;
pub(crate) mod requeue;
pub(crate) mod retired;
mod run_plan;
pub(crate) mod shared_runs;
pub(crate) mod staleness;
pub(crate) mod worker_list;
pub(crate) mod workers;
