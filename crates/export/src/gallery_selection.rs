//! Selects the images of the HTML report: bad or disputed results, and a random sample.

use rayon::prelude::*;

use super::contact_sheet::DrawError;
use super::source_print::result_images;
use mocban_catalog::{Catalog, CatalogError, MetricRecord, PairResults, VerdictEvent};
use mocban_core::domain::{ContentHash, SeededRandom, ThresholdMetric};
use mocban_core::raster::{ImageLimits, jpeg_rgb8};
use mocban_results::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason, verdict_text};
use mocban_results::ground_truth::TruthErrors;
use mocban_results::number_format::NumberStyle::{Degrees, Percent, Score};
use mocban_results::number_format::format_number;
use mocban_results::pair_artifacts::group_identical;
use mocban_results::{Consensus, TruthEvaluation};
use mocban_store::Project;

/// Longest side of an image, pixels.
const SIDE: usize = 280;
/// JPEG quality of the images, 0..=100.
const QUALITY: u8 = 82;
/// Most results drawn for each reason.
const MAX_PER_REASON: usize = 80;
/// Pairs in the random sample.
const SAMPLE_SIZE: usize = 20;
/// The metric whose results are sampled.
const SAMPLE_METRIC: ThresholdMetric = ThresholdMetric::DEFAULT;

/// A result to be drawn: of one metric, or of several that look the same.
#[derive(Debug)]
struct GallerySubject {
    pair: PairResults,
    metrics: Vec<ThresholdMetric>,
    truth: Option<TruthErrors>,
    log: Vec<VerdictEvent>,
}

/// The results to draw: at most 80 that reviewers failed, 80 on which they disagree, 80 that miss the ground truth, the 80
/// of lowest confidence, and a random sample of 20.
#[derive(Debug)]
pub struct GallerySelection {
    seed: u64,
    random: SeededRandom,
    /// For each of [`GalleryReason::ALL`].
    groups: [SelectedResults; GalleryReason::ALL.len()],
}

/// The results that are shown for one reason.
#[derive(Debug, Default)]
struct SelectedResults {
    /// Number of such results in the project.
    total: u64,
    /// The results to draw, each with its sort key: the confidence where it is low, a random number in the random sample,
    /// and otherwise 0.
    subjects: Vec<(f64, GallerySubject)>,
}

/// Draws the images of a project's report. An image that cannot be drawn is left out. If the print or depth map of a
/// result cannot be read, its gallery item states the reason.
pub async fn draw_gallery(
    mut selection: GallerySelection,
    catalog: &Catalog,
    project: &Project,
    limits: ImageLimits,
) -> Result<Gallery, DrawError> {
    selection.read_log(catalog).await?;
    let project = project.clone();
    let draw = move || selection.draw(&project, &limits);
    Ok(tokio::task::spawn_blocking(draw).await?)
}

