//! Reads a block for its pages.

use axum::Router;

use super::block_access::BlockAccess;
use super::block_page::block_page;
use crate::review::Language;
use mocban_catalog::Catalog;
use mocban_core::InputLimits;
use mocban_core::domain::{BlockName, BlockStage, FailureClass, ThresholdMetric};
use mocban_export::block_view::BlockView;
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

/// Reads a block with the results of a metric, or of the default one, and returns its pages. A language in the address of a page,
/// as in `?lang=vi`, is preferred to `language`; without both, the browser decides.
///
/// # Errors
/// Returns an error if the block is not aligned and was not refused, or if the catalog or a file cannot be read.
pub async fn open_block(
    catalog: &Catalog,
    project: &Project,
    name: &BlockName,
    metric: Option<ThresholdMetric>,
    limits: InputLimits,
    store: BlockAccess,
    language: Option<Language>,
) -> ProjectResult<OpenedBlock> {
    let read = BlockView::read(catalog, project, name, metric, limits).await;
    let (view, refused) = match read {
        Ok(view) => (Some(view), None),
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

/// Returns why the page of a block was refused, if it was.
async fn refusal(catalog: &Catalog, name: &BlockName) -> ProjectResult<Option<String>> {
    let detail = catalog.block(name).await?;
    let failure = detail.and_then(|detail| detail.state.failure);
    let refused = failure.filter(|stored| {
        stored.stage == BlockStage::Align && stored.failure.class == FailureClass::NoSolution
    });
    Ok(refused.map(|stored| stored.failure.message))
}
