//! The pictures of a report's page: what reviewers failed or contradict each other on, what is off the truth, and some
//! by lot.

use rayon::prelude::*;

use super::contact_sheet::DrawError;
use super::tiles::tiles;
use crate::catalog::{Catalog, CatalogError, MetricRecord, PairResults, VerdictEvent};
use crate::domain::{ContentHash, SeededRandom, ThresholdMetric};
use crate::raster::{self, jpeg_rgb8};
use crate::report::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason, said};
use crate::report::ground_truth::TruthErrors;
use crate::report::pair_artifacts::alike;
use crate::report::{Consensus, TruthEvaluation};
use crate::store::Project;

/// Longest side of a picture in pixels.
const SIDE: usize = 280;
/// Quality of the pictures, of 100.
const QUALITY: u8 = 82;
/// Most results drawn of each kind.
const MOST: usize = 80;
/// Pairs drawn by lot.
const BY_LOT: usize = 20;
/// Whose result of a pair is drawn by lot.
const LOT_METRIC: ThresholdMetric = ThresholdMetric::Ensemble;

/// A result to be drawn: of one metric, or of several that came to the same.
#[derive(Debug)]
struct GallerySubject {
    pair: PairResults,
    metrics: Vec<ThresholdMetric>,
    truth: Option<TruthErrors>,
    log: Vec<VerdictEvent>,
}

/// The results to draw: at most 80 that reviewers failed, 80 on which they contradict each other, 80 off the truth,
/// and 20 by lot.
#[derive(Debug)]
pub struct GallerySelection {
    seed: u64,
    lots: SeededRandom,
    found: [(u64, Vec<GallerySubject>); 3],
    by_lot: Vec<(f64, GallerySubject)>,
    pairs: u64,
}

/// Kinds that are chosen for what was found, in the order of [`GallerySelection::found`].
const FOUND: [GalleryReason; 3] = [
    GalleryReason::Failed,
    GalleryReason::Conflict,
    GalleryReason::OffTruth,
];

/// Draws the pictures of a project's report. One that cannot be made is left out, with the reason.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn draw_gallery(
    mut chosen: GallerySelection,
    catalog: &Catalog,
    project: &Project,
    limits: raster::ImageLimits,
) -> Result<Gallery, DrawError> {
    chosen.read_log(catalog).await?;
    let project = project.clone();
    let draw = move || chosen.draw(&project, &limits);
    Ok(tokio::task::spawn_blocking(draw).await?)
}

impl GallerySelection {
    /// Nothing yet; the seed is that of the lot.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            lots: SeededRandom::new(seed, "report"),
            found: Default::default(),
            by_lot: Vec::new(),
            pairs: 0,
        }
    }

    /// Takes a pair's results in, where they are to be drawn. Pairs come in the order of their names.
    pub fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        for records in alike(&pair.metrics) {
            for ((of, subjects), kind) in self.found.iter_mut().zip(FOUND) {
                let is_of_kind = |record: &&MetricRecord| is_of(kind, record, truth);
                let metrics: Vec<_> = records.iter().copied().filter(is_of_kind).collect();
                *of += u64::from(!metrics.is_empty());
                if !metrics.is_empty() && subjects.len() < MOST {
                    subjects.push(GallerySubject::new(pair, &metrics, truth));
                }
            }
            if records
                .iter()
                .any(|record| record.outcome.metric == LOT_METRIC)
            {
                self.cast(pair, &records, truth);
            }
        }
    }

    /// Takes a pair in by lot; who drew the highest goes.
    fn cast(&mut self, pair: &PairResults, records: &[&MetricRecord], truth: &TruthEvaluation) {
        self.pairs += 1;
        let name = ContentHash::of(pair.attributes.name.as_str().as_bytes());
        let lot = self.lots.draw(&name, "picture");
        let place = self.by_lot.partition_point(|(other, _)| *other <= lot);
        if place < BY_LOT {
            let subject = GallerySubject::new(pair, records, truth);
            self.by_lot.insert(place, (lot, subject));
            self.by_lot.truncate(BY_LOT);
        }
    }

    /// Reads what was said of what is shown.
    async fn read_log(&mut self, catalog: &Catalog) -> Result<(), CatalogError> {
        let found = self.found.iter_mut().flat_map(|(_, subjects)| subjects);
        let by_lot = self.by_lot.iter_mut().map(|(_, subject)| subject);
        for subject in found.chain(by_lot) {
            if subject.is_read() {
                subject.log = catalog
                    .verdict_log(Some(&subject.pair.attributes.name))
                    .await?;
            }
        }
        Ok(())
    }

    fn draw(self, project: &Project, limits: &raster::ImageLimits) -> Gallery {
        let mut by_lot: Vec<GallerySubject> = self.by_lot.into_iter().map(|(_, lot)| lot).collect();
        by_lot.sort_by(|a, b| a.pair.attributes.name.cmp(&b.pair.attributes.name));
        let found = FOUND.into_iter().zip(self.found);
        let all = found
            .map(|(kind, (of, subjects))| (kind, of, subjects))
            .chain([(GalleryReason::Lot, self.pairs, by_lot)]);
        let groups = all.filter(|(_, of, _)| *of > 0);
        Gallery {
            seed: self.seed,
            groups: groups
                .map(|(kind, of, subjects)| GalleryGroup {
                    kind,
                    of,
                    shots: subjects
                        .par_iter()
                        .map(|subject| subject.shot(project, limits))
                        .collect(),
                })
                .collect(),
        }
    }
}

