//! The contact sheet of a project: its worst pairs first, on one picture.

use rayon::prelude::*;

use super::pictures::{ContactSheetCell, Rgb, contact_sheet, tile_side};
use super::tiles::tiles;
use crate::catalog::{Catalog, CatalogError, PairResults};
use crate::domain::{JobStatus, PairName, ThresholdMetric};
use crate::raster;
use crate::report::ground_truth::TruthErrors;
use crate::report::{Consensus, TruthEvaluation, with_truth};
use crate::store::Project;

/// Pairs in memory at a time while the worst are looked for.
const PAGE: usize = 256;

/// What comes first on a sheet. Failed pairs come before all others but in the order of names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactSheetOrder {
    /// The farthest from the truth; without truth, the lowest `IoU`.
    Worst,
    /// The lowest `IoU` on the canvas.
    Score,
    /// The smallest lead over the next best pose.
    Margin,
    /// The least confident; those without a confidence last.
    Confidence,
    /// The first name.
    Name,
}

impl ContactSheetOrder {
    /// Every order.
    pub const ALL: [Self; 5] = [
        Self::Worst,
        Self::Score,
        Self::Margin,
        Self::Confidence,
        Self::Name,
    ];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Worst => "worst",
            Self::Score => "score",
            Self::Margin => "margin",
            Self::Confidence => "confidence",
            Self::Name => "name",
        }
    }
}

impl std::fmt::Display for ContactSheetOrder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for ContactSheetOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|order| order.name() == text)
            .ok_or_else(|| {
                format!("{text:?} is not an order (worst, score, margin, confidence, name)")
            })
    }
}

/// What to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSheetOptions {
    /// Whose results.
    pub metric: ThresholdMetric,
    /// Only these pairs; all when `None`.
    pub pairs: Option<Vec<PairName>>,
    /// What comes first.
    pub order: ContactSheetOrder,
    /// Most pairs on the sheet.
    pub limit: usize,
    /// Pairs in a row, 1 to 12.
    pub columns: usize,
    /// Limits on the print images.
    pub limits: raster::ImageLimits,
}

/// A sheet, and how much of the project is on it.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSheet {
    /// The picture.
    pub picture: Rgb,
    /// Pairs on it.
    pub shown: usize,
    /// Pairs that are finished or failed, of those asked for.
    pub of: usize,
}

/// Why there is no sheet.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// A thread was lost.
    #[error("drawing stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// A pair that may get on the sheet.
struct SheetCandidate {
    /// Lowest first.
    rank: f64,
    pair: PairResults,
    truth: Option<TruthErrors>,
}

/// Draws the contact sheet of a project as its catalog stands. Unfinished pairs are not on it.
///
/// A picture that cannot be made is left blank, with the reason in the cell.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn draw_contact_sheet(
    catalog: &Catalog,
    project: &Project,
    options: ContactSheetOptions,
) -> Result<ContactSheet, DrawError> {
    let (chosen, of) = choose(catalog, project, &options).await?;
    let project = project.clone();
    let picture = move || {
        let draw = |candidate| cell(&project, candidate, &options);
        let cells: Vec<ContactSheetCell> = chosen.par_iter().map(draw).collect();
        ContactSheet {
            picture: contact_sheet(&cells, options.columns),
            shown: cells.len(),
            of,
        }
    };
    Ok(tokio::task::spawn_blocking(picture).await?)
}

/// The pairs that go on the sheet, in order, and of how many.
async fn choose(
    catalog: &Catalog,
    project: &Project,
    options: &ContactSheetOptions,
) -> Result<(Vec<SheetCandidate>, usize), DrawError> {
    let (mut chosen, mut of) = (Vec::new(), 0);
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        let wanted = page.into_iter().filter(|pair| wants(options, pair));
        for (pair, truth) in with_truth(project, wanted.collect()).await? {
            of += 1;
            chosen.push(SheetCandidate::new(pair, &truth, options));
        }
        // The sort is stable and pairs come by name, so that equal ranks stay in the order of names.
        chosen.sort_by(|a, b| a.rank.total_cmp(&b.rank));
        chosen.truncate(options.limit);
    }
    Ok((chosen, of))
}

/// Whether a pair was asked for and has something to show.
fn wants(options: &ContactSheetOptions, pair: &PairResults) -> bool {
    let asked = |names: &Vec<PairName>| names.contains(&pair.attributes.name);
    options.pairs.as_ref().is_none_or(asked)
        && (pair.status == JobStatus::Quarantined || pair.metric(options.metric).is_some())
}

