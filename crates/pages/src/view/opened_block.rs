//! Reads a block for its pages.

use std::sync::Arc;

use axum::Router;

use super::block_access::BlockAccess;
use super::block_page::block_page;
use super::shown_block::ShownBlock;
use crate::review::Language;
use mocban_catalog::Catalog;
use mocban_core::InputLimits;
use mocban_core::domain::{BlockName, BlockStage, FailureClass, ThresholdMetric};
use mocban_export::block_view::{AlignedBlock, BlockView};
use mocban_project::ProjectResult;
use mocban_store::Project;

/// The pages of a block.
#[derive(Debug)]
pub struct OpenedBlock {
    /// The routes. If the page of the block was refused, only its correction is shown.
    pub pages: Router,
    /// Why the page was refused, if it was.
    pub refused: Option<String>,
}

/// When the files of the pictures of a block are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureReading {
    /// Before the page is shown, so that errors are known.
    First,
    /// While the page is shown, which says what cannot be read. If a file is missing or in an object store, like [`Self::First`].
    Meanwhile,
}

/// Reads a block with the results of a metric, or of the default one, and returns its pages. A language in the address of a page,
/// as in `?lang=vi`, is preferred to `language`; without both, the browser decides.
///
/// # Errors
/// Returns an error if the block is not aligned and was not refused, or if the catalog or a file cannot be read.
pub async fn open_block(
    catalog: &Catalog,
    project: &Project,
    (name, metric): (&BlockName, Option<ThresholdMetric>),
    limits: InputLimits,
    store: BlockAccess,
    language: Option<Language>,
    reading: PictureReading,
) -> ProjectResult<OpenedBlock> {
    let read = AlignedBlock::read(catalog, project, name, metric, limits).await;
    let (view, refused) = match read {
        Ok(block) => (Some(shown(block, &store, reading).await?), None),
        Err(error) => match refusal(catalog, name).await? {
            Some(why) => (None, Some(why)),
            None => return Err(error.into()),
        },
    };
    Ok(OpenedBlock {
        pages: block_page(name, view, store, language),
        refused,
    })
}

/// Reads the pictures of a block, or begins to.
async fn shown(
    block: AlignedBlock,
    store: &BlockAccess,
    reading: PictureReading,
) -> ProjectResult<Arc<ShownBlock>> {
    let (dir, work) = (store.location.dir.clone(), store.work());
    if reading == PictureReading::Meanwhile && block.has_files() {
        return Ok(ShownBlock::begin(block, dir, work));
    }
    Ok(ShownBlock::of(BlockView::of(block).await?, dir, work))
}

/// Returns why the page of a block was refused, if it was.
async fn refusal(catalog: &Catalog, name: &BlockName) -> ProjectResult<Option<String>> {
    let detail = catalog.block(name).await?;
    let failure = detail.and_then(|detail| detail.state.failure);
    let refused = failure.filter(|stored| {
        stored.stage == BlockStage::Align && stored.failure.class == FailureClass::NoSolution
    });
    Ok(refused.map(|stored| stored.failure.message))
}
