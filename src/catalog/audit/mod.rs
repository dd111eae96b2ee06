//! The catalog checked against itself, and repairs.

pub(crate) mod integrity;
pub(crate) mod repair;
