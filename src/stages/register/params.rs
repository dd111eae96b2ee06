//! Settings and errors of the register stage.

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, ThresholdMetric};
use crate::stages::score::SsimWindow;

/// How the alignment is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RegisterMethod {
    /// Robust sub-pixel refinement of the pose that normalisation found.
    Refine,
    /// Turns of the wrapped mask with climbed shifts: the paper's.
    Exhaustive,
}

/// Settings of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegisterParams {
    /// How the alignment is found.
    pub method: RegisterMethod,
    /// `refine`: working size in pixels along the character, 32..=1024.
    pub working_px: u32,
    /// `refine`: smoothing in working pixels, 0..=10.
    pub smoothing_px: f64,
    /// `refine`: whether the pose may stretch the relief along one axis, as paper shrinks across its grain.
    pub anisotropic_scale: bool,
    /// `refine`: a pair with less confidence than this is refused, 0..=1.
    pub min_confidence: f64,
    /// `exhaustive`: how many angles of a full turn are tried first, 4 or more.
    pub coarse_angles: u32,
    /// `exhaustive`: how many angles within three coarse steps each side are tried next, 2 or more.
    pub fine_angles: u32,
    /// Window of SSIM in the scores.
    pub window: SsimWindow,
}

/// Why the stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegisterError {
    /// Normalisation left no pose and the method needs one.
    #[error(
        "register.method is refine but normalisation found no pose; set normalize.method to pose_first"
    )]
    NoPose,
    /// A threshold was not chosen for a metric.
    #[error("normalisation chose no threshold for {0}")]
    NoThreshold(ThresholdMetric),
    /// The mask of a threshold is empty.
    #[error("the depth map has no strokes at the threshold of {0}")]
    NoStrokes(ThresholdMetric),
    /// The relief reads in mirror writing.
    #[error(
        "the relief matches the print better in mirror writing ({times:.2} times as well); was the mesh mirrored?"
    )]
    Mirrored {
        /// Score of the mirrored relief over that as read.
        times: f64,
    },
    /// Relief and print do not show the same character, or cannot be told to.
    #[error(
        "relief and print do not match: confidence {confidence:.2} is below register.min_confidence {needs}; is it the print of another character?"
    )]
    NoMatch {
        /// Chance that the best pose is right.
        confidence: f64,
        /// The setting.
        needs: f64,
    },
}

impl RegisterError {
    /// What the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::NoPose
            | Self::NoThreshold(_)
            | Self::NoStrokes(_)
            | Self::Mirrored { .. }
            | Self::NoMatch { .. } => FailureClass::NoSolution,
        }
    }
}
