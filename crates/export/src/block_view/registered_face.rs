//! The face of a block as it was registered with its page: what the stages stored.

use serde::de::DeserializeOwned;

use super::block_error::BlockViewError;
use mocban_align::block::{
    AlignOutcome, BoxesOutcome, CarvedFace, FaceOutcome, FoundFace, PageMap, StoredHeights,
    StoredPageMap, Support, heights_role,
};
use mocban_catalog::{BlockDetail, BlockStageDetail, Catalog};
use mocban_core::domain::{ArtifactSet, BlockName, BlockSide, BlockStage, ContentHash, LengthUnit};
use mocban_core::raster;
use mocban_store::Project;

/// Returns what is stored of a block.
pub(super) async fn stored_block(
    catalog: &Catalog,
    name: &BlockName,
) -> Result<BlockDetail, BlockViewError> {
    let detail = catalog.block(name).await?;
    detail.ok_or_else(|| BlockViewError::Gone(name.clone()))
}

/// The registration of a block, and where its heights are.
#[derive(Debug)]
pub(crate) struct RegisteredFace {
    /// The side that the page shows.
    pub(crate) side: BlockSide,
    /// Unit of the scan.
    pub(crate) unit: LengthUnit,
    /// Fraction of the places of the face that agree with the page, 0..=1.
    pub(crate) agreement: f64,
    /// Where they agree.
    pub(crate) support: Support,
    /// Hash of the image of the page.
    pub(crate) page_hash: Option<ContentHash>,
    face: FoundFace,
    files: ArtifactSet,
    map: StoredPageMap,
    /// The stage that refined the map last.
    map_stage: BlockStage,
}

impl RegisteredFace {
    /// Collects the current outcomes of a block. Returns `None` if its page is not aligned: it has not run, was refused, or
    /// runs again.
    pub(crate) fn of(detail: &BlockDetail) -> Result<Option<Self>, BlockViewError> {
        let next = detail.state.next_stage;
        let is_current = |stage| next.is_none_or(|next| stage < next);
        let find = |stage| {
            let mut stages = detail.stages.iter();
            stages.find(|one| one.stage == stage && is_current(stage))
        };
        let (Some(face), Some(align)) = (find(BlockStage::Face), find(BlockStage::Align)) else {
            return Ok(None);
        };
        let scan: FaceOutcome = outcome(face)?;
        let aligned: AlignOutcome = outcome(align)?;
        let mut faces = scan.faces.into_iter();
        let shown = faces.find(|face| face.side == aligned.side);
        let (map, map_stage) = match find(BlockStage::Boxes) {
            Some(boxes) => {
                let boxes: BoxesOutcome = outcome(boxes)?;
                (boxes.page_from_face, BlockStage::Boxes)
            }
            None => (aligned.page_from_face, BlockStage::Align),
        };
        let provenance = align.provenance["page"].clone();
        Ok(Some(Self {
            side: aligned.side,
            unit: scan.unit,
            agreement: aligned.agreement.agreeing,
            support: aligned.support,
            page_hash: serde_json::from_value(provenance).unwrap_or_default(),
            face: shown
                .ok_or_else(|| unusable(BlockStage::Face, "it has no face on the aligned side"))?,
            files: serde_json::from_value(face.files.clone())
                .map_err(|error| unusable(BlockStage::Face, &error.to_string()))?,
            map,
            map_stage,
        }))
    }

    /// Returns the map of the face to the page.
    ///
    /// # Errors
    /// Returns an error if the stored map has no grid.
    pub(crate) fn map(&self) -> Result<PageMap, BlockViewError> {
        PageMap::try_from(self.map.clone()).map_err(|why| unusable(self.map_stage, &why))
    }

    /// Returns the number of columns of the nodes of the map, and the pixels of the page of the nodes, row by row.
    pub(crate) fn nodes(&self) -> (usize, &[[f64; 2]]) {
        (self.map.columns, &self.map.nodes_px)
    }

    /// Returns whether the heights are in a file that is there, and not in an object store.
    pub(super) fn has_height_file(&self, project: &Project) -> bool {
        let heights = self.files.get(&heights_role(self.face.side));
        heights.is_some_and(|heights| project.artifact_path(heights).is_file())
    }

    /// Reads the heights of the face, and computes its relief.
    ///
    /// # Errors
    /// Returns an error if the heights cannot be read, or if no surface fits them.
    pub(crate) fn read_face(&self, project: &Project) -> Result<CarvedFace, BlockViewError> {
        read_face(project, &self.files, &self.face)
    }
}

/// Reads the heights of a face, and computes its relief. `files` are the artifacts of the stage `face`.
///
/// # Errors
/// Returns an error if the heights cannot be read, or if no surface fits them.
pub(super) fn read_face(
    project: &Project,
    files: &ArtifactSet,
    found: &FoundFace,
) -> Result<CarvedFace, BlockViewError> {
    let heights = files.get(&heights_role(found.side));
    let heights = heights.ok_or_else(|| unusable(BlockStage::Face, "it has no heights"))?;
    let values = raster::decode_grey16(&project.read_artifact(heights)?)?;
    let header = found.heights;
    let face = CarvedFace::of(&StoredHeights { header, values });
    face.ok_or_else(|| unusable(BlockStage::Face, "no surface fits its heights"))
}

pub(super) fn unusable(stage: BlockStage, why: &str) -> BlockViewError {
    BlockViewError::Outcome {
        stage,
        why: why.to_owned(),
    }
}

pub(super) fn outcome<T: DeserializeOwned>(stage: &BlockStageDetail) -> Result<T, BlockViewError> {
    T::deserialize(&stage.outcome).map_err(|error| unusable(stage.stage, &error.to_string()))
}
