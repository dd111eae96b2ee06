//! What a worker reports about itself with its heartbeats.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Stage, enum_names};

/// Counts and times of a worker process since its start.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct WorkerMetrics {
    /// Version of the program.
    pub version: String,
    /// Pairs that the worker processes at the same time.
    pub jobs: u64,
    /// Time since the start in milliseconds.
    pub elapsed_ms: u64,
    /// Pairs that the worker finished.
    pub done: u64,
    /// Pairs that the worker quarantined.
    pub failed: u64,
    /// Computing times by stage.
    pub stages: BTreeMap<Stage, ComputeTimes>,
    /// Time that jobs waited in milliseconds, all jobs together. In `elapsed_ms`, the jobs can wait at most
    /// `jobs * elapsed_ms`.
    pub wait_ms: BTreeMap<WaitReason, u64>,
    /// Largest memory of the process so far in bytes. `None` on systems that do not report it.
    pub peak_memory_bytes: Option<u64>,
    /// Whether the worker has been asked to stop, or stops by itself.
    pub stopping: bool,
}

/// Computing times of a stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComputeTimes {
    /// How often the stage was computed.
    pub count: u64,
    /// Total time in milliseconds.
    pub ms: u64,
}

/// What a worker waits for instead of computing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WaitReason {
    /// The database: leases, and commits that must be finished before the next pair can start.
    Database,
    /// Opening, reading and hashing of meshes and prints.
    Inputs,
    /// Reading of artifacts, and writing of artifacts that must be finished before the next pair can start.
    Artifacts,
}

enum_names! { pub WaitReason, "a reason to wait":
    Database = "database", Inputs = "inputs", Artifacts = "artifacts",
}
