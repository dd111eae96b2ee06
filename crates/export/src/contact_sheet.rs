//! The contact sheet of a project: one image with many pairs, in a given order.

use rayon::prelude::*;

use super::pictures::{
    ContactSheetCell, FrameKind, NOTE_SPACE, Rgb, SheetLegend, contact_sheet, tile_side,
};
use super::source_print::result_images;
use mocban_catalog::{Catalog, CatalogError, PairResults, SetApart};
use mocban_core::domain::{JobStatus, PairName, ThresholdMetric, enum_names, explained_by_cause};
use mocban_core::raster::ImageLimits;
use mocban_results::ground_truth::TruthErrors;
use mocban_results::number_format::NumberStyle::{Degrees, Percent, Score};
use mocban_results::number_format::{counted, format_count, format_number};
use mocban_results::{Consensus, evaluate_pairs};
use mocban_store::Project;

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

impl ContactSheetOrder {
    /// Returns its text in the legend.
    const fn title(self) -> &'static str {
        match self {
            Self::Worst => "worst first",
            Self::Score => "lowest IoU first",
            Self::Margin => "smallest margin first",
            Self::Confidence => "least confident first",
            Self::Name => "by name",
        }
    }
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

impl Default for ContactSheetOptions {
    fn default() -> Self {
        Self {
            metric: ThresholdMetric::DEFAULT,
            pairs: None,
            order: ContactSheetOrder::Worst,
            limit: 60,
            columns: 5,
            limits: ImageLimits::SUGGESTED,
        }
    }
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
    /// Damaged rows that it does not show.
    pub set_apart: SetApart,
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

explained_by_cause! { DrawError: Catalog }

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
pub async fn draw_contact_sheet(
    catalog: &Catalog,
    project: &Project,
    options: ContactSheetOptions,
) -> Result<ContactSheet, DrawError> {
    let (catalog, damaged) = catalog.without_faulty_rows().await?;
    let (chosen, of) = choose(&catalog, project, &options).await?;
    let project = project.clone();
    let picture = move || {
        let side = tile_side(options.columns, chosen.len());
        let draw = |candidate| cell(&project, candidate, &options, side);
        let drawn: Vec<(ContactSheetCell, Option<String>)> = chosen.par_iter().map(draw).collect();
        let (cells, problems): (Vec<_>, Vec<_>) = drawn.into_iter().unzip();
        let problems = (chosen.iter().zip(problems))
            .filter_map(|(candidate, problem)| {
                let name = candidate.pair.attributes.name.clone();
                Some((name, problem.or_else(|| candidate.truth_problem.clone())?))
            })
            .collect();
        ContactSheet {
            picture: contact_sheet(&cells, options.columns, &legend(&chosen, of, &options)),
            shown: cells.len(),
            of,
            problems,
            set_apart: SetApart::of(&damaged),
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

/// Returns the texts above the cells.
fn legend(chosen: &[SheetCandidate], of: usize, options: &ContactSheetOptions) -> SheetLegend {
    let shown = format_count(chosen.len() as u64);
    let (metric, pairs) = (options.metric.title(), counted(of as u64, "pair"));
    let numbers = if chosen.iter().any(|candidate| candidate.truth.is_some()) {
        "angle error, landmark error in % of the character's height, IoU with the true stroke tops"
    } else {
        "margin over the second-best pose"
    };
    SheetLegend {
        title: format!("{metric}: {shown} of {pairs}, {}", options.order.title()),
        explanation: format!(
            "Pictures: print, relief lit from the upper left, print with stroke edges of the relief in orange. \
             Numbers: IoU of the masks, {numbers}."
        ),
    }
}

/// Draws the cell of a pair with images of `side` pixels. Also returns the reason if the images of its result cannot be drawn.
fn cell(
    project: &Project,
    candidate: &SheetCandidate,
    options: &ContactSheetOptions,
    side: usize,
) -> (ContactSheetCell, Option<String>) {
    let pair = &candidate.pair;
    let consensus = pair.metric(options.metric).map(Consensus::of);
    let off_truth = candidate.truth.is_some_and(|errors| !errors.pass());
    let (tiles, problem) = result_images(project, pair, options.metric, side, &options.limits);
    let cell = ContactSheetCell {
        id: pair.attributes.name.to_string(),
        character: pair.attributes.character.clone(),
        state: state(pair, options.metric),
        note: (problem.clone()).unwrap_or_else(|| note(candidate, options.metric)),
        frame: frame(consensus, off_truth),
        tiles,
    };
    (cell, problem)
}

/// Returns what the frame of a result stands for. `None` is a pair without a result.
fn frame(consensus: Option<Consensus>, is_off_truth: bool) -> FrameKind {
    match consensus {
        None | Some(Consensus::Failed) => FrameKind::Wrong,
        Some(_) if is_off_truth => FrameKind::Wrong,
        Some(Consensus::Passed) => FrameKind::Passed,
        Some(_) => FrameKind::Other,
    }
}

/// Returns the confidence and the verdict of a result, as far as they exist.
fn state(pair: &PairResults, metric: ThresholdMetric) -> Vec<String> {
    let Some(record) = pair.metric(metric) else {
        return Vec::new();
    };
    let confidence = record.outcome.confidence;
    let confidence = confidence.map(|value| format!("conf. {}", format_number(value, Score)));
    let verdict = Consensus::of(record).verdict();
    let parts = [confidence, verdict.map(|verdict| verdict.to_string())];
    parts.into_iter().flatten().collect()
}

/// Returns scores and errors of a pair, or why it failed.
fn note(candidate: &SheetCandidate, metric: ThresholdMetric) -> String {
    let pair = &candidate.pair;
    let score = |value| format_number(value, Score);
    let Some(record) = pair.metric(metric) else {
        let failure = pair.failure.as_ref().map(|stored| &stored.failure);
        let text = failure.map(|failure| format!("{}: {}", failure.class, failure.message));
        return text.unwrap_or_default();
    };
    let outcome = &record.outcome;
    let mut numbers = vec![format!("IoU {}", score(outcome.scores.iou))];
    match &candidate.truth {
        Some(errors) => {
            numbers.push(format!(
                "{}\u{b0}",
                format_number(errors.angle_deg, Degrees)
            ));
            numbers.push(format!("{} %", format_number(errors.tre_pct, Percent)));
            numbers.extend(errors.mask_iou.map(|tops| format!("tops {}", score(tops))));
        }
        None => numbers.push(format!("margin {}", score(outcome.margin))),
    }
    numbers.join(NOTE_SPACE)
}

#[cfg(test)]
mod tests {
    use super::{ContactSheetOptions, ContactSheetOrder, frame, is_shown, rank, state};
    use crate::pictures::FrameKind;
    use mocban_core::domain::{FailureClass, PairName, ThresholdMetric, Verdict};
    use mocban_core::raster::ImageLimits;
    use mocban_results::Consensus;
    use mocban_results::test_fixtures;

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
        assert_eq!(state(&low, order.metric), ["conf. 0.200"]);
        let judged = test_fixtures::done("c", 0.1, &[Verdict::Fail]);
        assert_eq!(state(&judged, order.metric), ["fail"]);
    }

    #[test]
    fn frames_say_what_is_wrong_and_what_passed() {
        assert_eq!(frame(None, false), FrameKind::Wrong);
        assert_eq!(frame(Some(Consensus::Failed), false), FrameKind::Wrong);
        assert_eq!(frame(Some(Consensus::Passed), true), FrameKind::Wrong);
        assert_eq!(frame(Some(Consensus::Passed), false), FrameKind::Passed);
        assert_eq!(frame(Some(Consensus::Unjudged), false), FrameKind::Other);
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
