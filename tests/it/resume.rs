//! Killed runs go on where they were.
