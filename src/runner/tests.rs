//! The run with made-up stages.
