//! The contact sheet of a project: one image with many pairs, in a given order.

use rayon::prelude::*;

use super::pictures::{ContactSheetCell, Rgb, contact_sheet, tile_side};
use super::source_print::result_images;
use crate::catalog::{Catalog, CatalogError, PairResults};
use crate::domain::{JobStatus, PairName, ThresholdMetric, enum_names};
use crate::raster::ImageLimits;
use crate::report::ground_truth::TruthErrors;
use crate::report::{Consensus, evaluate_pairs};
use crate::store::Project;

/// Pairs in memory at a time while the worst are selected.
const PAGE: usize = 256;

/// The order of pairs on a contact sheet. In every order but `Name`, pairs without a result come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactSheetOrder {
    /// Pairs with ground truth first, by largest error. Then the other pairs, by lowest `IoU`.
    Worst,
    /// Lowest `IoU` on the canvas.
    Score,
    /// Smallest margin over the second-best pose.
    Margin,
    /// Least confident; results without a confidence last.
    Confidence,
    /// By name.
    Name,
}

enum_names! {
    pub ContactSheetOrder, "an order":
    Worst = "worst", Score = "score", Margin = "margin", Confidence = "confidence", Name = "name",
}

/// What to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSheetOptions {
    /// The metric whose results are drawn.
    pub metric: ThresholdMetric,
    /// Only these pairs; all when `None`.
    pub pairs: Option<Vec<PairName>>,
    /// The order of the pairs.
    pub order: ContactSheetOrder,
    /// Most pairs on the sheet.
    pub limit: usize,
    /// Pairs in a row, 1 to 12.
    pub columns: usize,
    /// Limits on the print images.
    pub limits: ImageLimits,
}

/// A contact sheet, and how much of the project it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSheet {
    /// The image.
    pub picture: Rgb,
    /// Pairs on it.
    pub shown: usize,
    /// Pairs that are finished or failed, of those asked for.
    pub of: usize,
    /// Pairs on it whose images or ground truth cannot be read, and why.
    pub problems: Vec<(PairName, String)>,
}

/// Why images cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// The catalog cannot be read.
    #[error("{0}")]
    Catalog(#[from] CatalogError),
    /// A worker task panicked or was cancelled.
    #[error("drawing stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// A pair that may be drawn.
struct SheetCandidate {
    /// Sort key, lowest first.
    rank: f64,
    pair: PairResults,
    truth: Option<TruthErrors>,
    /// Why ground truth exists and cannot be used.
    truth_problem: Option<String>,
}

/// Draws the contact sheet of a project. Unfinished pairs are left out.
///
/// An image that cannot be drawn is left blank. If a pair's print or depth map cannot be read, its cell states why.
///
/// # Errors
/// Returns an error if the catalog cannot be read, or a worker task panics.
pub async fn draw_contact_sheet(
    catalog: &Catalog,
    project: &Project,
    options: ContactSheetOptions,
) -> Result<ContactSheet, DrawError> {
    let (chosen, of) = choose(catalog, project, &options).await?;
    let project = project.clone();
    let picture = move || {
        let draw = |candidate| cell(&project, candidate, &options);
        let drawn: Vec<(ContactSheetCell, Option<String>)> = chosen.par_iter().map(draw).collect();
        let (cells, problems): (Vec<_>, Vec<_>) = drawn.into_iter().unzip();
        let problems = (chosen.iter().zip(problems))
            .filter_map(|(candidate, problem)| {
                let name = candidate.pair.attributes.name.clone();
                Some((name, problem.or_else(|| candidate.truth_problem.clone())?))
            })
            .collect();
        ContactSheet {
            picture: contact_sheet(&cells, options.columns),
            shown: cells.len(),
            of,
            problems,
        }
    };
    Ok(tokio::task::spawn_blocking(picture).await?)
}

/// Returns the pairs to draw, in order, and the number of candidates.
async fn choose(
    catalog: &Catalog,
    project: &Project,
    options: &ContactSheetOptions,
) -> Result<(Vec<SheetCandidate>, usize), DrawError> {
    catalog.verify_checksums().await?;
    let (mut chosen, mut of) = (Vec::new(), 0);
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        let wanted = page.into_iter().filter(|pair| is_shown(options, pair));
        for (pair, truth) in evaluate_pairs(project, wanted.collect()).await? {
            of += 1;
            let truth_problem = truth.problem;
            let truth = truth.errors.get(&options.metric).copied();
            let rank = rank(&pair, truth.as_ref(), options);
            chosen.push(SheetCandidate {
                rank,
                pair,
                truth,
                truth_problem,
            });
        }
        // Pairs are read in the order of their names, and the sort is stable. Pairs of equal rank stay sorted by name.
        chosen.sort_by(|a, b| a.rank.total_cmp(&b.rank));
        chosen.truncate(options.limit);
    }
    Ok((chosen, of))
}

