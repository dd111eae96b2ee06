//! Masks to alignment and scores (paper III-D).

use serde::{Deserialize, Serialize};

use super::normalize::Normalized;
use crate::domain::{FailureClass, RegisterOutcome, ThresholdMetric};
use crate::raster::{DepthMap, Mask};

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 1;

/// Settings of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// Seed of the stage's random choices.
    pub seed: u64,
}

/// Why the stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Placeholder.
    #[error("not built yet")]
    NotBuilt,
}

impl Error {
    /// What the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        FailureClass::Bug
    }
}

/// The two masks of one metric on the pair canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct CanvasMasks {
    /// Which metric.
    pub metric: ThresholdMetric,
    /// The depth mask brought there by the alignment.
    pub depth: Mask,
}

/// What the stage gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Registered {
    /// The numbers.
    pub outcome: RegisterOutcome,
    /// The print mask on the canvas, one for all metrics.
    pub canvas_print: Mask,
    /// One canvas a metric, in the order of the outcome.
    pub canvases: Vec<CanvasMasks>,
}

/// Finds the alignment.
///
/// # Errors
/// When there is none.
pub fn register(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<Registered, Error> {
    let _ = (depth, normalized, params);
    Err(Error::NotBuilt)
}
