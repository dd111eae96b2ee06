//! What a run is asked to do.

use std::time::Duration;

use crate::domain::{PairName, Stage};
use crate::{mesh, raster};

/// What to run again besides stages without a current result. Results of changed settings or inputs are never current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rerun {
    /// Failed pairs.
    Failed,
    /// Nothing more: the default.
    Stale,
    /// Every pair, from the stage [`RunOptions::from`] on.
    All,
}

/// Options of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOptions {
    /// Pairs computed at the same time, each on one thread.
    pub workers: usize,
    /// Memory in bytes that pairs computed at the same time may need together, estimated from the sizes of their files. A
    /// pair that needs more runs with no other beside it. `None` for no limit.
    pub memory: Option<u64>,
    /// Join a run in progress in another process.
    pub join: bool,
    /// Start no more pairs after this many have failed.
    pub max_failures: Option<u64>,
    /// Only these pairs; `None` for all.
    pub pairs: Option<Vec<PairName>>,
    /// What to run again.
    pub rerun: Option<Rerun>,
    /// First stage that [`Rerun::All`] runs again.
    pub from: Stage,
    /// Last stage to run.
    pub until: Stage,
    /// Longest time for one stage of one pair.
    pub stage_timeout: Duration,
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
            stage_timeout: Duration::from_mins(10),
            mesh_limits: mesh::MeshLimits::SUGGESTED,
            image_limits: raster::ImageLimits::SUGGESTED,
        }
    }
}