/// Returns whether a pair was requested and has something to show.
fn is_shown(options: &ContactSheetOptions, pair: &PairResults) -> bool {
    let is_requested = |names: &Vec<PairName>| names.contains(&pair.attributes.name);
    options.pairs.as_ref().is_none_or(is_requested)
        && (pair.status == JobStatus::Quarantined || pair.metric(options.metric).is_some())
}

/// Returns the sort key of a pair, lowest first.
fn rank(pair: &PairResults, truth: Option<&TruthErrors>, options: &ContactSheetOptions) -> f64 {
    let outcome = pair.metric(options.metric).map(|record| record.outcome);
    match (options.order, outcome) {
        (ContactSheetOrder::Name, _) => 0.0,
        (_, None) => f64::NEG_INFINITY,
        (ContactSheetOrder::Worst, Some(found)) => {
            truth.map_or(found.scores.iou, |errors| -errors.severity())
        }
        (ContactSheetOrder::Score, Some(found)) => found.scores.iou,
        (ContactSheetOrder::Margin, Some(found)) => found.margin,
        (ContactSheetOrder::Confidence, Some(found)) => found.confidence.unwrap_or(f64::INFINITY),
    }
}

/// Draws the cell of a pair. Also returns the reason if the images of its result cannot be drawn.
fn cell(
    project: &Project,
    candidate: &SheetCandidate,
    options: &ContactSheetOptions,
) -> (ContactSheetCell, Option<String>) {
    let pair = &candidate.pair;
    let consensus = pair.metric(options.metric).map(Consensus::of);
    let off_truth = candidate.truth.is_some_and(|errors| !errors.pass());
    let side = tile_side(options.columns);
    let (tiles, problem) = result_images(project, pair, options.metric, side, &options.limits);
    let cell = ContactSheetCell {
        id: title(pair, options.metric),
        note: (problem.clone()).unwrap_or_else(|| note(candidate, options.metric)),
        wrong: off_truth || consensus.is_none_or(|consensus| consensus == Consensus::Failed),
        tiles,
    };
    (cell, problem)
}

/// Returns the id of a pair, with its confidence and its verdict if they exist.
fn title(pair: &PairResults, metric: ThresholdMetric) -> String {
    let mut title = pair.attributes.name.to_string();
    if let Some(record) = pair.metric(metric) {
        let confidence = record.outcome.confidence;
        title.extend(confidence.map(|confidence| format!("  conf {confidence:.2}")));
        let verdict = Consensus::of(record).verdict();
        title.extend(verdict.map(|verdict| format!("  {verdict}")));
    }
    title
}

