//! Settings and errors of the fit stage.

use serde::{Deserialize, Serialize};

use crate::stages::zbuffer::LARGEST_OVERLAP;
use mocban_core::domain::{FailureClass, significant};

/// Settings of the fit stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitParams {
    /// Whether a second-degree surface may be fitted where the block is bent.
    pub curved_blocks: bool,
    /// Paper's method: seed of the random choices.
    pub seed: u64,
    /// Paper's method: number of points of the spaced selection, 3 or more.
    pub spaced_points: u32,
    /// Paper's method: least distance between selected points, as a fraction of the mesh's extent, above 0.
    pub spacing: f64,
    /// Paper's method: RANSAC draws, 1 or more.
    pub ransac_draws: u32,
    /// Paper's method: largest distance of a RANSAC inlier from the plane, as a fraction of the mesh's extent, above 0.
    pub ransac_distance: f64,
    /// Smallest depth of the carving, as a fraction of the mesh's extent. The fit fails below this.
    pub min_relief: f64,
}

/// The carved face around a character, as the scan of the whole block shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedFace {
    /// Direction out of the block, in the frame of the mesh. Its length does not matter.
    pub normal: [f64; 3],
}

/// Why the fit stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Fewer than three points.
    #[error("mesh has {0} vertices, a plane needs 3")]
    TooFewPoints(usize),
    /// Coordinates whose squares are no finite numbers.
    #[error("the coordinates of the {0} vertices are too large to compute with; check the unit")]
    TooLarge(usize),
    /// Every vertex at one place.
    #[error("all {0} vertices lie at one point")]
    OnePoint(usize),
    /// Every vertex on one line.
    #[error("all {0} vertices lie on one line")]
    OneLine(usize),
    /// No faces, and too few points to represent a surface.
    #[error("mesh has no faces, and {0} points are too few to show a surface")]
    NoFaces(usize),
    /// Renderings of the mesh cover fewer than 16 pixels.
    #[error("mesh of {0} vertices shows no surface from either side")]
    NoSurface(usize),
    /// Large triangles overlap too often to be drawn.
    #[error(
        "its {0} triangles overlap more than {LARGEST_OVERLAP} times, or most are slivers across the scan; remove repeated \
         faces or remesh the scan"
    )]
    Overlap(usize),
    /// Nothing is carved.
    #[error(
        "no carving found: the likeliest side has a relief of {} on an extent of {} (mesh units), a share below \
         fit.min_relief {min_relief}{}", significant(*relief, 3), significant(*extent, 3), if *searched { "; no other side or part resembles the print" } else { "" }
    )]
    NoRelief {
        /// Relief found, in mesh units.
        relief: f64,
        /// Extent of the mesh, in mesh units.
        extent: f64,
        /// The setting.
        min_relief: f64,
        /// The other sides and the parts of the scan were compared with the print.
        searched: bool,
    },
    /// RANSAC found no plane.
    #[error("plane fit found {inliers} inliers of {taken} selected points, needs {needs}")]
    TooFewInliers {
        /// Points near the best plane.
        inliers: usize,
        /// Points that were selected.
        taken: usize,
        /// Points needed.
        needs: usize,
    },
}

impl FitError {
    /// Returns what the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::NoRelief { .. } | Self::TooFewInliers { .. } => FailureClass::NoSolution,
            _ => FailureClass::BadInput,
        }
    }
}
