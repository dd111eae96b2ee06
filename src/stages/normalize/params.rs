//! Settings and errors of the normalize stage.

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, ThresholdMetric};
use crate::stages::binarize::BinarizeError;
use crate::stages::score::SsimWindow;

/// When thresholds are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalizeMethod {
    /// After the pose was found with soft relief.
    PoseFirst,
    /// Before, on both pictures wrapped by box and centroid: the paper's.
    BoundingBox,
}

impl NormalizeMethod {
    /// The metrics that get a threshold, in the order of [`ThresholdMetric::ALL`].
    pub const fn metrics(self) -> &'static [ThresholdMetric] {
        match self {
            Self::PoseFirst => &ThresholdMetric::ALL,
            Self::BoundingBox => &ThresholdMetric::PAPER,
        }
    }
}

/// How the print's ink is told from its paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PrintThreshold {
    /// Paper levelled, polarity and threshold found in each image (Otsu).
    Adaptive,
    /// Darker than `print_grey` is ink: the paper's.
    Fixed,
}

/// Settings of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalizeParams {
    /// When thresholds are chosen.
    pub method: NormalizeMethod,
    /// How the print's ink is told from its paper.
    pub print_threshold: PrintThreshold,
    /// Grey 0..=255 below which `fixed` takes a pixel for ink.
    pub print_grey: u8,
    /// Side of the square canvas in pixels, 64..=2048.
    pub canvas_px: u32,
    /// Longest side of the print character on the canvas in pixels, below `canvas_px`.
    pub character_px: u32,
    /// Largest ratio, up or down, between the sizes of print and depth map that the pose search tries, 1..=2.
    pub scale_band: f64,
    /// Depth under the tops at which `pose_first` starts looking for thresholds, as a share of the relief.
    pub threshold_min: f64,
    /// Depth under the tops at which `pose_first` stops looking for thresholds, as a share of the relief.
    pub threshold_max: f64,
    /// `pose_first`: the print's ink spreads beyond the wood; density aims at the print's divided by this, 1 or more.
    pub ink_spread: f64,
    /// `bounding_box`: first and last grey of the density threshold.
    pub density_greys: [u8; 2],
    /// `bounding_box`: first and last grey of the structure threshold.
    pub structure_greys: [u8; 2],
    /// Window of the structure score.
    pub window: SsimWindow,
}

/// Why the stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NormalizeError {
    /// The print shows no ink.
    #[error(transparent)]
    Print(#[from] BinarizeError),
    /// The depth map has no strokes at any threshold.
    #[error("no threshold gives the depth map any strokes")]
    NoStrokes,
    /// The relief reads in mirror writing.
    #[error(
        "the relief matches the print only in mirror writing ({mirrored:.3} against {upright:.3}); was the mesh mirrored?"
    )]
    Mirrored {
        /// Best score of the mirrored relief.
        mirrored: f64,
        /// Best score as read.
        upright: f64,
    },
    /// Nothing matches.
    #[error(
        "no pose of the relief matches the print: the best correlation is {best:.3}, needs {needs}"
    )]
    NoMatch {
        /// Best correlation.
        best: f64,
        /// Least that counts.
        needs: f64,
    },
}

impl NormalizeError {
    /// What the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::Print(_) => FailureClass::BadInput,
            Self::NoStrokes | Self::Mirrored { .. } | Self::NoMatch { .. } => {
                FailureClass::NoSolution
            }
        }
    }
}