/// Whether a result is shown for this.
fn is_of(kind: GalleryReason, record: &MetricRecord, truth: &TruthEvaluation) -> bool {
    match kind {
        GalleryReason::Failed => Consensus::of(record) == Consensus::Failed,
        GalleryReason::Conflict => Consensus::of(record) == Consensus::Conflict,
        GalleryReason::OffTruth => truth
            .errors
            .get(&record.outcome.metric)
            .is_some_and(|errors| !errors.pass()),
        GalleryReason::Lot => false,
    }
}

impl GallerySubject {
    fn new(pair: &PairResults, records: &[&MetricRecord], truth: &TruthEvaluation) -> Self {
        let metrics: Vec<_> = records.iter().map(|record| record.outcome.metric).collect();
        Self {
            pair: pair.clone(),
            truth: truth.errors.get(&metrics[0]).copied(),
            metrics,
            log: Vec::new(),
        }
    }

    /// The result of the first of its metrics.
    fn record(&self) -> Option<&MetricRecord> {
        self.pair.metric(self.metrics[0])
    }

    fn is_read(&self) -> bool {
        self.record()
            .is_some_and(|record| !record.verdicts.is_empty())
    }

    fn shot(&self, project: &Project, limits: &raster::ImageLimits) -> GalleryItem {
        let attributes = &self.pair.attributes;
        let (tiles, trouble) = tiles(project, &self.pair, self.metrics[0], SIDE, limits);
        GalleryItem {
            pair: attributes.name.clone(),
            character: attributes.character.clone(),
            files: [attributes.mesh_path.clone(), attributes.print_path.clone()],
            metrics: self.metrics.clone(),
            numbers: self.numbers(),
            said: self.said(),
            pictures: tiles.map(|tile| tile.map(|tile| jpeg_rgb8(&tile, QUALITY))),
            trouble,
        }
    }

    /// Scores, confidence and distance from the truth, as far as there are any.
    fn numbers(&self) -> String {
        let Some(record) = self.record() else {
            return String::new();
        };
        let mut words = format!("IoU {:.3}", record.outcome.scores.iou);
        let sure = record.outcome.confidence;
        words.extend(sure.map(|sure| format!(", confidence {sure:.2}")));
        words.extend(self.truth.map(|errors| {
            format!(
                ", off the truth by {:.1}\u{b0} and {:.1} % of the height",
                errors.angle_deg, errors.tre_pct
            )
        }));
        let mask = self.truth.and_then(|errors| errors.mask_iou);
        words.extend(mask.map(|iou| format!(", IoU with the true tops {iou:.2}")));
        words
    }

    /// The newest word of each reviewer on this result, by reviewer.
    fn said(&self) -> Vec<String> {
        let Some(record) = self.record() else {
            return Vec::new();
        };
        let counts = |reviewer: &str| {
            let mut log = self.log.iter().rev();
            log.find(|event| {
                event.reviewer == reviewer
                    && event.undone_at.is_none()
                    && event.metric == record.outcome.metric
                    && event.result_hash == record.result_hash
            })
        };
        let reviewers = record.verdicts.iter();
        reviewers
            .filter_map(|read| counts(&read.reviewer))
            .map(said)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{BY_LOT, GallerySelection, MOST};
    use crate::domain::Verdict::{Fail, Pass};
    use crate::report::{TruthEvaluation, test_fixtures};

    fn chosen(seed: u64, pairs: usize) -> GallerySelection {
        let mut chosen = GallerySelection::new(seed);
        for i in 0..pairs {
            let verdicts: &[_] = match i % 3 {
                0 => &[Fail],
                1 => &[Fail, Pass],
                _ => &[Pass],
            };
            let pair = test_fixtures::done(&format!("p{i:03}"), 0.8, verdicts);
            let truth = if i == 2 {
                test_fixtures::truth(90.0, 1.0, 0.9)
            } else {
                TruthEvaluation::default()
            };
            chosen.add(&pair, &truth);
        }
        chosen
    }

    #[test]
    fn failures_conflicts_and_what_is_off_the_truth_are_found_once_a_pair() {
        let chosen = chosen(1, 30);
        let counts = chosen
            .found
            .each_ref()
            .map(|(of, shown)| (*of, shown.len()));
        assert_eq!(counts, [(10, 10), (10, 10), (1, 1)]);
        assert_eq!(chosen.found[0].1[0].metrics.len(), 4, "all look the same");
    }

    #[test]
    fn more_failures_than_are_drawn_are_still_counted() {
        let chosen = chosen(1, 3 * MOST + 3);
        let (of, shown) = &chosen.found[0];
        assert_eq!((*of, shown.len()), (MOST as u64 + 1, MOST));
    }

    #[test]
    fn the_lot_falls_on_twenty_by_the_seed_alone() {
        let names = |seed, pairs| -> Vec<String> {
            let by_lot = chosen(seed, pairs).by_lot;
            let names = by_lot
                .iter()
                .map(|(_, lot)| lot.pair.attributes.name.to_string());
            names.collect()
        };
        assert_eq!(names(1, 90), names(1, 90));
        assert_ne!(names(1, 90), names(2, 90));
        assert_eq!(names(1, 90).len(), BY_LOT);
        assert_eq!(names(1, 7).len(), 7);
    }
}
