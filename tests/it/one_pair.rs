//! One pair end to end, as the README tells it.
