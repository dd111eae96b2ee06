//! Checks and repairs of the catalog.

pub(crate) mod integrity;
pub(crate) mod repair;
