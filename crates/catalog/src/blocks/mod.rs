//! Whole blocks: import, the jobs of their stages, their results, and the pairs that are cut from them.
//!
//! A block has its own job with the stages `face`, `align`, `boxes` and `cut`. There are few blocks and their stages
//! take seconds, so each step is a transaction of its own. The guarantees are those of the jobs of pairs: a result is
//! stored only under a valid lease, and a lease is valid while the worker's heartbeats are. The last step inserts
//! pairs, which the queue of pairs then runs.

pub(crate) mod block_results;
pub(crate) mod characters;
pub(crate) mod checkpoint;
pub(crate) mod claim;
pub(crate) mod control_points;
pub(crate) mod cut;
pub(crate) mod fail;
pub(crate) mod import;
pub(crate) mod model;
pub(crate) mod records;
pub(crate) mod recovery;
pub(crate) mod selection;
pub(crate) mod staleness;
pub(crate) mod true_boxes;
