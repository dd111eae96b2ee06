//! Blocks as plain values: attributes, input files, and what is stored of them.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::Result;
use crate::db::row::{FromRow, Row, from_row};
use crate::db::rows::input_version;
use mocban_core::domain::{
    BlockCharacterState, BlockName, BlockSide, BlockStage, BlockStageRecord, ContentHash,
    ControlPoints, InputVersion, LengthUnit, PrintFromMesh,
};

/// What became of a change of a block's labels or control points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockChange {
    /// It is stored.
    Stored,
    /// The block has others than the caller has read. Nothing is changed.
    Outdated,
    /// There is no such block.
    NoBlock,
}

/// Attributes of a block as imported.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BlockAttributes {
    /// The user's id.
    pub name: BlockName,
    /// Path of the mesh as stored: relative to the project, or absolute.
    pub mesh_path: String,
    /// Path of the image of the page, likewise.
    pub page_path: String,
    /// Path of the labels, likewise. `None` if the characters are to be found.
    pub labels_path: Option<String>,
    /// Unit of the mesh, if known.
    pub unit: Option<LengthUnit>,
    /// The side of the scan that the page shows, if known.
    pub side: Option<BlockSide>,
    /// All other columns of the list. `None` if they were not read, and in an import whose source has no such columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meta: Option<Map<String, Value>>,
}

from_row! { BlockAttributes { name, mesh_path, page_path, labels_path, unit, side, meta as JsonOrNull } }

impl BlockAttributes {
    /// Returns the attributes that results depend on, as JSON.
    pub(crate) fn of_results(&self) -> Value {
        json!({ "unit": self.unit, "side": self.side })
    }
}

/// Versions of a block's input files. `None` for a file that was not read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BlockInputVersions {
    /// The mesh.
    pub mesh: Option<InputVersion>,
    /// The image of the page.
    pub page: Option<InputVersion>,
    /// The labels.
    pub labels: Option<InputVersion>,
}

/// Reads the input files of a block as last read.
impl FromRow for BlockInputVersions {
    fn from_row(row: &Row) -> Result<Self> {
        Ok(Self {
            mesh: input_version(row, "mesh")?,
            page: input_version(row, "page")?,
            labels: input_version(row, "labels")?,
        })
    }
}

impl BlockInputVersions {
    /// Returns whether control points were chosen on this mesh and this page.
    pub fn have(&self, points: &ControlPoints) -> bool {
        let is = |version: &Option<InputVersion>, hash: ContentHash| {
            version.as_ref().is_some_and(|version| version.hash == hash)
        };
        is(&self.mesh, points.mesh) && is(&self.page, points.page)
    }
}

/// What a result or a failure of a stage was made with. Stored as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BlockProvenance {
    /// Revision and settings of the stage.
    pub settings: Value,
    /// The attributes that results depend on.
    pub attributes: Value,
    /// Hash of the mesh. `None` in a failure before the mesh was read.
    pub mesh: Option<ContentHash>,
    /// Hash of the page. `None` if the stage does not read it, or in a failure before it was read.
    pub page: Option<ContentHash>,
    /// Hash of the labels. `None` if the stage does not depend on them, if there are none, or in a failure before they
    /// were read.
    pub labels: Option<ContentHash>,
    /// Hash of the control points. `None` if there are none for these files, or if the stage does not depend on them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub control_points: Option<ContentHash>,
}

impl BlockProvenance {
    /// Describes a stage that was computed from these inputs.
    pub fn new(
        stage: BlockStage,
        settings: &Value,
        attributes: &BlockAttributes,
        inputs: &BlockInputVersions,
        control_points: Option<&ControlPoints>,
    ) -> Self {
        let points = control_points.filter(|points| inputs.have(points) && stage.reads_page());
        let hash = |version: &Option<InputVersion>| version.as_ref().map(|version| version.hash);
        let has_labels = attributes.labels_path.is_some() && stage.depends_on_labels();
        Self {
            settings: settings.clone(),
            attributes: attributes.of_results(),
            mesh: hash(&inputs.mesh),
            page: stage.reads_page().then(|| hash(&inputs.page)).flatten(),
            labels: has_labels.then(|| hash(&inputs.labels)).flatten(),
            control_points: points.map(ControlPoints::hash),
        }
    }
}

/// A leased block with its attributes and results.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockWork {
    /// Attributes as imported.
    pub attributes: BlockAttributes,
    /// Input files as last read.
    pub inputs: BlockInputVersions,
    /// Places that a person chose on scan and page.
    pub control_points: Option<ControlPoints>,
    /// Results of all completed stages, in order.
    pub results: Vec<BlockStageRecord>,
}

/// A character of a block as the stage `cut` returns it.
#[derive(Debug, Clone, PartialEq)]
pub struct NewCharacter {
    /// The label, unique in the block.
    pub label: String,
    /// The character, if the labels name it.
    pub character: Option<String>,
    /// Edges of its box on the page in pixels, in continuous coordinates: left, top, right, bottom.
    pub bounds: [f64; 4],
    /// How sure its position is, from 0 to 1.
    pub confidence: Option<f64>,
    /// The maps between crop, mesh and page, as JSON.
    pub maps: Option<Value>,
    /// Its files, or why nothing was cut.
    pub cut: Result<CutPair, String>,
}

/// Files of a character that was cut, and attributes of its pair.
#[derive(Debug, Clone, PartialEq)]
pub struct CutPair {
    /// Path of the mesh as stored, relative to the project.
    pub mesh_path: String,
    /// Its content.
    pub mesh: InputVersion,
    /// Path of the print as stored, relative to the project.
    pub print_path: String,
    /// Its content.
    pub print: InputVersion,
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
    /// Whether the block lay face down when scanned, if this is known.
    pub scanned_face_down: Option<bool>,
    /// The expected alignment, as JSON text.
    pub prior: Option<String>,
}

/// The maps of a character that was cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CharacterMaps {
    /// Map (3 x 3) from pixels of its print to pixels of the page.
    pub page_from_crop: [[f64; 3]; 3],
    /// Map (3 x 4) from points of the scan to pixels of the page, and the height over the tops of the strokes.
    pub page_from_mesh: PrintFromMesh,
}

/// From where a pair was cut out of its block.
#[derive(Debug, Clone, PartialEq)]
pub struct CutOrigin {
    /// The label of the character.
    pub label: String,
    /// Edges of its box on the page in pixels: left, top, right, bottom.
    pub bounds: [f64; 4],
    /// Its maps.
    pub maps: Option<CharacterMaps>,
}

from_row! { CutOrigin { label, bounds: "box" as Json, maps as JsonOrNull } }

/// A character of a block as stored.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredCharacter {
    /// The label.
    pub label: String,
    /// The character, if the labels name it.
    pub character: Option<String>,
    /// Edges of its box on the page in pixels: left, top, right, bottom.
    #[serde(rename = "box")]
    pub bounds: [f64; 4],
    /// How sure its position is, from 0 to 1.
    pub confidence: Option<f64>,
    /// What became of it.
    pub state: BlockCharacterState,
    /// Why it was not cut.
    pub reason: Option<String>,
    /// The maps between crop, mesh and page.
    pub maps: Option<Value>,
    /// Id of its pair.
    pub pair: Option<String>,
}

from_row! { StoredCharacter { label, character, bounds: "box" as Json, confidence, state, reason, maps as JsonOrNull, pair } }
