//! Builds the report of a project from its catalog, page by page.

use super::accumulate::ReportAccumulator;
use super::block_accuracy::BlockSums;
use super::model::{BlockCounts, Report};
use super::report_error::ReportError;
use mocban_catalog::{Catalog, PairResults, SetApart};
use mocban_results::attention_checks;
use mocban_results::manual_alignment;
use mocban_results::{TruthEvaluation, evaluate_pairs};
use mocban_store::Project;

/// Pairs in memory at a time.
const PAIRS_PER_PAGE: usize = 256;

/// Builds the report of a project from the current state of its catalog.
///
/// Memory grows by a few numbers per pair and metric.
///
/// # Errors
/// Returns an error if the catalog or the results of a manually aligned pair cannot be read, or if the evaluation
/// panics.
pub async fn build(catalog: &Catalog, project: &Project) -> Result<Report, ReportError> {
    build_with(catalog, project, |_, _| {}).await
}

/// Builds the report, and calls `visit` for every pair with its evaluation against ground truth.
///
/// # Errors
/// Returns an error if the catalog or the results of a manually aligned pair cannot be read, or if the evaluation
/// panics.
pub async fn build_with(
    catalog: &Catalog,
    project: &Project,
    mut visit: impl FnMut(&PairResults, &TruthEvaluation),
) -> Result<Report, ReportError> {
    let (catalog, damaged) = catalog.without_faulty_rows().await?;
    let mut report = ReportAccumulator::default();
    report.set_attention_checks(attention_checks::project_rates(&catalog).await?);
    let states = catalog.block_states().await?;
    report.set_block_progress(BlockCounts::of(states.iter().map(|block| block.status)));
    report.set_retired(catalog.retired_count().await?);
    let mut blocks = BlockSums::of_true_boxes(&catalog).await?;
    let manual_alignments = catalog.newest_manual_alignments().await?;
    let mut pages = catalog.result_pages(PAIRS_PER_PAGE);
    while let Some(page) = pages.next().await? {
        for (pair, truth) in evaluate_pairs(project, page).await? {
            report.add(&pair, &truth);
            blocks.add(&pair, &truth);
            visit(&pair, &truth);
            if let Some(manual) = manual_alignments.get(&pair.attributes.name) {
                report.add_manual_errors(&manual_alignment::errors(project, &pair, manual)?);
            }
        }
    }
    let mut report = Report {
        blocks: blocks.finish(),
        set_apart: SetApart::of(&damaged),
        ..report.finish()
    };
    if let Some(sentence) = report.set_apart.sentence() {
        report.warnings.insert(0, (sentence + ".").into());
    }
    Ok(report)
}
