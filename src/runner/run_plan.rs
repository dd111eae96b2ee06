//! What a run would do, without doing it.

use super::block_inputs;
use super::block_pipeline::BlockPipeline;
use super::block_stages::block_settings;
use super::error::RunError;
use super::input_changes;
use super::options::RunOptions;
use super::run::{fingerprints, read_limits, selection};
use super::stop::Stop;
use crate::catalog::{BlockPlanEntry, Catalog, Plan};
use crate::stages::Settings;
use crate::store::Project;

/// What a run would do.
#[derive(Debug, Clone)]
pub struct RunPlan {
    /// The pairs. Pairs that are yet to be cut from blocks are not included.
    pub pairs: Plan,
    /// The blocks. Empty if only named pairs would run.
    pub blocks: Vec<BlockPlanEntry>,
}

/// Returns what `run` would do, for `--dry-run`. Stores in the catalog which input files have changed.
///
/// # Errors
/// Returns an error if a named pair does not exist, or the catalog or the files cannot be used.
pub async fn plan(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
) -> Result<RunPlan, RunError> {
    let selection = selection(catalog, options).await?;
    let limits = read_limits(options, &Stop::new());
    input_changes::store_changes(project, catalog, selection.as_ref(), &limits).await?;
    let names = options.pairs.as_deref();
    let pairs = catalog
        .plan(&fingerprints(settings), names, options.rerun)
        .await?;
    let mut blocks = Vec::new();
    if selection.is_none() {
        block_inputs::store_changes(project, catalog, &limits).await?;
        let settings = block_settings(&BlockPipeline::new(options));
        blocks = catalog.plan_blocks(&settings, options.rerun).await?;
    }
    Ok(RunPlan { pairs, blocks })
}
