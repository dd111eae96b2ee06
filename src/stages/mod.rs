//! The four stages as pure functions: values in, values out.
//!
//! No files, no SQL, no async, no clock. Each stage has its `Params`, its `Error` and one entry function.

mod binarize;
mod blur;
mod components;
pub mod depth;
pub mod fit;
#[cfg(test)]
mod golden;
pub mod normalize;
mod paper_method;
mod pipeline;
mod pose;
mod print;
pub mod register;
mod robust_bounds;
mod scan;
pub mod score;
#[cfg(test)]
mod testing;
mod zbuffer;

pub use pipeline::AlignedPair;
pub use print::Print;
pub use scan::Scan;

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, Stage};

/// The settings of all four stages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Mesh to plane.
    pub fit: fit::FitParams,
    /// Mesh and plane to depth map.
    pub depth: depth::DepthParams,
    /// Depth map and print to masks.
    pub normalize: normalize::NormalizeParams,
    /// Masks to alignment.
    pub register: register::RegisterParams,
}

impl Settings {
    /// What a stage's result depends on besides its inputs: the stage's revision and its own settings.
    pub fn fingerprint_fields(&self, stage: Stage) -> serde_json::Value {
        let (revision, params) = match stage {
            Stage::Fit => (fit::REVISION, serde_json::to_value(&self.fit)),
            Stage::Depth => (depth::REVISION, serde_json::to_value(&self.depth)),
            Stage::Normalize => (normalize::REVISION, serde_json::to_value(&self.normalize)),
            Stage::Register => (register::REVISION, serde_json::to_value(&self.register)),
        };
        serde_json::json!({ "revision": revision, "settings": params.unwrap_or_default() })
    }
}

/// Why a stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StageError {
    /// From the fit stage.
    #[error(transparent)]
    Fit(#[from] fit::FitError),
    /// From the depth stage.
    #[error(transparent)]
    Depth(#[from] depth::DepthError),
    /// From the normalize stage.
    #[error(transparent)]
    Normalize(#[from] normalize::NormalizeError),
    /// From the register stage.
    #[error(transparent)]
    Register(#[from] register::RegisterError),
}

impl StageError {
    /// What the failure means for the pair.
    pub fn class(&self) -> FailureClass {
        match self {
            Self::Fit(error) => error.class(),
            Self::Depth(error) => error.class(),
            Self::Normalize(error) => error.class(),
            Self::Register(error) => error.class(),
        }
    }
}
