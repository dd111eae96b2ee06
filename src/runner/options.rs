//! What a run is asked to do.

use std::time::Duration;

use crate::domain::{PairName, Stage};
use crate::{mesh, raster};

/// What to run again besides what is left. Changed settings and inputs are always taken up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rerun {
    /// Pairs that failed.
    Failed,
    /// Nothing more than what changed: the default, by name.
    Stale,
    /// Every pair, from `RunOptions::from` on.
    All,
}

/// Options of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOptions {
    /// Pairs worked on at the same time; each has one thread.
    pub workers: usize,
    /// Memory that the pairs worked on at the same time may need together, in bytes by the sizes of their files; one
    /// that needs more runs with nothing beside it. `None` for no limit.
    pub memory: Option<u64>,
    /// Join a run that goes on in another process.
    pub join: bool,
    /// Drain after this many failed pairs.
    pub max_failures: Option<u64>,
    /// Only these pairs; all when `None`.
    pub pairs: Option<Vec<PairName>>,
    /// What to run again.
    pub rerun: Option<Rerun>,
    /// First stage of a `Rerun::All`.
    pub from: Stage,
    /// Last stage to run.
    pub until: Stage,
    /// Longest time for one stage of one pair.
    pub stage_limit: Duration,
    /// Limits on mesh files.
    pub mesh_limits: mesh::MeshLimits,
    /// Limits on print images.
    pub image_limits: raster::ImageLimits,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            workers: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            memory: None,
            join: false,
            max_failures: None,
            pairs: None,
            rerun: None,
            from: Stage::Fit,
            until: Stage::Register,
            stage_limit: Duration::from_mins(10),
            mesh_limits: mesh::MeshLimits::SUGGESTED,
            image_limits: raster::ImageLimits::SUGGESTED,
        }
    }
}
