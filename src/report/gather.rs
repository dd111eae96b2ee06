//! From the catalog to a report, page by page.

use rayon::prelude::*;

use super::aligned::{Aligned, AlignedError, same_alignment};
use super::by_hand;
use super::controls;
use super::model::Report;
use super::tally::{Tally, TruthFinding};
use super::truth::{TruthError, TruthErrors, TruthRecord, tops_iou};
use crate::catalog::{Catalog, CatalogError, MetricRecord, PairResults};
use crate::domain::MetricOutcome;
use crate::raster::{self, DepthMap, Grid};
use crate::store::Project;

/// Pairs in memory at a time.
pub const PAGE: usize = 256;

/// Why no report can be made.
#[derive(Debug, thiserror::Error)]
pub enum GatherError {
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// A result that has an alignment by hand cannot be read.
    #[error(transparent)]
    Aligned(#[from] AlignedError),
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
    Aligned(#[from] AlignedError),
}

/// The report of a project as its catalog stands.
///
/// Memory stays the same whatever the number of pairs, but for a few numbers a pair and metric.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn gather(catalog: &Catalog, project: &Project) -> Result<Report, GatherError> {
    gather_with(catalog, project, |_, _| {}).await
}

/// The same; every pair is shown to `see` on the way, with what its truth says.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn gather_with(
    catalog: &Catalog,
    project: &Project,
    mut see: impl FnMut(&PairResults, &TruthFinding),
) -> Result<Report, GatherError> {
    let mut tally = Tally::default();
    tally.caught(controls::caught(catalog).await?);
    let laid = catalog.newest_hand_alignments().await?;
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        for (pair, truth) in with_truth(project, page).await? {
            tally.add(&pair, &truth);
            see(&pair, &truth);
            if let Some(laid) = laid.get(&pair.facts.name) {
                tally.add_by_hand(&by_hand::errors(project, &pair, laid)?);
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
) -> Result<Vec<(PairResults, TruthFinding)>, tokio::task::JoinError> {
    if pairs.iter().all(|pair| pair.truth.is_none()) {
        let none = |pair| (pair, TruthFinding::default());
        return Ok(pairs.into_iter().map(none).collect());
    }
    let project = project.clone();
    tokio::task::spawn_blocking(move || {
        let found: Vec<TruthFinding> = pairs
            .par_iter()
            .map(|pair| finding(&project, pair))
            .collect();
        pairs.into_iter().zip(found).collect()
    })
    .await
}

/// What the truth says of a pair; nothing where there is no truth or no result.
pub fn finding(project: &Project, pair: &PairResults) -> TruthFinding {
    let Some(truth) = pair.truth.as_ref().filter(|_| !pair.metrics.is_empty()) else {
        return TruthFinding::default();
    };
    match measure(project, pair, truth) {
        Ok(finding) => finding,
        Err(unusable) => TruthFinding {
            problem: Some(unusable.to_string()),
            ..TruthFinding::default()
        },
    }
}

fn measure(
    project: &Project,
    pair: &PairResults,
    truth: &serde_json::Value,
) -> Result<TruthFinding, Unusable> {
    let (record, aligned) = (TruthRecord::read(truth)?, Aligned::new(project, pair));
    let tops = match &record.tops_mask {
        Some(path) => Some(Tops::read(project, path, &aligned)?),
        None => None,
    };
    let mut finding = TruthFinding::default();
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
    aligned: &Aligned<'_>,
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
    fn read(project: &Project, path: &str, aligned: &Aligned<'_>) -> Result<Self, Unusable> {
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
