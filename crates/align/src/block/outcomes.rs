//! What the stages of a block store as JSON.

use std::num::NonZeroU64;

use serde::{Deserialize, Serialize};

use super::agreement::{Agreement, Support};
use super::characters::PlacedCharacter;
use super::page_map::StoredPageMap;
use super::stored_heights::HeightHeader;
use mocban_core::domain::{BlockSide, LengthUnit};

/// What `face` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FaceOutcome {
    /// Unit of the scan: given, or the one in which it has the size of a block.
    pub unit: LengthUnit,
    /// Triangles of the scan.
    pub triangles: u64,
    /// Number of vertices of the scan that were left out because they have no position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing_vertices: Option<NonZeroU64>,
    /// Number of faces of the scan that were left out because they have fewer than three corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub incomplete_faces: Option<NonZeroU64>,
    /// The faces that were found.
    pub faces: Vec<FoundFace>,
}

/// A face of a block.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FoundFace {
    /// Its side.
    pub side: BlockSide,
    /// Width and height, mm.
    pub size_mm: [f64; 2],
    /// Position and meaning of the stored heights.
    pub heights: HeightHeader,
}

/// What `align` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AlignOutcome {
    /// The side that the page shows.
    pub side: BlockSide,
    /// What may be wrong with the image of the page.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Width and height of the page, pixels.
    pub page_size: [usize; 2],
    /// Pixels of the page per mm.
    pub px_per_mm: f64,
    /// Rotation from the face to the page, from x to y, degrees.
    pub angle_deg: f64,
    /// How well the places of the face agree with the page.
    pub agreement: Agreement,
    /// Where they agree.
    pub support: Support,
    /// The map of the face to the page.
    pub page_from_face: StoredPageMap,
}

/// What `boxes` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BoxesOutcome {
    /// Format of the labels; `None` if the boxes were found.
    pub labels: Option<String>,
    /// What was assumed about the labels or left out, and what contradicts the unit of the scan.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Number of characters.
    pub count: usize,
    /// Number of characters with a confidence of at least 0.5.
    pub sure: usize,
    /// The map of the face to the page, refined by the characters.
    pub page_from_face: StoredPageMap,
    /// The characters in reading order.
    pub characters: Vec<PlacedCharacter>,
}

/// What `cut` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CutOutcome {
    /// Number of characters that were cut.
    pub count: usize,
    /// Number of characters with nothing to cut.
    pub left: usize,
}

/// Returns the role of a face's heights among the artifacts of `face`.
pub fn heights_role(side: BlockSide) -> String {
    format!("{side}.png")
}
