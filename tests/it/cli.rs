//! The binary: exit codes, help, JSON.
