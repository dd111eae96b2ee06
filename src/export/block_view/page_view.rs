//! Reads a block with its results, so that it can be shown.

use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::block_error::BlockViewError;
use super::block_files::{PagePicture, read_face};
use super::characters::{CharacterView, shown_record};
use super::page_layers::PageLayers;
use crate::block::{AlignOutcome, BoxesOutcome, FaceOutcome, FoundFace, PageMap, StoredPageMap};
use crate::catalog::{BlockDetail, BlockStageDetail, Catalog, PairResults};
use crate::domain::{
    ArtifactSet, BlockCharacterState, BlockName, BlockStage, ContentHash, PairName, ThresholdMetric,
};
use crate::export::pair_pictures::{InputFileLimits, PictureError};
use crate::export::scan_view::ScanView;
use crate::raster::ImageLimits;
use crate::store::Project;

/// A block that is aligned with its page, and the results of its characters.
#[derive(Debug)]
pub struct BlockView {
    /// The user's id.
    pub name: BlockName,
    /// The page, and the relief in its frame.
    pub layers: PageLayers,
    /// The characters that have a box.
    pub characters: Vec<CharacterView>,
    /// Share of the places of the face that agree with the page, 0..=1.
    pub agreement: f64,
    pairs: Vec<Option<PairResults>>,
    metric: ThresholdMetric,
    limits: InputFileLimits,
    project: Project,
}

/// Outcomes of the stages of a block, and where its heights and its page are.
struct BlockViewSources {
    face: FoundFace,
    files: ArtifactSet,
    map: StoredPageMap,
    agreement: f64,
    page_path: String,
    page_hash: Option<ContentHash>,
}

impl BlockView {
    /// Reads a block with the results of a metric.
    ///
    /// # Errors
    /// Returns an error if the block is not aligned with its page, or if the catalog, the page or the heights cannot be read.
    pub async fn read(
        catalog: &Catalog,
        project: &Project,
        name: &BlockName,
        metric: ThresholdMetric,
        limits: InputFileLimits,
    ) -> Result<Self, BlockViewError> {
        let detail = catalog.block(name).await?;
        let detail = detail.ok_or_else(|| BlockViewError::Gone(name.clone()))?;
        let sources = BlockViewSources::new(name, &detail)?;
        let (mut characters, mut pairs) = (Vec::new(), Vec::new());
        for stored in catalog.block_characters(name).await? {
            if stored.state == BlockCharacterState::Retired {
                continue;
            }
            let pair = match stored.pair.as_deref().map(PairName::new) {
                Some(Ok(pair)) => catalog.pair(&pair).await?.map(|detail| detail.results),
                _ => None,
            };
            characters.push(CharacterView::new(&stored, pair.as_ref(), metric));
            pairs.push(pair);
        }
        let (agreement, own) = (sources.agreement, project.clone());
        let read = move || sources.read(&own, &limits.image);
        Ok(Self {
            name: name.clone(),
            layers: tokio::task::spawn_blocking(read).await??,
            characters,
            agreement,
            pairs,
            metric,
            limits,
            project: project.clone(),
        })
    }

    /// Returns what the page in the browser shows: the size of the page and the characters, as JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "block": self.name,
            "page_size": self.layers.size(),
            "px_per_mm": self.layers.px_per_mm(),
            "agreement": self.agreement,
            "characters": self.characters,
        })
    }

    /// Reads the 3D view of a character by its index, encoded. Returns `None` if its pair has no result.
    ///
    /// # Errors
    /// Returns an error if a file of the pair cannot be read, has changed since it was aligned, or exceeds the limits.
    pub fn scan(&self, index: usize) -> Result<Option<Vec<u8>>, PictureError> {
        let Some(Some(pair)) = self.pairs.get(index) else {
            return Ok(None);
        };
        let Some(record) = shown_record(pair, self.metric) else {
            return Ok(None);
        };
        let view = ScanView::read(&self.project, pair, record.outcome.metric, self.limits)?;
        Ok(view.map(|view| view.to_bytes()))
    }
}

impl BlockViewSources {
    /// Collects the outcomes of a block.
    fn new(name: &BlockName, detail: &BlockDetail) -> Result<Self, BlockViewError> {
        let stage = |stage| detail.stages.iter().find(|one| one.stage == stage);
        let (Some(face), Some(align)) = (stage(BlockStage::Face), stage(BlockStage::Align)) else {
            return Err(not_aligned(name, detail));
        };
        let faces: FaceOutcome = outcome(face)?;
        let aligned: AlignOutcome = outcome(align)?;
        let unusable = |why: &str| BlockViewError::Outcome {
            stage: BlockStage::Face,
            why: why.to_owned(),
        };
        let mut found = faces.faces.into_iter();
        let shown = found.find(|face| face.side == aligned.side);
        let map = match stage(BlockStage::Boxes) {
            Some(boxes) => outcome::<BoxesOutcome>(boxes)?.page_from_face,
            None => aligned.page_from_face,
        };
        let made_with = align.made_with["page"].clone();
        Ok(Self {
            face: shown.ok_or_else(|| unusable("it has no face on the aligned side"))?,
            files: serde_json::from_value(face.files.clone())
                .map_err(|error| unusable(&error.to_string()))?,
            map,
            agreement: aligned.agreement.agreeing,
            page_path: detail.state.attributes.page_path.clone(),
            page_hash: serde_json::from_value(made_with).unwrap_or_default(),
        })
    }

    /// Reads the page and the heights.
    fn read(self, project: &Project, limits: &ImageLimits) -> Result<PageLayers, BlockViewError> {
        let page = PagePicture::read(project, &self.page_path, self.page_hash, limits)?;
        Ok(PageLayers {
            page: page.picture,
            ink: page.ink,
            face: read_face(project, &self.files, &self.face)?,
            map: PageMap::try_from(self.map).map_err(|why| BlockViewError::Outcome {
                stage: BlockStage::Align,
                why,
            })?,
        })
    }
}

/// Returns the error of a block without alignment, with its failure or what to do.
pub(super) fn not_aligned(name: &BlockName, detail: &BlockDetail) -> BlockViewError {
    let why = match &detail.state.failure {
        Some(stored) => format!("{} failed: {}", stored.stage, stored.failure.message),
        None => "it has not run yet; use `run` first".to_owned(),
    };
    BlockViewError::NotAligned {
        block: name.clone(),
        why,
    }
}

pub(super) fn outcome<T: DeserializeOwned>(stage: &BlockStageDetail) -> Result<T, BlockViewError> {
    T::deserialize(&stage.outcome).map_err(|error| BlockViewError::Outcome {
        stage: stage.stage,
        why: error.to_string(),
    })
}
