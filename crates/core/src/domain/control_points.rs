//! Places on a block and the same places on its page, chosen by a person.

use serde::{Deserialize, Serialize};

use super::{BlockSide, ContentHash};

/// A place on a block and the same place on the image of its page.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ControlPoint {
    /// The place on the block, in the frame and unit of its mesh.
    pub mesh: [f64; 3],
    /// The pixel of the page.
    pub page: [f64; 2],
}

/// The control points of a block, from which `align` starts instead of a search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlPoints {
    /// The mesh on which they were chosen. They count for no other file.
    pub mesh: ContentHash,
    /// The image of the page on which they were chosen, likewise.
    pub page: ContentHash,
    /// The side that the page shows.
    pub side: BlockSide,
    /// At least [`ControlPoints::MIN`].
    pub points: Vec<ControlPoint>,
}

impl ControlPoints {
    /// Least number of points: two determine rotation, shift and scale, and the third shows a mistake.
    pub const MIN: usize = 3;
    /// Largest number of points that are accepted.
    pub const MAX: usize = 50;

    /// Returns the hash over files and points.
    pub fn hash(&self) -> ContentHash {
        let points = self.points.iter();
        let points = points.map(|point| format!(" {:?} {:?}", point.mesh, point.page));
        let text = [format!("{} {} {}", self.mesh, self.page, self.side)];
        let text: String = text.into_iter().chain(points).collect();
        ContentHash::of(text.as_bytes())
    }
}
