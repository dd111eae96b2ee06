//! Inputs and artifacts on disk: temporary name, fsync, rename to the content hash.
