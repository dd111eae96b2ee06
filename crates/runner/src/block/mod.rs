//! Leases whole blocks and runs their stages, one block at a time.

pub(crate) mod artifacts;
pub(crate) mod checkpoint;
pub(crate) mod inputs;
pub(crate) mod memory;
pub(crate) mod pipeline;
pub(crate) mod task;
