//! Sends damaged pairs and blocks back to their first damaged stage.

use super::summary::CheckSummary;
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::{BlockId, BlockStage, PairId, Stage};

/// Number of pairs that are sent back in one transaction.
const PAGE: usize = 500;

/// The damaged pairs and blocks that a repair sends back, each with its first damaged stage. All are known before the
/// first one is sent back, because their number decides whether a repair is plausible.
#[derive(Debug, Default)]
pub(super) struct DamagedJobs {
    pub(super) pairs: Vec<(PairId, Stage)>,
    pub(super) blocks: Vec<(BlockId, BlockStage)>,
}

/// Sends damaged pairs and blocks back, so that the next run computes their results again. Returns `false`, and changes
/// nothing, if most result files are missing and the caller does not accept that.
pub(super) async fn repair_jobs(
    catalog: &Catalog,
    accept_missing: bool,
    back: DamagedJobs,
    summary: &mut CheckSummary,
) -> Result<bool, CatalogError> {
    let DamagedJobs { pairs, blocks } = back;
    if pairs.is_empty() && blocks.is_empty() {
        return Ok(true);
    }
    if summary.lacks_most_files() && !accept_missing {
        summary.repaired.withheld = true;
        return Ok(false);
    }
    summary.repaired.requeued += pairs.len() as u64;
    summary.repaired.requeued_blocks += blocks.len() as u64;
    for page in pairs.chunks(PAGE) {
        catalog.restore(page.to_vec()).await?;
    }
    if !blocks.is_empty() {
        catalog.reset_blocks(blocks).await?;
    }
    summary.mark_repairable();
    Ok(true)
}