/// Returns scores and errors of a pair, or why it failed.
fn note(candidate: &SheetCandidate, metric: ThresholdMetric) -> String {
    let pair = &candidate.pair;
    match (pair.metric(metric), &candidate.truth, &pair.failure) {
        (Some(record), Some(errors), _) => {
            let (iou, tops) = (record.outcome.scores.iou, errors.mask_iou);
            let tops = tops.map_or(String::new(), |tops| format!(" tops {tops:.2}"));
            let [angle, landmarks] = [errors.angle_deg, errors.tre_pct].map(short);
            format!("IoU {iou:.2}  {angle}\u{b0} {landmarks}%{tops}")
        }
        (Some(record), None, _) => format!(
            "IoU {:.2}  margin {:.2}",
            record.outcome.scores.iou, record.outcome.margin
        ),
        (None, _, Some(stored)) => format!("{}: {}", stored.failure.class, stored.failure.message),
        (None, _, None) => String::new(),
    }
}

/// Formats with one decimal below 10 and none above.
fn short(value: f64) -> String {
    if value < 9.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::{ContactSheetOptions, ContactSheetOrder, is_shown, rank, title};
    use crate::domain::{FailureClass, PairName, ThresholdMetric, Verdict};
    use crate::raster::ImageLimits;
    use crate::report::test_fixtures;

    fn options(order: ContactSheetOrder) -> ContactSheetOptions {
        ContactSheetOptions {
            metric: ThresholdMetric::Ensemble,
            pairs: None,
            order,
            limit: 50,
            columns: 5,
            limits: ImageLimits::SUGGESTED,
        }
    }

    #[test]
    fn failed_pairs_come_first_and_the_better_score_last() {
        let (good, poor) = (
            test_fixtures::done("a", 0.9, &[]),
            test_fixtures::done("b", 0.4, &[]),
        );
        let failed = test_fixtures::failed("c", FailureClass::BadInput, "c.stl is empty");
        for order in [ContactSheetOrder::Worst, ContactSheetOrder::Score] {
            let rank = |pair| rank(pair, None, &options(order));
            assert!(
                rank(&failed) < rank(&poor) && rank(&poor) < rank(&good),
                "{order}"
            );
        }
        assert_eq!(rank(&failed, None, &options(ContactSheetOrder::Name)), 0.0);
    }

    #[test]
    fn the_least_confident_come_first_and_the_unknown_last() {
        let order = options(ContactSheetOrder::Confidence);
        let (low, high) = (
            test_fixtures::with_confidence("b", 0.2),
            test_fixtures::with_confidence("a", 0.9),
        );
        let rank = |pair| rank(pair, None, &order);
        assert!(rank(&low) < rank(&high));
        assert!(rank(&high) < rank(&test_fixtures::done("c", 0.1, &[])));
        assert_eq!(title(&low, order.metric), "b  conf 0.20");
        let judged = test_fixtures::done("c", 0.1, &[Verdict::Fail]);
        assert_eq!(title(&judged, order.metric), "c  fail");
    }

    #[test]
    fn ground_truth_outweighs_the_score_in_worst() {
        let (near, far) = (
            test_fixtures::truth(1.0, 1.0, 0.9),
            test_fixtures::truth(90.0, 30.0, 0.1),
        );
        let metric = ThresholdMetric::Ensemble;
        let worst = options(ContactSheetOrder::Worst);
        let (good, poor) = (
            test_fixtures::done("a", 0.9, &[]),
            test_fixtures::done("b", 0.4, &[]),
        );
        let wrong = rank(&good, far.errors.get(&metric), &worst);
        assert!(wrong < rank(&poor, near.errors.get(&metric), &worst));
    }

    #[test]
    fn unfinished_and_unrequested_pairs_are_not_shown() {
        let mut requested = options(ContactSheetOrder::Name);
        assert!(!is_shown(&requested, &test_fixtures::pending("a")));
        assert!(is_shown(&requested, &test_fixtures::done("a", 0.9, &[])));
        requested.pairs = Some(vec![PairName::new("b").expect("an id")]);
        assert!(!is_shown(&requested, &test_fixtures::done("a", 0.9, &[])));
    }

    #[test]
    fn every_order_is_found_by_its_name() {
        for order in ContactSheetOrder::ALL {
            assert_eq!(order.name().parse(), Ok(order));
        }
    }
}
