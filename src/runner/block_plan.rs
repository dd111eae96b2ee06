//! Requeues blocks at the start of a run.

use super::block_inputs;
use super::block_stages::{BlockStages, block_settings};
use super::error::RunError;
use super::input_reads::ReadLimits;
use super::options::RunOptions;
use super::policy;
use crate::catalog::Catalog;
use crate::domain::UnixMillis;
use crate::store::Project;

/// Stores which input files of blocks changed, requeues blocks to run again, and ends back-offs that are due.
///
/// # Errors
/// Returns an error if a database operation fails.
pub(super) async fn requeue(
    project: &Project,
    catalog: &Catalog,
    stages: &dyn BlockStages,
    options: &RunOptions,
    limits: &ReadLimits,
    now: UnixMillis,
) -> Result<(), RunError> {
    block_inputs::store_changes(project, catalog, limits).await?;
    let (settings, policy) = (block_settings(stages), options.rerun);
    let requeued = catalog
        .retry_while_unavailable(async || catalog.requeue_stale_blocks(&settings, policy).await);
    requeued.await?;
    let longest = policy::longest_backoff_ms();
    let ended =
        catalog.retry_while_unavailable(async || catalog.release_due_blocks(now, longest).await);
    ended.await?;
    Ok(())
}
