//! What a run would do, without doing it.

use super::block::inputs;
use super::block::pipeline::BlockPipeline;
use super::block_stages::block_settings;
use super::error::RunError;
use super::input_changes;
use super::input_reads::read_limits;
use super::options::RunOptions;
use super::run::fingerprints;
use super::run_selection::RunSelection;
use super::stop::Stop;
use mocban_align::stages::Settings;
use mocban_catalog::{BlockPlanEntry, Catalog, Plan};
use mocban_store::Project;

/// What a run would do.
#[derive(Debug, Clone)]
pub struct RunPlan {
    /// The pairs. Pairs that are yet to be cut from blocks are not included.
    pub pairs: Plan,
    /// The blocks.
    pub blocks: Vec<BlockPlanEntry>,
}

/// Returns whether a run would compute pairs with another method than before, and so replace their results.
///
/// # Errors
/// Returns an error if a named pair or block does not exist, or the catalog cannot be read.
pub async fn changes_method(
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
) -> Result<bool, RunError> {
    let selection = RunSelection::of(catalog, options.only.as_ref()).await?;
    let pairs = selection.as_ref().map(|selection| &selection.pairs);
    let planned = catalog
        .plan(&fingerprints(settings), pairs, options.rerun)
        .await?;
    Ok(planned.changes_method())
}

/// Returns the blocks that a run would work on by what the catalog knows, without a look at their files.
///
/// # Errors
/// Returns an error if the catalog cannot be read.
pub async fn planned_blocks(
    catalog: &Catalog,
    options: &RunOptions,
) -> Result<Vec<BlockPlanEntry>, RunError> {
    let settings = block_settings(&BlockPipeline::new(options));
    Ok(catalog.plan_blocks(&settings, options.rerun, None).await?)
}

/// Returns what `run` would do, for `--dry-run`. Stores in the catalog which input files have changed. A read-only catalog
/// cannot take this, so the plan is then one without these changes.
///
/// # Errors
/// Returns an error if a named pair or block does not exist, or the catalog or the files cannot be used.
pub async fn plan(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
) -> Result<RunPlan, RunError> {
    let selection = RunSelection::of(catalog, options.only.as_ref()).await?;
    let pairs = selection.as_ref().map(|selection| &selection.pairs);
    let blocks = selection.as_ref().map(|selection| &selection.blocks);
    let limits = read_limits(options, &Stop::new());
    if !catalog.is_read_only() {
        input_changes::store_changes(project, catalog, pairs, &limits).await?;
    }
    let planned = catalog
        .plan(&fingerprints(settings), pairs, options.rerun)
        .await?;
    if !catalog.is_read_only() {
        inputs::store_changes(project, catalog, blocks, &limits).await?;
    }
    let settings = block_settings(&BlockPipeline::new(options));
    let blocks = catalog.plan_blocks(&settings, options.rerun, blocks);
    Ok(RunPlan {
        pairs: planned,
        blocks: blocks.await?,
    })
}
