//! What a run is asked to do.

use std::time::Duration;

use super::run_metrics::RunMetrics;
use mocban_catalog::RerunPolicy;
use mocban_core::InputLimits;
use mocban_core::domain::{BlockName, PairName, Stage};

/// Options of a run.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// Pairs computed at the same time, each on one thread.
    pub workers: usize,
    /// Memory limit in bytes for a block and all pairs computed at the same time. Their memory is estimated from the
    /// file size of the mesh, the pixel count of print or page, and the size of depth maps in the settings. One that exceeds the limit runs alone. `None` means
    /// no limit.
    pub memory: Option<u64>,
    /// What to do besides computing.
    pub part: RunPart,
    /// Join a run in progress in another process.
    pub join: bool,
    /// Start nothing more after this many pairs and blocks have failed.
    pub max_failures: Option<u64>,
    /// Only these pairs and blocks; `None` for all.
    pub only: Option<NamedWork>,
    /// What to run besides stages without a current result.
    pub rerun: RerunPolicy,
    /// Last stage to run.
    pub until: Stage,
    /// Longest time for one stage of one pair.
    pub stage_timeout: Duration,
    /// Limits of input files.
    pub limits: InputLimits,
    /// Where the run counts pairs and times.
    pub metrics: RunMetrics,
}

/// Pairs and blocks that a user named.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NamedWork {
    /// Pairs.
    pub pairs: Vec<PairName>,
    /// Blocks. Their pairs run too, also pairs that are yet to be cut.
    pub blocks: Vec<BlockName>,
}

/// Which part of a run to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunPart {
    /// Plan, then compute.
    All,
    /// Look at the inputs and requeue pairs whose settings or inputs changed, but compute nothing.
    Plan,
    /// Compute what others planned.
    Work,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            workers: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            memory: None,
            part: RunPart::All,
            join: false,
            max_failures: None,
            only: None,
            rerun: RerunPolicy::Changed,
            until: Stage::Register,
            stage_timeout: Duration::from_mins(10),
            limits: InputLimits::SUGGESTED,
            metrics: RunMetrics::default(),
        }
    }
}