impl GallerySelection {
    /// Returns an empty selection; `seed` is that of the random sample.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            random: SeededRandom::new(seed, "report"),
            groups: Default::default(),
        }
    }

    /// Selects results of a pair to be drawn. Pairs must be added in the order of their names.
    pub fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        for records in group_identical(&pair.metrics) {
            for (group, reason) in self.groups.iter_mut().zip(GalleryReason::ALL) {
                let applies = |record: &&MetricRecord| reason_applies(reason, record, truth);
                let mut shown: Vec<_> = records.iter().copied().filter(applies).collect();
                if shown.is_empty() {
                    continue;
                }
                group.total += 1;
                let (number, limit) = match reason {
                    GalleryReason::Random => {
                        let name = ContentHash::of(pair.attributes.name.as_str().as_bytes());
                        (self.random.draw(&name, "picture"), SAMPLE_SIZE)
                    }
                    GalleryReason::LowConfidence => {
                        let confidence = shown[0].outcome.confidence;
                        (confidence.unwrap_or_default(), MAX_PER_REASON)
                    }
                    GalleryReason::Failed | GalleryReason::Conflict | GalleryReason::OffTruth => {
                        (0.0, MAX_PER_REASON)
                    }
                };
                if matches!(reason, GalleryReason::Random | GalleryReason::LowConfidence) {
                    shown.clone_from(&records);
                }
                let subjects = &mut group.subjects;
                let place = subjects.partition_point(|(other, _)| *other <= number);
                if place < limit {
                    subjects.insert(place, (number, GallerySubject::new(pair, &shown, truth)));
                    subjects.truncate(limit);
                }
            }
        }
    }

    /// Reads the verdicts on what is shown.
    async fn read_log(&mut self, catalog: &Catalog) -> Result<(), CatalogError> {
        for (_, subject) in self.groups.iter_mut().flat_map(|group| &mut group.subjects) {
            if subject.is_judged() {
                let name = &subject.pair.attributes.name;
                subject.log = catalog.verdict_log(Some(name)).await?;
            }
        }
        Ok(())
    }

    fn draw(self, project: &Project, limits: &ImageLimits) -> Gallery {
        let draw = |(reason, mut group): (GalleryReason, SelectedResults)| {
            if reason != GalleryReason::LowConfidence {
                let name =
                    |(_, subject): &(f64, GallerySubject)| subject.pair.attributes.name.clone();
                group.subjects.sort_by_cached_key(name);
            }
            let subjects = group.subjects.par_iter();
            GalleryGroup {
                reason,
                total: group.total,
                items: subjects
                    .map(|(_, subject)| subject.item(project, limits))
                    .collect(),
            }
        };
        let groups = GalleryReason::ALL.into_iter().zip(self.groups);
        Gallery {
            seed: self.seed,
            groups: groups
                .filter(|(_, group)| group.total > 0)
                .map(draw)
                .collect(),
        }
    }
}

