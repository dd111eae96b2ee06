//! Whole blocks: import, the jobs of their stages, their results, and the pairs that are cut from them.
//!
//! The jobs of blocks are a kind of the queue: see `block_job.rs`. There are few blocks and their stages take seconds, so
//! each step is a transaction of its own (`worker_requests.rs`). The last step inserts pairs, which the queue of pairs then
//! runs.

pub(crate) mod attributes;
pub(crate) mod block_job;
pub(crate) mod block_results;
pub(crate) mod characters;

pub(crate) mod control_points;
pub(crate) mod cut;
pub(crate) mod import;
pub(crate) mod labels;
pub(crate) mod model;
pub(crate) mod queue;
pub(crate) mod records;
pub(crate) mod removal;
pub(crate) mod selection;
pub(crate) mod staleness;
pub(crate) mod true_boxes;
