//! Difficulty tiers of the dataset and their parameter ranges.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Number of pairs of the `real` tier.
pub(super) const REAL_PAIRS: u64 = 20;

/// Difficulty of the built-in dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tier {
    /// Unit mm, rotation within 15 degrees of the print, tilt within 10 degrees.
    Upright,
    /// Any orientation, unit and position; slight bend.
    Pose,
    /// Like `Pose`, with a bend of 0.2-0.8 mm, lost strokes, cracks, different neighbours on mesh and print, uneven ink and
    /// stains.
    Hard,
    /// Twenty photographed characters as prints, with reliefs carved from their clean masks, in any pose.
    Real,
}

impl Tier {
    /// All tiers, easiest first.
    pub const ALL: [Self; 4] = [Self::Upright, Self::Pose, Self::Hard, Self::Real];

    /// Returns the name used on the command line and in file names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Upright => "upright",
            Self::Pose => "pose",
            Self::Hard => "hard",
            Self::Real => "real",
        }
    }

    /// Returns the number of distinct pairs, or `None` when it is unlimited.
    pub const fn max_pairs(self) -> Option<u64> {
        match self {
            Self::Upright | Self::Pose | Self::Hard => None,
            Self::Real => Some(REAL_PAIRS),
        }
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
    pub(super) const fn is_damaged(self) -> bool {
        match self {
            Self::Upright | Self::Pose | Self::Real => false,
            Self::Hard => true,
        }
    }

    /// Returns whether the scan has an arbitrary orientation and unit.
    pub(super) const fn is_any_pose(self) -> bool {
        match self {
            Self::Upright => false,
            Self::Pose | Self::Hard | Self::Real => true,
        }
    }
}

impl std::fmt::Display for Tier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Tier {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|tier| tier.name() == text)
            .ok_or_else(|| format!("{text:?} is not a tier (upright, pose, hard, real)"))
    }
}
