//! Difficulty tiers of the dataset and their parameter ranges.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::kind::{self, DemoKind};
use mocban_core::domain::enum_names;

/// Number of pairs of the `real` tier.
pub(super) const REAL_PAIRS: u64 = 20;

/// Difficulty of the built-in dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
    /// A moderate mix of wear, dirt, scan errors, uneven ink and deformed sheets.
    Field,
    /// Stroke tops worn down in patches and rounded at their edges.
    Worn,
    /// Shallow carving.
    Shallow,
    /// Dirt in the valleys.
    Filled,
    /// Scans smoothed by their software.
    Smoothed,
    /// Scans with strong noise and ripples.
    Noisy,
    /// Scans with slow height errors, up to more than the carved depth.
    Drift,
    /// Scans stitched from two views that do not meet.
    Stitched,
    /// Rules and neighbours that are higher than the character.
    RaisedRules,
    /// A block or foot deeper than wide.
    Thick,
    /// Another character on the back of the block.
    DoubleFaced,
    /// A block on a table that was scanned with it.
    Table,
    /// Far outlier vertices and floating pieces.
    Debris,
    /// Large holes, through which the bottom or a surface behind the block shows.
    Holes,
    /// Too little ink.
    Dry,
    /// Too much ink.
    Heavy,
    /// A photograph of the print, taken at an angle.
    Photo,
    /// Sheets warped by uneven drying.
    Wavy,
    /// Sheets that shrank more along one axis than along the other.
    Shrunk,
    /// A large part of the strokes lost after printing.
    Lost,
    /// A mesh with all eight neighbours of the character; the print shows only the character.
    GridMesh,
    /// A print with all eight neighbours of the character; the mesh shows only the character.
    GridPrint,
    /// Several of these at once, most of them milder.
    Mixed,
    /// A small character in a wide scan with an uncarved rim.
    WideRim,
    /// Several carved pieces in one scan; the print shows one.
    Pieces,
    /// A crack through the character, one side of which slid and sank.
    Slid,
    /// Coloured ink that is hardly darker than the coloured sheet.
    Coloured,
    /// Pictures of the print that were scaled unequally.
    Stretched,
    /// Sheets torn or folded through the character, whose parts do not meet.
    Torn,
    /// Torn halves of sheets on a dark ground.
    HalfPrint,
    /// All other tiers in turn.
    All,
}

enum_names! { pub Tier, "a tier":
    Upright = "upright", Pose = "pose", Hard = "hard", Real = "real",
    Field = "field", Worn = "worn", Shallow = "shallow", Filled = "filled",
    Smoothed = "smoothed", Noisy = "noisy", Drift = "drift", Stitched = "stitched",
    RaisedRules = "raised-rules", Thick = "thick", DoubleFaced = "double-faced",
    Table = "table", Debris = "debris", Holes = "holes", Dry = "dry",
    Heavy = "heavy", Photo = "photo", Wavy = "wavy", Shrunk = "shrunk",
    Lost = "lost", GridMesh = "grid-mesh", GridPrint = "grid-print", Mixed = "mixed",
    WideRim = "wide-rim", Pieces = "pieces", Slid = "slid",
    Coloured = "coloured", Stretched = "stretched", Torn = "torn", HalfPrint = "half-print",
    All = "all",
}

impl Tier {
    /// Returns the number of distinct pairs, or `None` when it is unlimited.
    pub fn max_pairs(self) -> Option<u64> {
        (self == Self::Real).then_some(REAL_PAIRS)
    }

    /// Returns the tier of the pair with the given index, and its index within that tier. They differ from `self` and
    /// `index` only if `self` is `All`.
    pub(super) fn tier_and_index(self, index: u64) -> (Self, u64) {
        if self != Self::All {
            return (self, index);
        }
        let turns = Self::ALL.len() as u64 - 1;
        (Self::ALL[(index % turns) as usize], index / turns)
    }

    /// Returns the ranges of the conditions, or `None` for the first four tiers, which have their own rules.
    pub(super) const fn kind(self) -> Option<&'static DemoKind> {
        Some(match self {
            Self::Upright | Self::Pose | Self::Hard | Self::Real | Self::All => return None,
            Self::Field => &kind::FIELD,
            Self::Worn => &kind::WORN,
            Self::Shallow => &kind::SHALLOW,
            Self::Filled => &kind::FILLED,
            Self::Smoothed => &kind::SMOOTHED,
            Self::Noisy => &kind::NOISY,
            Self::Drift => &kind::DRIFT,
            Self::Stitched => &kind::STITCHED,
            Self::RaisedRules => &kind::RAISED,
            Self::Thick => &kind::THICK,
            Self::DoubleFaced => &kind::DOUBLE_FACED,
            Self::Table => &kind::TABLE,
            Self::Debris => &kind::DEBRIS,
            Self::Holes => &kind::HOLES,
            Self::Dry => &kind::DRY,
            Self::Heavy => &kind::HEAVY,
            Self::Photo => &kind::PHOTO,
            Self::Wavy => &kind::WAVY,
            Self::Shrunk => &kind::SHRUNK,
            Self::Lost => &kind::LOST,
            Self::GridMesh => &kind::GRID_MESH,
            Self::GridPrint => &kind::GRID_PRINT,
            Self::Mixed => &kind::MIXED,
            Self::WideRim => &kind::WIDE_RIM,
            Self::Pieces => &kind::PIECES,
            Self::Slid => &kind::SLID,
            Self::Coloured => &kind::COLOURED,
            Self::Stretched => &kind::STRETCHED,
            Self::Torn => &kind::TORN,
            Self::HalfPrint => &kind::HALF_PRINT,
        })
    }

    /// Returns the range of the bend's sagitta over the character, mm.
    pub(super) const fn bend_mm(self) -> Range<f64> {
        match self {
            Self::Upright => 0.0..0.03,
            Self::Hard => 0.2..0.8,
            Self::Field | Self::Mixed => 0.0..0.25,
            _ => 0.0..0.06,
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

#[cfg(test)]
mod tests {
    use super::Tier;

    #[test]
    fn all_takes_every_other_tier_in_turn() {
        let last = Tier::ALL.len() as u64 - 2;
        assert_eq!(Tier::All.tier_and_index(0), (Tier::Upright, 0));
        assert_eq!(Tier::All.tier_and_index(last), (Tier::HalfPrint, 0));
        assert_eq!(Tier::All.tier_and_index(last + 2), (Tier::Pose, 1));
        assert_eq!(Tier::Worn.tier_and_index(7), (Tier::Worn, 7));
    }
}
