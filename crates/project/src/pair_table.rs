//! A table of pairs: one line each with state, alignment, confidence and verdict.

use serde::Serialize;

use crate::error::ProjectResult;
use mocban_catalog::{Catalog, MetricRecord, PairResults};
use mocban_core::domain::{JobStatus, PairName, Stage, ThresholdMetric, Verdict};
use mocban_results::Consensus;

/// Pairs that are read at once.
const PAGE: usize = 1000;

/// The pairs of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairChoice {
    /// All pairs, by id.
    All,
    /// Pairs whose result of the default metric has a low confidence, the least confident first.
    LowConfidence,
}

/// A line of the table. Numbers belong to the default metric, or to the first one that the pair has.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairRow {
    /// The pair.
    pub id: PairName,
    /// Its character.
    pub character: Option<String>,
    /// Its block.
    pub block: Option<String>,
    /// State of its job.
    pub status: JobStatus,
    /// The stage at which it failed or that it waits for.
    pub stage: Option<Stage>,
    /// The metric of the numbers.
    pub metric: Option<ThresholdMetric>,
    /// Rotation of the depth map onto the print.
    pub angle_deg: Option<f64>,
    /// Print pixels per depth-map pixel.
    pub scale: Option<f64>,
    /// Intersection over union of the canvas masks.
    pub iou: Option<f64>,
    /// Probability that the alignment is right.
    pub confidence: Option<f64>,
    /// Consensus of the reviewers on the result.
    pub verdict: Option<Verdict>,
}

impl PairRow {
    fn of(pair: &PairResults, record: Option<&MetricRecord>) -> Self {
        let attributes = &pair.attributes;
        let outcome = record.map(|record| &record.outcome);
        Self {
            id: attributes.name.clone(),
            character: attributes.character.clone(),
            block: attributes.block.clone(),
            status: pair.status,
            stage: pair.next_stage,
            metric: outcome.map(|outcome| outcome.metric),
            angle_deg: outcome.map(|outcome| outcome.angle_deg),
            scale: outcome.map(|outcome| outcome.scale),
            iou: outcome.map(|outcome| outcome.scores.iou),
            confidence: outcome.and_then(|outcome| outcome.confidence),
            verdict: record.and_then(|record| Consensus::of(record).verdict()),
        }
    }
}

/// Reads the lines of a table.
pub async fn read(catalog: &Catalog, choice: PairChoice) -> ProjectResult<Vec<PairRow>> {
    let mut rows = Vec::new();
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        rows.extend(page.iter().filter_map(|pair| row(pair, choice)));
    }
    if choice == PairChoice::LowConfidence {
        let confidence = |row: &PairRow| row.confidence.unwrap_or(0.0);
        rows.sort_by(|a, b| confidence(a).total_cmp(&confidence(b)));
    }
    Ok(rows)
}

/// Reads the lines of the pairs that a list assigns to a block, by id.
pub(crate) async fn of_listed_block(catalog: &Catalog, block: &str) -> ProjectResult<Vec<PairRow>> {
    let pairs = catalog.results_of_listed_block(block).await?;
    let rows = pairs.iter().filter_map(|pair| row(pair, PairChoice::All));
    Ok(rows.collect())
}

/// Returns the line of a pair, if it is chosen. Low confidence means the same as in `status`.
fn row(pair: &PairResults, choice: PairChoice) -> Option<PairRow> {
    let default = pair.metric(ThresholdMetric::DEFAULT);
    let record = match choice {
        PairChoice::All => default.or_else(|| pair.metrics.first()),
        PairChoice::LowConfidence => {
            let low = default.filter(|record| record.outcome.is_low_confidence());
            Some(low.filter(|_| pair.status == JobStatus::Done)?)
        }
    };
    Some(PairRow::of(pair, record))
}
