//! Whole blocks: the scan of a carved face with the image of its page, from which pairs are cut.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ArtifactSet, ContentHash, PairName, PairNameError, enum_names, stage_order};

/// Row id of a block in the catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BlockId(pub i64);

/// The user's id of a block. The same rules apply as for the id of a pair.
#[derive(
    Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(transparent)]
pub struct BlockName(PairName);

impl BlockName {
    /// Validates an id and converts it to NFC.
    ///
    /// # Errors
    /// Returns an error if the id is empty, too long, or has a character that is not allowed.
    pub fn new(text: &str) -> Result<Self, PairNameError> {
        PairName::new(text).map(Self)
    }

    /// Returns the id.
    pub fn as_str(&self) -> &str {
        self.0.as_str()
    }

    /// Returns the id as a part of file names, as for a pair.
    pub fn file_name(&self) -> Cow<'_, str> {
        self.0.file_name()
    }

    /// Returns the id in the form of the id of a pair.
    pub const fn as_pair(&self) -> &PairName {
        &self.0
    }

    /// Returns the id of the pair that is cut from this block for a label: `BLOCK_LABEL`.
    ///
    /// # Errors
    /// Returns an error if the label has a character that an id may not have, or if the whole id is too long.
    pub fn pair(&self, label: &str) -> Result<PairName, PairNameError> {
        PairName::new(&format!("{}_{label}", self.0))
    }
}

impl std::fmt::Display for BlockName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::str::FromStr for BlockName {
    type Err = PairNameError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::new(text)
    }
}

/// A stage of a whole block. Variants are in processing order.
///
/// ```
/// use mocban_core::domain::BlockStage;
///
/// assert_eq!(BlockStage::Face.next(), Some(BlockStage::Align));
/// assert_eq!(BlockStage::Cut.next(), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BlockStage {
    /// Mesh to height maps of its sides.
    Face,
    /// Height maps and page to the map between them.
    Align,
    /// Labels, or boxes found, to the positions of the characters.
    Boxes,
    /// Characters to a mesh and a print each, which become pairs.
    Cut,
}

enum_names! { pub BlockStage, "a stage of a block":
    Face = "face", Align = "align", Boxes = "boxes", Cut = "cut",
}

stage_order!(BlockStage);

impl BlockStage {
    /// Returns whether the stage reads the image of the page.
    pub const fn reads_page(self) -> bool {
        !matches!(self, Self::Face)
    }

    /// Returns whether the result of the stage depends on the labels.
    pub const fn depends_on_labels(self) -> bool {
        matches!(self, Self::Boxes | Self::Cut)
    }
}

/// The side of a scan that was printed on the page. The front is the side that looks along the positive direction of the
/// mesh axis that is nearest to the normal of the face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BlockSide {
    /// The side in the positive direction.
    Front,
    /// The side in the negative direction.
    Back,
}

enum_names! { pub BlockSide, "a side":
    Front = "front", Back = "back",
}

/// The stored result of one stage of a block.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BlockStageRecord {
    /// The stage.
    pub stage: BlockStage,
    /// The outcome as JSON text.
    pub outcome: String,
    /// Artifacts by role.
    pub files: ArtifactSet,
    /// Hash over outcome and artifacts.
    pub result_hash: ContentHash,
}

/// What became of a character of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BlockCharacterState {
    /// It was cut and is a pair.
    Cut,
    /// Its box was read or found, but there is nothing to cut, for example because it lies beside the scan.
    Left,
    /// Its box is gone from the labels, so its pair is retired.
    Retired,
}

enum_names! { pub BlockCharacterState, "a state of a character":
    Cut = "cut", Left = "left", Retired = "retired",
}

/// A character on the page of a block whose box is known to be right, for measuring boxes that were found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueBox {
    /// Edges on the page in pixels, in continuous coordinates: left, top, right, bottom.
    #[serde(rename = "box")]
    pub bounds: [f64; 4],
    /// Whether the page shows only a part of the character. Such a box may be found or not.
    pub is_partial: bool,
}

#[cfg(test)]
mod tests {
    use super::{BlockName, BlockStage};

    #[test]
    fn index_and_name_round_trip() {
        for stage in BlockStage::ALL {
            assert_eq!(BlockStage::from_index(stage.index()), Some(stage));
            assert_eq!(stage.name().parse(), Ok(stage));
        }
    }

    #[test]
    fn a_pair_is_named_after_block_and_label() {
        let block = BlockName::new("Kiều 12a").expect("a valid name");
        let pair = block.pair("c03-r12").expect("a valid name");
        assert_eq!(pair.as_str(), "Kiều 12a_c03-r12");
        assert!(block.pair("a/b").is_err());
        assert!(block.pair(&"a".repeat(200)).is_err());
    }
}
