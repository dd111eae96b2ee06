//! Checks and repairs of the catalog.

pub(crate) mod audited_pairs;
pub(crate) mod fingerprint_hashes;
pub(crate) mod integrity;
pub(crate) mod repair;
