//! From the catalog to a report, page by page.

use rayon::prelude::*;

use super::accumulate::{ReportAccumulator, TruthEvaluation};
use super::attention_checks;
use super::ground_truth::{TruthError, TruthErrors, TruthRecord, tops_iou};
use super::manual_alignment;
use super::model::Report;
use super::pair_artifacts::{PairArtifacts, PairArtifactsError, same_alignment};
use crate::catalog::{Catalog, CatalogError, MetricRecord, PairResults};
use crate::domain::MetricOutcome;
use crate::raster::{self, DepthMap, Grid};
use crate::store::Project;

/// Pairs in memory at a time.
pub const PAGE: usize = 256;

/// Why no report can be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// A result that has an alignment by hand cannot be read.
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
    /// A thread of the comparison with truth was lost.
    #[error("comparing with the truth stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// Why a pair cannot be held against its truth.
#[derive(Debug, thiserror::Error)]
enum Unusable {
    #[error(transparent)]
    Truth(#[from] TruthError),
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
}

/// The report of a project as its catalog stands.
///
/// Memory stays the same whatever the number of pairs, but for a few numbers a pair and metric.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn build(catalog: &Catalog, project: &Project) -> Result<Report, ReportError> {
    build_with(catalog, project, |_, _| {}).await
}

/// The same; every pair is shown to `see` on the way, with what its truth says.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn build_with(
    catalog: &Catalog,
    project: &Project,
    mut see: impl FnMut(&PairResults, &TruthEvaluation),
) -> Result<Report, ReportError> {
    let mut tally = ReportAccumulator::default();
    tally.caught(attention_checks::caught(catalog).await?);
    let laid = catalog.newest_hand_alignments().await?;
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        for (pair, truth) in with_truth(project, page).await? {
            tally.add(&pair, &truth);
            see(&pair, &truth);
            if let Some(laid) = laid.get(&pair.attributes.name) {
                tally.add_by_hand(&manual_alignment::errors(project, &pair, laid)?);
            }
        }
    }
    Ok(tally.finish())
}

/// Pairs with what their truth says, on all cores.
///
/// # Errors
/// When a thread is lost.
pub async fn with_truth(
    project: &Project,
    pairs: Vec<PairResults>,
) -> Result<Vec<(PairResults, TruthEvaluation)>, tokio::task::JoinError> {
    if pairs.iter().all(|pair| pair.truth.is_none()) {
        let none = |pair| (pair, TruthEvaluation::default());
        return Ok(pairs.into_iter().map(none).collect());
    }
    let project = project.clone();
    tokio::task::spawn_blocking(move || {
        let found: Vec<TruthEvaluation> = pairs
            .par_iter()
            .map(|pair| finding(&project, pair))
            .collect();
        pairs.into_iter().zip(found).collect()
    })
    .await
}

/// What the truth says of a pair; nothing where there is no truth or no result.
pub fn finding(project: &Project, pair: &PairResults) -> TruthEvaluation {
    let Some(truth) = pair.truth.as_ref().filter(|_| !pair.metrics.is_empty()) else {
        return TruthEvaluation::default();
    };
    match measure(project, pair, truth) {
        Ok(finding) => finding,
        Err(unusable) => TruthEvaluation {
            problem: Some(unusable.to_string()),
            ..TruthEvaluation::default()
        },
    }
}

fn measure(
    project: &Project,
    pair: &PairResults,
    truth: &serde_json::Value,
) -> Result<TruthEvaluation, Unusable> {
    let (record, aligned) = (TruthRecord::read(truth)?, PairArtifacts::new(project, pair));
    let tops = match &record.tops_mask {
        Some(path) => Some(Tops::read(project, path, &aligned)?),
        None => None,
    };
    let mut finding = TruthEvaluation::default();
    let mut done: Vec<&MetricRecord> = Vec::new();
    for found in &pair.metrics {
        let outcome = &found.outcome;
        // Metrics that chose the same threshold have the same errors; the mask is warped once.
        let twin = done
            .iter()
            .find(|other| same_alignment(&other.outcome, outcome));
        let errors = match twin.and_then(|twin| finding.errors.get(&twin.outcome.metric)) {
            Some(errors) => *errors,
            None => errors(&record, &aligned, tops.as_ref(), outcome)?,
        };
        finding.errors.insert(outcome.metric, errors);
        done.push(found);
    }
    Ok(finding)
}

fn errors(
    record: &TruthRecord,
    aligned: &PairArtifacts<'_>,
    tops: Option<&Tops>,
    outcome: &MetricOutcome,
) -> Result<TruthErrors, Unusable> {
    let found = aligned.print_from_mesh(&outcome.print_from_depth)?;
    let iou = tops.map(|tops| tops_iou(&tops.depth, outcome, &tops.tops));
    Ok(record.measure(&found, iou)?)
}

/// The true stroke tops of a pair, and the depth map to hold against them.
struct Tops {
    tops: Grid<u8>,
    depth: DepthMap,
}

impl Tops {
    fn read(project: &Project, path: &str, aligned: &PairArtifacts<'_>) -> Result<Self, Unusable> {
        let print = aligned.print_mask()?;
        let tops = read_tops(project, path)?;
        let (found, wanted) = (
            [tops.width(), tops.height()],
            [print.width(), print.height()],
        );
        if found != wanted {
            return Err(TruthError::MaskSize { found, wanted }.into());
        }
        let depth = aligned.depth()?;
        Ok(Self { tops, depth })
    }
}

/// The grey values of a tops mask, whatever image format it is in.
fn read_tops(project: &Project, path: &str) -> Result<Grid<u8>, TruthError> {
    let path = project.input_path(path);
    let refused = |why: String| TruthError::Mask(format!("{}: {why}", path.display()));
    let bytes = std::fs::read(&path).map_err(|error| refused(error.to_string()))?;
    let picture = raster::decode(&bytes, &raster::ImageLimits::SUGGESTED)
        .map_err(|error| refused(error.to_string()))?;
    Ok(picture.rgb.map(|colour| (colour[0] / 257) as u8))
}
