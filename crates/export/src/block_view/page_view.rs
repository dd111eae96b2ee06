//! Reads a block with its results, so that it can be shown.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::{Value, json};

use super::block_error::BlockViewError;
use super::characters::{CharacterView, shown_record};
use super::page_layers::PageLayers;
use super::page_picture::DecodedPage;
use super::registered_face::{RegisteredFace, stored_block};
use crate::pair_pictures::PictureError;
use crate::scan_view::ScanView;
use mocban_catalog::{BlockDetail, Catalog, PairResults, StoredCharacter};
use mocban_core::InputLimits;
use mocban_core::domain::{BlockCharacterState, BlockName, PairName, ThresholdMetric};
use mocban_store::Project;

/// A block that is aligned with its page, and the results of its characters, as the catalog knows them. Its pictures are read
/// apart, because that takes longer.
#[derive(Debug)]
pub struct AlignedBlock {
    /// The user's id.
    pub name: BlockName,
    /// The characters that have a box.
    pub characters: Vec<CharacterView>,
    /// Fraction of the places of the face that agree with the page, 0..=1.
    pub agreement: f64,
    registered: RegisteredFace,
    page_path: String,
    pairs: Vec<Option<PairResults>>,
    metric: Option<ThresholdMetric>,
    limits: InputLimits,
    project: Project,
}

/// A block that is aligned with its page, its pictures, and the results of its characters.
#[derive(Debug)]
pub struct BlockView {
    /// The block with its characters.
    pub block: AlignedBlock,
    /// The page, and the relief in its frame.
    pub layers: PageLayers,
}

impl BlockView {
    /// Reads a block with the results of a metric, or of the default one if `metric` is `None`, and its pictures.
    ///
    /// # Errors
    /// Returns the errors of [`AlignedBlock::read`] and [`Self::of`].
    pub async fn read(
        catalog: &Catalog,
        project: &Project,
        name: &BlockName,
        metric: Option<ThresholdMetric>,
        limits: InputLimits,
    ) -> Result<Self, BlockViewError> {
        Self::of(AlignedBlock::read(catalog, project, name, metric, limits).await?).await
    }

    /// Reads the pictures of a block.
    ///
    /// # Errors
    /// Returns the errors of [`AlignedBlock::read_page`] and [`AlignedBlock::read_layers`].
    pub async fn of(block: AlignedBlock) -> Result<Self, BlockViewError> {
        let read = move || {
            let layers = block.read_layers(&block.read_page()?)?;
            Ok(Self { block, layers })
        };
        tokio::task::spawn_blocking(read).await?
    }
}

impl AlignedBlock {
    /// Reads a block with the results of a metric, or of the default one if `metric` is `None`. Reads only the catalog.
    ///
    /// # Errors
    /// Returns an error if the block is not aligned with its page, if no character has a result of the metric that was asked
    /// for, or if the catalog cannot be read.
    pub async fn read(
        catalog: &Catalog,
        project: &Project,
        name: &BlockName,
        metric: Option<ThresholdMetric>,
        limits: InputLimits,
    ) -> Result<Self, BlockViewError> {
        let detail = stored_block(catalog, name).await?;
        let registered = RegisteredFace::of(&detail)?.ok_or_else(|| not_aligned(name, &detail))?;
        let characters = catalog.block_characters(name).await?;
        let is_on_page = |one: &StoredCharacter| one.state != BlockCharacterState::Retired;
        let characters: Vec<StoredCharacter> = characters.into_iter().filter(is_on_page).collect();
        let pairs = pairs_of(catalog, name, &characters).await?;
        let has_metric = |metric| {
            pairs
                .iter()
                .flatten()
                .any(|pair| pair.metric(metric).is_some())
        };
        if let Some(metric) = metric.filter(|metric| !has_metric(*metric)) {
            let block = name.clone();
            return Err(BlockViewError::NoResult { block, metric });
        }
        let shown = characters.iter().zip(&pairs);
        let characters = shown
            .map(|(stored, pair)| CharacterView::new(stored, pair.as_ref(), metric))
            .collect();
        Ok(Self {
            name: name.clone(),
            characters,
            agreement: registered.agreement,
            registered,
            page_path: detail.state.attributes.page_path,
            pairs,
            metric,
            limits,
            project: project.clone(),
        })
    }

    /// Returns whether the files of the pictures are there, in folders of this computer. Does not read them.
    pub fn has_files(&self) -> bool {
        let page = self.project.input(&self.page_path);
        page.path().is_file() && self.registered.has_height_file(&self.project)
    }

    /// Reads the image of the page. Waits for the disk.
    ///
    /// # Errors
    /// Returns an error if the page cannot be read or is not the one that was aligned.
    pub fn read_page(&self) -> Result<DecodedPage, BlockViewError> {
        let (path, aligned) = (&self.page_path, self.registered.page_hash);
        DecodedPage::read(&self.project, path, aligned, &self.limits.image)
    }

    /// Finds the ink of the page and reads the heights of the face. Waits for the disk. A page gives its ink once; later calls
    /// decode it again.
    ///
    /// # Errors
    /// Returns an error if the page has no ink, or if the heights cannot be read.
    pub fn read_layers(&self, page: &DecodedPage) -> Result<PageLayers, BlockViewError> {
        let ink = if let Some(ink) = page.take_ink() {
            ink?
        } else {
            let (path, aligned) = (&self.page_path, self.registered.page_hash);
            DecodedPage::read_ink(&self.project, path, aligned, &self.limits.image)?
        };
        Ok(PageLayers {
            page: Arc::clone(&page.picture),
            ink,
            face: self.registered.read_face(&self.project)?,
            map: self.registered.map()?,
        })
    }

    /// Returns what the page in the browser shows: the size of the page in pixels and the characters, as JSON.
    pub fn to_json(&self, page_size: [usize; 2]) -> Value {
        json!({
            "block": self.name,
            "page_size": page_size,
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

/// Returns the pair of each character with its results; `None` for characters without a pair in the queue.
async fn pairs_of(
    catalog: &Catalog,
    block: &BlockName,
    characters: &[StoredCharacter],
) -> Result<Vec<Option<PairResults>>, BlockViewError> {
    let name = |one: &StoredCharacter| PairName::new(one.pair.as_deref()?).ok();
    let names = characters.iter().map(name);
    let found = catalog.pairs_of_block(block).await?.into_iter();
    let mut by_name: BTreeMap<PairName, PairResults> = found
        .map(|pair| (pair.attributes.name.clone(), pair))
        .collect();
    Ok(names.map(|name| by_name.remove(&name?)).collect())
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
