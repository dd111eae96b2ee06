//! What a scan shows that may keep it from matching its print.

use std::fmt::{Display, Formatter, Result as FormatResult};

use mocban_core::domain::ReliefHeights;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{DepthMap, PixelBox};

/// A piece has at least this fraction of the area of the largest piece.
const LEAST_PIECE: f64 = 0.25;
/// More pieces than this are strokes or gaps of one scan.
const MOST_PIECES: usize = 3;
/// A relief below this fraction of its length is hardly carved. The carving of characters has 2 to 10 percent.
const SHALLOW: f64 = 0.01;

/// A likely cause why relief and print do not match. Completes a message after a semicolon.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum MismatchCause {
    /// The scan shows nothing unusual.
    #[default]
    OtherCharacter,
    /// The scan has several large pieces.
    Pieces(usize),
    /// The relief is shallow.
    Shallow {
        /// Depth of the relief as a fraction of its length.
        depth: f64,
    },
}

impl MismatchCause {
    /// Returns what a depth map shows.
    pub(super) fn seen_in(map: &DepthMap, relief: &ReliefHeights) -> Self {
        let known = map.levels.map(|level| *level != 0);
        let parts = ConnectedComponents::label(&known).parts_of(&known);
        let areas = || parts.iter().map(|(_, area)| *area as f64);
        let largest = areas().fold(0.0, f64::max);
        let pieces = areas()
            .filter(|area| *area >= LEAST_PIECE * largest)
            .count();
        if (2..=MOST_PIECES).contains(&pieces) {
            return Self::Pieces(pieces);
        }
        let bounds = parts.iter().map(|(bounds, _)| *bounds);
        let length = bounds.reduce(PixelBox::union);
        let length = length.map_or(0.0, |all| all.longest_side() as f64);
        let depth = relief.depth() / (length * map.scale.mesh_unit_per_px);
        if depth < SHALLOW {
            Self::Shallow { depth }
        } else {
            Self::OtherCharacter
        }
    }

    /// Returns whether the scan, rather than the print, is the likelier cause.
    pub const fn is_of_scan(self) -> bool {
        !matches!(self, Self::OtherCharacter)
    }
}

impl Display for MismatchCause {
    fn fmt(&self, f: &mut Formatter<'_>) -> FormatResult {
        match self {
            Self::OtherCharacter => f.write_str("is it the print of another character?"),
            Self::Pieces(count) => write!(
                f,
                "the scan has {count} separate pieces: does it show more than the character of the print?"
            ),
            Self::Shallow { depth } => write!(
                f,
                "the relief is only {:.1} % as deep as it is long: does the scan show the back of the block?",
                100.0 * depth
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use mocban_core::domain::ReliefHeights;
    use mocban_core::raster::{DepthMap, Grid};

    use super::MismatchCause;

    /// Returns what is said of a map with data where `is_known`, whose relief has this depth in pixels.
    fn said(is_known: impl Fn(usize, usize) -> bool, depth_px: f64) -> String {
        let map = DepthMap::of_levels(Grid::from_fn(100, 60, |x, y| u16::from(is_known(x, y))));
        let relief = ReliefHeights {
            top: 0.0,
            ground: -depth_px * map.scale.mesh_unit_per_px,
            tops_end: 0.1,
            tops_end_log_deviation: 0.1,
        };
        MismatchCause::seen_in(&map, &relief).to_string()
    }

    #[test]
    fn pieces_and_shallow_reliefs_are_named() {
        let character = "is it the print of another character?";
        assert_eq!(said(|_, _| true, 5.0), character);
        assert_eq!(
            said(|_, _| true, 0.6),
            "the relief is only 0.6 % as deep as it is long: does the scan show the back of the block?"
        );
        let two = said(|x, _| !(45..55).contains(&x), 5.0);
        assert!(two.starts_with("the scan has 2 separate pieces: "), "{two}");
        // A chip, and the strokes of a scan without ground.
        assert_eq!(said(|x, y| x < 80 || (x > 95 && y < 9), 5.0), character);
        assert_eq!(said(|x, _| x % 10 < 5, 5.0), character);
    }
}
