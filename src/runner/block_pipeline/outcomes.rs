//! What the stages of a block return as JSON.

use serde::{Deserialize, Serialize};

use crate::block::{Agreement, HeightHeader, PlacedCharacter, StoredPageMap, Support};
use crate::domain::{BlockSide, ContentHash, LengthUnit};

/// What `face` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct FaceOutcome {
    /// Unit of the scan: given, or the one in which it has the size of a block.
    pub(super) unit: LengthUnit,
    /// Triangles of the scan.
    pub(super) triangles: u64,
    /// The faces that were found.
    pub(super) faces: Vec<FoundFace>,
}

/// A face of a block.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct FoundFace {
    /// Its side.
    pub(super) side: BlockSide,
    /// Width and height, mm.
    pub(super) size_mm: [f64; 2],
    /// Position and meaning of the stored heights.
    pub(super) heights: HeightHeader,
}

/// What `align` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct AlignOutcome {
    /// The side that the page shows.
    pub(super) side: BlockSide,
    /// Width and height of the page, pixels.
    pub(super) page_size: [usize; 2],
    /// Pixels of the page per mm.
    pub(super) px_per_mm: f64,
    /// Rotation from the face to the page, from x to y, degrees.
    pub(super) angle_deg: f64,
    /// How well the places of the face agree with the page.
    pub(super) agreement: Agreement,
    /// Where they agree.
    pub(super) support: Support,
    /// The map of the face to the page.
    pub(super) page_from_face: StoredPageMap,
}

/// What `boxes` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct BoxesOutcome {
    /// Format of the labels; `None` if the boxes were found.
    pub(super) labels: Option<String>,
    /// What was assumed about the labels or left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) warnings: Vec<String>,
    /// Number of characters.
    pub(super) count: usize,
    /// Number of characters with a confidence of at least 0.5.
    pub(super) sure: usize,
    /// The map of the face to the page, refined by the characters.
    pub(super) page_from_face: StoredPageMap,
    /// The characters in reading order.
    pub(super) characters: Vec<PlacedCharacter>,
}

/// What `cut` returns.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct CutOutcome {
    /// Number of characters that were cut.
    pub(super) count: usize,
    /// Number of characters with nothing to cut.
    pub(super) left: usize,
    /// Hash of the content of the page from which the prints were cut.
    pub(super) page_hash: ContentHash,
}
