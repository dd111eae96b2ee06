//! Depth map and print to masks (paper III-C).

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, NormalizeOutcome};
use crate::raster::{DepthMap, Mask, Picture};

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

/// What the stage gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Normalized {
    /// The numbers.
    pub outcome: NormalizeOutcome,
    /// Ink of the print, in the print image frame.
    pub ink: Mask,
    /// Where the print image is paper or ink; outside it (white beyond the cut) nothing is known.
    pub known: Mask,
}

/// Finds the print mask, the poses and the thresholds.
///
/// # Errors
/// When the print has no ink.
pub fn normalize(depth: &DepthMap, print: &Picture, params: &Params) -> Result<Normalized, Error> {
    let _ = (depth, print, params);
    Err(Error::NotBuilt)
}
