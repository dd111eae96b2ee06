//! Computes bootstrap intervals of mean scores, of Acc, and of the differences in scores between metrics.
//!
//! Pairs of one woodblock are not independent. Therefore whole blocks are resampled if any pair names its block.

use serde::Serialize;

use super::comparison::COMPARED_METRICS;
use super::score_comparison::{Score, ScoreComparison, conclude};
use mocban_catalog::PairResults;
use mocban_core::domain::ThresholdMetric;
use mocban_results::stats::{
    BOOTSTRAP_SEED, ClusterSample, MIN_UNITS, ResampledMeans, ResamplingUnit, resample_count,
};

const METRICS: usize = ThresholdMetric::ALL.len();
const SCORES: usize = Score::ALL.len();
/// Number of resampled quantities: the scores and the Acc of each metric, and the score differences of each comparison.
const WIDTH: usize = METRICS * SCORES + METRICS + COMPARED_METRICS.len() * SCORES;

/// How the bootstrap was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct BootstrapSettings {
    /// Its kind of interval.
    pub method: &'static str,
    /// What was resampled.
    pub by: ResamplingUnit,
    /// Number of units.
    pub units: u64,
    /// Number of resamples.
    pub resamples: u64,
    /// Seed of the resamples.
    pub seed: u64,
}

/// The 95 % bootstrap intervals of one metric. An interval is `None` if there are too few units.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct MeanIntervals {
    /// Of the mean structural similarity.
    pub ssim: Option<[f64; 2]>,
    /// Of the mean intersection over union by pixel.
    pub iou: Option<[f64; 2]>,
    /// Of the mean intersection over union of the bounding boxes.
    pub iou_box: Option<[f64; 2]>,
    /// Of the mean Dice coefficient.
    pub dice: Option<[f64; 2]>,
    /// Interval of Acc. `None` if pairs were resampled instead of blocks, or if all results passed or all failed.
    pub acc_by_block: Option<[f64; 2]>,
}

/// Results of the bootstrap.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct BootstrapResults {
    /// How the bootstrap was done. `None` if nothing was resampled.
    pub(super) settings: Option<BootstrapSettings>,
    /// Intervals of the means, in the order of [`ThresholdMetric::ALL`].
    pub(super) means: [MeanIntervals; METRICS],
    /// Metrics compared by their scores.
    pub(super) comparisons: Vec<ScoreComparison>,
    /// Why there are no intervals or comparisons.
    pub(super) skipped: Option<BootstrapSkipped>,
}

/// Why the bootstrap gives no intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BootstrapSkipped {
    /// The sample has more units of this kind than are held in memory.
    TooMany(ResamplingUnit),
    /// Fewer units than an interval needs.
    TooFew {
        /// Number of units.
        units: usize,
        /// What they are.
        by: ResamplingUnit,
    },
}

/// The scores of all pairs, summed by resampling unit.
#[derive(Debug, Clone)]
pub(super) struct ScoreSample(ClusterSample);

impl Default for ScoreSample {
    fn default() -> Self {
        Self(ClusterSample::new(WIDTH))
    }
}

impl ScoreSample {
    /// Counts one pair. `passed` returns whether the result of a metric passed, or `None` if reviewers did not decide.
    pub(super) fn add(
        &mut self,
        pair: &PairResults,
        passed: impl Fn(ThresholdMetric) -> Option<bool>,
    ) {
        if pair.metrics.is_empty() {
            return;
        }
        let Some(unit) = self.0.unit(pair.attributes.block.as_deref()) else {
            return;
        };
        let mut add = |quantity: usize, value: f64| {
            unit[quantity][0] += value;
            unit[quantity][1] += 1.0;
        };
        let score = |metric, score: Score| Some(score.of(&pair.metric(metric)?.outcome.scores));
        for (i, metric) in ThresholdMetric::ALL.into_iter().enumerate() {
            for (j, kind) in Score::ALL.into_iter().enumerate() {
                if let Some(value) = score(metric, kind) {
                    add(mean_index(i, j), value);
                }
            }
            if let Some(passed) = passed(metric) {
                add(acc_index(i), f64::from(u8::from(passed)));
            }
        }
        for (i, (a, b)) in COMPARED_METRICS.into_iter().enumerate() {
            for (j, kind) in Score::ALL.into_iter().enumerate() {
                if let Some((a, b)) = score(a, kind).zip(score(b, kind)) {
                    add(difference_index(i, j), a - b);
                }
            }
        }
    }

    /// Resamples and returns the intervals and comparisons.
    pub(super) fn finish(self) -> BootstrapResults {
        let (units, by) = (self.0.units(), self.0.unit_kind());
        if self.0.is_full() || units == 0 {
            return BootstrapResults {
                skipped: self.0.is_full().then_some(BootstrapSkipped::TooMany(by)),
                ..BootstrapResults::default()
            };
        }
        let mut resampled = self.0.resample();
        BootstrapResults {
            settings: Some(BootstrapSettings {
                method: "percentile",
                by,
                units: units as u64,
                resamples: resample_count(units) as u64,
                seed: BOOTSTRAP_SEED,
            }),
            means: std::array::from_fn(|metric| mean_intervals(&mut resampled, metric, by)),
            comparisons: comparisons(&mut resampled, by),
            skipped: (units < MIN_UNITS).then_some(BootstrapSkipped::TooFew { units, by }),
        }
    }
}

