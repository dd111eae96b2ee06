//! Settings and errors of the normalize stage.

use serde::{Deserialize, Serialize};

use crate::stages::binarize::BinarizeError;
use crate::stages::score::SsimWindow;
use mocban_core::domain::FailureClass;

/// Settings of the normalize stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalizeParams {
    /// Side of the square canvas in pixels, 64..=2048.
    pub canvas_px: u32,
    /// Longest side of the character on the canvas, in pixels. Must be below `canvas_px`.
    pub character_px: u32,
    /// Paper's method: grey 0..=255 below which a pixel of the print is ink.
    pub print_grey: u8,
    /// Paper's method: first and last grey tried for the density threshold.
    pub density_greys: [u8; 2],
    /// Paper's method: first and last grey tried for the structure threshold.
    pub structure_greys: [u8; 2],
    /// Paper's method: window of the structure score.
    pub window: SsimWindow,
}

/// Why the normalize stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NormalizeError {
    /// The print shows no ink.
    #[error(transparent)]
    Print(#[from] BinarizeError),
    /// The depth map has no strokes at any threshold.
    #[error("no threshold gives the depth map any strokes")]
    NoStrokes,
}

impl NormalizeError {
    /// Returns what the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::Print(_) => FailureClass::BadInput,
            Self::NoStrokes => FailureClass::NoSolution,
        }
    }
}
