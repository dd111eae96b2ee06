//! Difficulty tiers of the dataset and their parameter ranges.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::domain::enum_names;

/// Number of pairs of the `real` tier.
pub(super) const REAL_PAIRS: u64 = 20;

/// Difficulty of the built-in dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tier {
    /// Scans in mm, rotated by at most 15 degrees against the print and tilted by at most 10 degrees.
    Upright,
    /// Any orientation, unit and position; slight bend.
    Pose,
    /// Like `Pose`, but with a bend of 0.2-0.8 mm, lost strokes, cracks, uneven ink and stains. Mesh and print show
    /// different neighbouring characters.
    Hard,
    /// The prints are twenty photographs of characters. The reliefs are carved from clean masks and have any pose.
    Real,
}

enum_names! { pub Tier, "a tier":
    Upright = "upright", Pose = "pose", Hard = "hard", Real = "real",
}

impl Tier {
    /// Returns the number of distinct pairs, or `None` when it is unlimited.
    pub fn max_pairs(self) -> Option<u64> {
        (self == Self::Real).then_some(REAL_PAIRS)
    }

    /// Returns the range of the bend's sagitta over the character, mm.
    pub(super) const fn bend_mm(self) -> Range<f64> {
        match self {
            Self::Upright => 0.0..0.03,
            Self::Pose | Self::Real => 0.0..0.06,
            Self::Hard => 0.2..0.8,
        }
    }

    /// Returns whether the block was damaged after printing.
    pub(super) fn is_damaged(self) -> bool {
        self == Self::Hard
    }

    /// Returns whether the scan has an arbitrary orientation and unit.
    pub(super) fn is_any_pose(self) -> bool {
        self != Self::Upright
    }
}