/// Returns the index of the quantity "score of a metric".
const fn mean_index(metric: usize, score: usize) -> usize {
    metric * SCORES + score
}

/// Returns the index of the quantity "metric passed".
const fn acc_index(metric: usize) -> usize {
    METRICS * SCORES + metric
}

/// Returns the index of the quantity that holds the difference in one score between two compared metrics.
const fn difference_index(compared: usize, score: usize) -> usize {
    METRICS * SCORES + METRICS + compared * SCORES + score
}

fn mean_intervals(
    resampled: &mut ResampledMeans,
    metric: usize,
    by: ResamplingUnit,
) -> MeanIntervals {
    let [ssim, iou, iou_box, dice] =
        std::array::from_fn(|score| resampled.ci95(mean_index(metric, score)));
    let [passed, judged] = resampled.total(acc_index(metric));
    let varies = passed > 0.0 && passed < judged;
    let acc = resampled.ci95(acc_index(metric));
    MeanIntervals {
        ssim,
        iou,
        iou_box,
        dice,
        acc_by_block: acc.filter(|_| varies && by == ResamplingUnit::Block),
    }
}

/// Returns the comparisons of metrics, score by score.
fn comparisons(resampled: &mut ResampledMeans, by: ResamplingUnit) -> Vec<ScoreComparison> {
    let mut found = Vec::new();
    for score in Score::COMPARED {
        for (i, (a, b)) in COMPARED_METRICS.into_iter().enumerate() {
            let quantity = difference_index(i, score as usize);
            let [sum, n] = resampled.total(quantity);
            let (ci95, p) = (resampled.ci95(quantity), resampled.p(quantity));
            found.extend((n > 0.0).then(|| ScoreComparison {
                score,
                a,
                b,
                n: n as u64,
                difference: sum / n,
                ci95,
                test: ScoreComparison::TEST,
                p,
                p_holm: None,
                conclusion: String::new(),
            }));
        }
    }
    conclude(&mut found, by);
    found
}

#[cfg(test)]
mod tests {
    use super::{BootstrapResults, ScoreSample};
    use crate::test_fixtures;
    use mocban_catalog::PairResults;
    use mocban_core::domain::ThresholdMetric;
    use mocban_results::stats::{MIN_UNITS, ResamplingUnit};

    /// Resamples pairs on which the ensemble has a higher IoU than all other metrics. Every seventh pair fails.
    fn resampled(pairs: u32, has_blocks: bool) -> BootstrapResults {
        let mut sample = ScoreSample::default();
        for i in 0..pairs {
            let mut pair: PairResults = test_fixtures::done(&format!("p{i:02}"), 0.8, &[]);
            pair.attributes.block = has_blocks.then(|| format!("b{}", i / 3));
            let wave = f64::from(i).sin();
            for record in &mut pair.metrics {
                let is_best = record.outcome.metric == ThresholdMetric::Ensemble;
                record.outcome.scores.iou = 0.7 + 0.1 * wave + if is_best { 0.05 } else { 0.0 };
            }
            sample.add(&pair, |_| Some(i % 7 != 0));
        }
        sample.finish()
    }

    #[test]
    fn whole_blocks_are_resampled_where_there_are_blocks() {
        let by_pair = resampled(40, false);
        let by_block = resampled(40, true);
        let how = |found: &BootstrapResults| found.settings.map(|how| (how.by, how.units));
        assert_eq!(how(&by_pair), Some((ResamplingUnit::Pair, 40)));
        assert_eq!(how(&by_block), Some((ResamplingUnit::Block, 14)));
        assert_eq!(by_pair.means[0].acc_by_block, None);
        let [low, high] = by_block.means[0].acc_by_block.expect("14 blocks");
        // Bounds from NumPy 2.4.6 with a million resamples. The standard deviation of the resampled Acc is 0.045.
        assert!(
            (low - 0.762).abs() < 0.006 && (high - 0.929).abs() < 0.006,
            "{low} {high}"
        );
        assert_ne!(by_pair.means[0].iou, by_block.means[0].iou);
    }

    #[test]
    fn too_few_blocks_have_no_interval_however_many_pairs_they_hold() {
        let blocks = MIN_UNITS as u32 - 1;
        let found = resampled(3 * blocks, true);
        assert!(
            found
                .comparisons
                .iter()
                .all(|one| one.ci95.is_none() && one.p.is_none())
        );
        assert!(found.comparisons[0].conclusion.contains("too few blocks"));
        assert_eq!(found.means[0].iou, None);
        let enough = resampled(3 * blocks + 1, true);
        assert!(enough.means[0].iou.is_some() && enough.comparisons[0].p.is_some());
    }

    #[test]
    fn acc_that_never_fails_has_no_interval_by_block() {
        let mut sample = ScoreSample::default();
        for i in 0..20 {
            let mut pair = test_fixtures::done(&format!("p{i:02}"), 0.8, &[]);
            pair.attributes.block = Some(format!("b{i}"));
            sample.add(&pair, |_| Some(true));
        }
        let means = sample.finish().means[0];
        assert_eq!(means.acc_by_block, None);
        assert!(means.iou.is_some());
    }

    #[test]
    fn a_project_without_results_is_not_resampled() {
        let mut sample = ScoreSample::default();
        sample.add(&test_fixtures::pending("a"), |_| None);
        let found = sample.finish();
        assert_eq!((found.settings, found.comparisons), (None, Vec::new()));
    }
}
