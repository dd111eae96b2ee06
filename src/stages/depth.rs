//! Mesh and plane to depth map (paper III-B).

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, FitOutcome, LengthUnit};
use crate::mesh::Mesh;
use crate::raster::DepthMap;

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

/// Makes the depth map.
///
/// # Errors
/// When nothing is seen.
pub fn depth(
    mesh: &Mesh,
    fit: &FitOutcome,
    unit: Option<LengthUnit>,
    params: &Params,
) -> Result<DepthMap, Error> {
    let _ = (mesh, fit, unit, params);
    Err(Error::NotBuilt)
}
