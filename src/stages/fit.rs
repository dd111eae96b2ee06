//! Mesh to character plane (paper III-A).

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, FitOutcome};
use crate::mesh::Mesh;

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

/// Finds the plane.
///
/// # Errors
/// When there is none.
pub fn fit(
    mesh: &Mesh,
    scanned_face_down: Option<bool>,
    params: &Params,
) -> Result<FitOutcome, Error> {
    let _ = (mesh, scanned_face_down, params);
    Err(Error::NotBuilt)
}
