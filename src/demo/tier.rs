//! How hard a dataset is, and the ranges that make it so.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::calligraphy;

/// How hard the built-in dataset is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tier {
    /// Millimetres, in-plane within 15 degrees of the print, tilt within 10.
    Upright,
    /// Any orientation, unit and position, slight bow.
    Pose,
    /// As `Pose`, bowed by 0.2-0.8 mm, strokes lost, cracks, other neighbours on mesh and print, bad ink, stains.
    Hard,
    /// Twenty photographed characters as prints, reliefs carved from their clean masks, in any pose.
    Real,
}

impl Tier {
    /// Every tier, the easiest first.
    pub const ALL: [Self; 4] = [Self::Upright, Self::Pose, Self::Hard, Self::Real];

    /// Name on the command line and in file names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Upright => "upright",
            Self::Pose => "pose",
            Self::Hard => "hard",
            Self::Real => "real",
        }
    }

    /// How many pairs there are, where they are not made from a font without end.
    pub const fn most_pairs(self) -> Option<u64> {
        match self {
            Self::Upright | Self::Pose | Self::Hard => None,
            Self::Real => Some(calligraphy::COUNT),
        }
    }

    /// Largest distance in mm of the bent block from its chord over the character.
    pub(super) const fn bow_mm(self) -> Range<f64> {
        match self {
            Self::Upright => 0.0..0.03,
            Self::Pose | Self::Real => 0.0..0.06,
            Self::Hard => 0.2..0.8,
        }
    }

    /// Whether the block was damaged after the print was made.
    pub(super) const fn is_damaged(self) -> bool {
        match self {
            Self::Upright | Self::Pose | Self::Real => false,
            Self::Hard => true,
        }
    }

    /// Whether the scan may lie in any direction and unit.
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
