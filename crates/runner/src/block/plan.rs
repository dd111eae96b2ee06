//! Requeues blocks at the start of a run.

use super::inputs;
use crate::block_stages::{BlockStages, block_settings};
use crate::error::RunError;
use crate::input_reads::ReadLimits;
use crate::policy;
use crate::retry::retried;
use mocban_catalog::{BlockSelection, Catalog, RerunPolicy};
use mocban_core::domain::UnixMillis;
use mocban_store::Project;

/// Stores which input files of blocks changed, requeues blocks to run again, of all or of those in `selection`, and ends
/// back-offs that are due.
pub(crate) async fn requeue(
    project: &Project,
    catalog: &Catalog,
    stages: &dyn BlockStages,
    (policy, selection): (RerunPolicy, Option<&BlockSelection>),
    limits: &ReadLimits,
    now: UnixMillis,
) -> Result<(), RunError> {
    inputs::store_changes(project, catalog, selection, limits).await?;
    let settings = block_settings(stages);
    retried!(catalog.requeue_stale_blocks(&settings, policy, selection))?;
    let longest = policy::longest_backoff_ms();
    retried!(catalog.release_due_blocks(now, longest))?;
    Ok(())
}