/// Returns whether a result is shown for a reason.
fn reason_applies(reason: GalleryReason, record: &MetricRecord, truth: &TruthEvaluation) -> bool {
    match reason {
        GalleryReason::Failed => Consensus::of(record) == Consensus::Failed,
        GalleryReason::Conflict => Consensus::of(record) == Consensus::Conflict,
        GalleryReason::OffTruth => truth
            .errors
            .get(&record.outcome.metric)
            .is_some_and(|errors| !errors.pass()),
        GalleryReason::LowConfidence => {
            record.outcome.metric == SAMPLE_METRIC && record.outcome.is_low_confidence()
        }
        GalleryReason::Random => record.outcome.metric == SAMPLE_METRIC,
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

    /// Returns the result of its first metric.
    fn record(&self) -> Option<&MetricRecord> {
        self.pair.metric(self.metrics[0])
    }

    fn is_judged(&self) -> bool {
        self.record()
            .is_some_and(|record| !record.verdicts.is_empty())
    }

    fn item(&self, project: &Project, limits: &ImageLimits) -> GalleryItem {
        let attributes = &self.pair.attributes;
        let (images, problem) = result_images(project, &self.pair, self.metrics[0], SIDE, limits);
        GalleryItem {
            pair: attributes.name.clone(),
            character: attributes.character.clone(),
            files: [&attributes.mesh_path, &attributes.print_path].map(|path| file_name(path)),
            metrics: self.metrics.clone(),
            numbers: self.numbers(),
            verdicts: self.verdicts(),
            images: images.map(|image| image.map(|image| jpeg_rgb8(&image, QUALITY))),
            problem,
        }
    }

    /// Returns a text with the scores, confidence and errors against ground truth, as far as they exist.
    fn numbers(&self) -> String {
        let Some(record) = self.record() else {
            return String::new();
        };
        let score = |value| format_number(value, Score);
        let mut text = format!("IoU {}", score(record.outcome.scores.iou));
        let confidence = record.outcome.confidence;
        text.extend(confidence.map(|confidence| format!(", confidence {}", score(confidence))));
        text.extend(self.truth.map(|errors| {
            let angle = format_number(errors.angle_deg, Degrees);
            let landmarks = format_number(errors.tre_pct, Percent);
            format!(", off the truth by {angle}\u{b0} and {landmarks} % of the height")
        }));
        let mask = self.truth.and_then(|errors| errors.mask_iou);
        text.extend(mask.map(|iou| format!(", IoU with the true stroke tops {}", score(iou))));
        text
    }

    /// Returns the newest verdict of each reviewer on this result.
    fn verdicts(&self) -> Vec<String> {
        let Some(record) = self.record() else {
            return Vec::new();
        };
        let newest = |reviewer: &str| {
            let mut log = self.log.iter().rev();
            log.find(|event| {
                event.reviewer == reviewer
                    && event.undone_at.is_none()
                    && event.metric == record.outcome.metric
                    && event.result_hash == record.result_hash
            })
        };
        let verdicts = record.verdicts.iter();
        verdicts
            .filter_map(|given| newest(&given.reviewer))
            .map(verdict_text)
            .collect()
    }
}

/// Returns the last part of a stored path. The folders before it belong to this computer, and reports are sent to others.
fn file_name(stored: &str) -> String {
    let mut parts = stored.rsplit(['/', '\\']);
    parts.next().unwrap_or(stored).to_owned()
}

#[cfg(test)]
mod tests {
    use super::{GallerySelection, MAX_PER_REASON, SAMPLE_SIZE};
    use mocban_core::domain::Verdict::{Fail, Pass};
    use mocban_results::TruthEvaluation;
    use mocban_results::test_fixtures;

    fn selection(seed: u64, pairs: usize) -> GallerySelection {
        let mut selection = GallerySelection::new(seed);
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
            selection.add(&pair, &truth);
        }
        selection
    }

    #[test]
    fn results_that_look_the_same_are_selected_once() {
        let selection = selection(1, 30);
        let groups = selection.groups.each_ref();
        let counts = groups.map(|group| (group.total, group.subjects.len()));
        let sample = (30, SAMPLE_SIZE);
        assert_eq!(counts, [(10, 10), (10, 10), (1, 1), (0, 0), sample]);
        let (_, first) = &selection.groups[0].subjects[0];
        assert_eq!(first.metrics.len(), 4, "all look the same");
    }

    #[test]
    fn the_lowest_confidence_is_shown_first() {
        let mut selection = GallerySelection::new(1);
        for (name, confidence) in [("a", 0.4), ("b", 0.9), ("c", 0.1), ("d", 0.3)] {
            let pair = test_fixtures::with_confidence(name, confidence);
            selection.add(&pair, &TruthEvaluation::default());
        }
        let [.., low, _] = &selection.groups;
        let subjects = low.subjects.iter();
        let names: Vec<&str> = subjects
            .map(|(_, subject)| subject.pair.attributes.name.as_str())
            .collect();
        assert_eq!((low.total, names), (3, vec!["c", "d", "a"]));
    }

    #[test]
    fn failures_beyond_the_limit_are_still_counted() {
        let selection = selection(1, 3 * MAX_PER_REASON + 3);
        let failed = &selection.groups[0];
        let counts = (failed.total, failed.subjects.len());
        assert_eq!(counts, (MAX_PER_REASON as u64 + 1, MAX_PER_REASON));
    }

    #[test]
    fn the_sample_depends_on_seed_and_names_only() {
        let names = |seed, pairs| -> Vec<String> {
            let [.., sample] = selection(seed, pairs).groups;
            let names = sample
                .subjects
                .iter()
                .map(|(_, subject)| subject.pair.attributes.name.to_string());
            names.collect()
        };
        assert_eq!(names(1, 90), names(1, 90));
        assert_ne!(names(1, 90), names(2, 90));
        assert_eq!(names(1, 90).len(), SAMPLE_SIZE);
        assert_eq!(names(1, 7).len(), 7);
    }

    #[test]
    fn reports_name_files_without_their_folders() {
        for (stored, shown) in [
            ("/home/lan/quét/1.stl", "1.stl"),
            ("C:\\a\\1.stl", "1.stl"),
            ("1.stl", "1.stl"),
        ] {
            assert_eq!(super::file_name(stored), shown);
        }
    }
}