impl SheetCandidate {
    fn new(pair: PairResults, truth: &TruthEvaluation, options: &ContactSheetOptions) -> Self {
        let truth = truth.errors.get(&options.metric).copied();
        let rank = rank(&pair, truth.as_ref(), options);
        Self { rank, pair, truth }
    }
}

/// Place of a pair on the sheet, lowest first.
fn rank(pair: &PairResults, truth: Option<&TruthErrors>, options: &ContactSheetOptions) -> f64 {
    if options.order == ContactSheetOrder::Name {
        return 0.0;
    }
    let Some(record) = pair.metric(options.metric) else {
        return f64::NEG_INFINITY;
    };
    let score = record.outcome.scores.iou;
    match options.order {
        ContactSheetOrder::Worst => truth.map_or(score, |errors| -errors.severity()),
        ContactSheetOrder::Score => score,
        ContactSheetOrder::Margin => record.outcome.margin,
        ContactSheetOrder::Confidence => record.outcome.confidence.unwrap_or(f64::INFINITY),
        ContactSheetOrder::Name => 0.0,
    }
}

fn cell(
    project: &Project,
    candidate: &SheetCandidate,
    options: &ContactSheetOptions,
) -> ContactSheetCell {
    let pair = &candidate.pair;
    let standing = pair.metric(options.metric).map(Consensus::of);
    let off_truth = candidate.truth.is_some_and(|errors| !errors.pass());
    let side = tile_side(options.columns);
    let (tiles, trouble) = tiles(project, pair, options.metric, side, &options.limits);
    ContactSheetCell {
        id: title(pair, options.metric),
        note: trouble.unwrap_or_else(|| note(candidate, options.metric)),
        wrong: pair.metric(options.metric).is_none()
            || off_truth
            || standing == Some(Consensus::Failed),
        tiles,
    }
}

/// The id, how sure the result is where that is known, and what reviewers say where anybody has.
fn title(pair: &PairResults, metric: ThresholdMetric) -> String {
    let mut title = pair.attributes.name.to_string();
    if let Some(record) = pair.metric(metric) {
        let sure = record.outcome.confidence;
        title.extend(sure.map(|sure| format!("  sure {sure:.2}")));
        let verdict = Consensus::of(record).verdict();
        title.extend(verdict.map(|verdict| format!("  {verdict}")));
    }
    title
}

/// The numbers of a pair, or why it failed.
fn note(candidate: &SheetCandidate, metric: ThresholdMetric) -> String {
    let pair = &candidate.pair;
    match (pair.metric(metric), &candidate.truth, &pair.failure) {
        (Some(record), Some(errors), _) => {
            let (iou, tops) = (record.outcome.scores.iou, errors.mask_iou);
            let tops = tops.map_or(String::new(), |tops| format!(" tops {tops:.2}"));
            let (angle, landmarks) = (errors.angle_deg, errors.tre_pct);
            let (angle, landmarks) = (short(angle), short(landmarks));
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

/// One decimal where it tells something.
fn short(value: f64) -> String {
    if value < 9.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::{ContactSheetOptions, ContactSheetOrder, rank, title, wants};
    use crate::domain::{FailureClass, PairName, ThresholdMetric, Verdict};
    use crate::raster;
    use crate::report::test_fixtures;

    fn options(order: ContactSheetOrder) -> ContactSheetOptions {
        ContactSheetOptions {
            metric: ThresholdMetric::Ensemble,
            pairs: None,
            order,
            limit: 50,
            columns: 5,
            limits: raster::ImageLimits::SUGGESTED,
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
        let (low_confidence, sure) = (test_fixtures::sure("b", 0.2), test_fixtures::sure("a", 0.9));
        let rank = |pair| rank(pair, None, &order);
        assert!(rank(&low_confidence) < rank(&sure));
        assert!(rank(&sure) < rank(&test_fixtures::done("c", 0.1, &[])));
        assert_eq!(title(&low_confidence, order.metric), "b  sure 0.20");
        let read = test_fixtures::done("c", 0.1, &[Verdict::Fail]);
        assert_eq!(title(&read, order.metric), "c  fail");
    }

    #[test]
    fn truth_outweighs_the_score_in_worst() {
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
    fn unfinished_and_unasked_pairs_are_not_shown() {
        let mut asked = options(ContactSheetOrder::Name);
        assert!(!wants(&asked, &test_fixtures::pending("a")));
        assert!(wants(&asked, &test_fixtures::done("a", 0.9, &[])));
        asked.pairs = Some(vec![PairName::new("b").expect("an id")]);
        assert!(!wants(&asked, &test_fixtures::done("a", 0.9, &[])));
    }

    #[test]
    fn every_order_is_found_by_its_name() {
        for order in ContactSheetOrder::ALL {
            assert_eq!(order.name().parse(), Ok(order));
        }
    }
}
