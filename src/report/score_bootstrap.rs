//! The scores of a project drawn anew: intervals of means and of Acc, and metrics compared by their scores.
//!
//! Pairs of one woodblock are no independent samples. Where the list of pairs has blocks, whole blocks are drawn.

use std::collections::BTreeMap;

use serde::Serialize;

use super::bootstrap::{self, QuantitySums, middle_95, resampled_means, resamples, two_sided_p};
use super::comparison::PAIRS;
use super::score::Score;
use super::score_comparison::{Difference, ScoreComparison, compared};
use crate::catalog::PairResults;
use crate::domain::ThresholdMetric;

/// Units that a quantity needs before an interval is told; of fewer it would be too narrow.
pub const FEWEST_UNITS: usize = 10;
/// Units that are kept; with more pairs chance hardly moves a mean, and nothing is drawn.
pub(super) const MOST_UNITS: usize = 100_000;

const METRICS: usize = ThresholdMetric::ALL.len();
const SCORES: usize = Score::ALL.len();
/// Quantities: every score of every metric, whether each passed, and every score's difference between two metrics.
const WIDTH: usize = METRICS * SCORES + METRICS + PAIRS.len() * SCORES;

/// What is drawn anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ResamplingUnit {
    /// Pairs, each by itself.
    Pair,
    /// Woodblocks with all their pairs; a pair without one counts as its own.
    Block,
}

impl ResamplingUnit {
    /// What several are called.
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Pair => "pairs",
            Self::Block => "blocks",
        }
    }
}

/// How the bootstrap was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct BootstrapSettings {
    /// Its kind of interval.
    pub method: &'static str,
    /// What was drawn.
    pub by: ResamplingUnit,
    /// How many of them there are.
    pub units: u64,
    /// How often they were drawn anew.
    pub resamples: u64,
    /// From which seed.
    pub seed: u64,
}

/// The 95 % bootstrap intervals of one metric's means; `None` where there are too few units.
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
    /// Of Acc, whole blocks drawn; `None` too where there are no blocks, or all results passed or all failed.
    pub acc_by_block: Option<[f64; 2]>,
}

/// What was drawn.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawn {
    /// How; `None` where nothing was drawn.
    pub(super) bootstrap: Option<BootstrapSettings>,
    /// Intervals of the means, in the order of [`ThresholdMetric::ALL`].
    pub(super) means: [MeanIntervals; METRICS],
    /// Metrics compared by their scores.
    pub(super) comparisons: Vec<ScoreComparison>,
    /// Why means have no intervals and metrics are not compared by their scores.
    pub(super) lack: Option<BootstrapSkipped>,
}

/// Why nothing follows from drawing anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BootstrapSkipped {
    /// More units than are kept.
    TooMany,
    /// Fewer units than an interval takes.
    TooFew {
        /// How many there are.
        units: usize,
        /// Of what.
        by: ResamplingUnit,
    },
}

/// The sums so far, by unit.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    units: Vec<QuantitySums>,
    blocks: BTreeMap<String, usize>,
    most: usize,
    is_over: bool,
}

impl Default for Samples {
    fn default() -> Self {
        Self {
            units: Vec::new(),
            blocks: BTreeMap::new(),
            most: MOST_UNITS,
            is_over: false,
        }
    }
}

impl Samples {
    /// Counts one pair in; `told` says whether a metric's result passed, where reviewers have told.
    pub(super) fn add(
        &mut self,
        pair: &PairResults,
        told: impl Fn(ThresholdMetric) -> Option<bool>,
    ) {
        if pair.metrics.is_empty() {
            return;
        }
        let Some(place) = self.place(pair.attributes.block.as_deref()) else {
            return;
        };
        let unit = &mut self.units[place];
        let mut add = |quantity: usize, value: f64| {
            unit[quantity][0] += value;
            unit[quantity][1] += 1.0;
        };
        let score = |metric, score: Score| Some(score.of(&pair.metric(metric)?.outcome.scores));
        for (i, metric) in ThresholdMetric::ALL.into_iter().enumerate() {
            for (j, kind) in Score::ALL.into_iter().enumerate() {
                if let Some(value) = score(metric, kind) {
                    add(mean_of(i, j), value);
                }
            }
            if let Some(passed) = told(metric) {
                add(acc_of(i), f64::from(u8::from(passed)));
            }
        }
        for (i, (a, b)) in PAIRS.into_iter().enumerate() {
            for (j, kind) in Score::ALL.into_iter().enumerate() {
                if let Some((a, b)) = score(a, kind).zip(score(b, kind)) {
                    add(difference_of(i, j), a - b);
                }
            }
        }
    }

    /// The unit of a pair; `None` when there are too many.
    fn place(&mut self, block: Option<&str>) -> Option<usize> {
        if let Some(known) = block.and_then(|block| self.blocks.get(block)) {
            return Some(*known);
        }
        if self.units.len() == self.most {
            self.is_over = true;
            return None;
        }
        let place = self.units.len();
        self.units.push(vec![[0.0; 2]; WIDTH]);
        if let Some(block) = block {
            self.blocks.insert(block.to_owned(), place);
        }
        Some(place)
    }

    /// The intervals and comparisons that follow.
    pub(super) fn finish(self) -> Drawn {
        if self.is_over || self.units.is_empty() {
            return Drawn {
                bootstrap: None,
                means: Default::default(),
                comparisons: Vec::new(),
                lack: self.is_over.then_some(BootstrapSkipped::TooMany),
            };
        }
        let units = self.units.len();
        let by = if self.blocks.is_empty() {
            ResamplingUnit::Pair
        } else {
            ResamplingUnit::Block
        };
        let mut quantities = Quantities::draw(&self.units);
        Drawn {
            bootstrap: Some(BootstrapSettings {
                method: "percentile",
                by,
                units: self.units.len() as u64,
                resamples: resamples(self.units.len()) as u64,
                seed: bootstrap::SEED,
            }),
            means: std::array::from_fn(|metric| quantities.intervals(metric, by)),
            comparisons: compared(&quantities.differences(), by),
            lack: (units < FEWEST_UNITS).then_some(BootstrapSkipped::TooFew { units, by }),
        }
    }
}

/// Place of a score of a metric among the quantities.
const fn mean_of(metric: usize, score: usize) -> usize {
    metric * SCORES + score
}

/// Place of whether a metric passed.
const fn acc_of(metric: usize) -> usize {
    METRICS * SCORES + metric
}

/// Place of a score's difference between two metrics.
const fn difference_of(pair: usize, score: usize) -> usize {
    METRICS * SCORES + METRICS + pair * SCORES + score
}

/// Every quantity as it is and as it is drawn anew.
struct Quantities {
    total: QuantitySums,
    /// Units that have any of it.
    held_by: Vec<usize>,
    drawn: Vec<Vec<f64>>,
}

impl Quantities {
    fn draw(units: &[QuantitySums]) -> Self {
        let mut total = vec![[0.0; 2]; WIDTH];
        let mut held_by = vec![0; WIDTH];
        for unit in units {
            for (i, [sum, n]) in unit.iter().enumerate() {
                total[i][0] += sum;
                total[i][1] += n;
                held_by[i] += usize::from(*n > 0.0);
            }
        }
        Self {
            total,
            held_by,
            drawn: resampled_means(units, WIDTH),
        }
    }

    /// The interval of a quantity, where enough units have it.
    fn interval(&mut self, quantity: usize) -> Option<[f64; 2]> {
        let is_enough = self.held_by[quantity] >= FEWEST_UNITS;
        middle_95(&mut self.drawn[quantity]).filter(|_| is_enough)
    }

    fn intervals(&mut self, metric: usize, by: ResamplingUnit) -> MeanIntervals {
        let [ssim, iou, iou_box, dice] =
            std::array::from_fn(|score| self.interval(mean_of(metric, score)));
        let [passed, told] = self.total[acc_of(metric)];
        let varies = passed > 0.0 && passed < told;
        let acc = self.interval(acc_of(metric));
        MeanIntervals {
            ssim,
            iou,
            iou_box,
            dice,
            acc_by_block: acc.filter(|_| varies && by == ResamplingUnit::Block),
        }
    }

    /// The differences by which metrics are compared, score by score.
    fn differences(&mut self) -> Vec<Difference> {
        let mut found = Vec::new();
        for score in Score::COMPARED {
            for (i, (a, b)) in PAIRS.into_iter().enumerate() {
                let quantity = difference_of(i, score as usize);
                let [sum, n] = self.total[quantity];
                let interval = self.interval(quantity);
                let p = two_sided_p(&self.drawn[quantity]).filter(|_| interval.is_some());
                found.extend((n > 0.0).then(|| Difference {
                    score,
                    a,
                    b,
                    n: n as u64,
                    mean: sum / n,
                    ci95: interval,
                    p,
                }));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::{Drawn, FEWEST_UNITS, ResamplingUnit, Samples};
    use crate::catalog::PairResults;
    use crate::domain::ThresholdMetric;
    use crate::report::test_fixtures;

    /// Pairs in blocks of three whose ensemble has a higher IoU than all others; every seventh fails.
    fn drawn(pairs: u32, has_blocks: bool) -> Drawn {
        let mut samples = Samples::default();
        for i in 0..pairs {
            let mut pair: PairResults = test_fixtures::done(&format!("p{i:02}"), 0.8, &[]);
            pair.attributes.block = has_blocks.then(|| format!("b{}", i / 3));
            let wave = f64::from(i).sin();
            for record in &mut pair.metrics {
                let is_best = record.outcome.metric == ThresholdMetric::Ensemble;
                record.outcome.scores.iou = 0.7 + 0.1 * wave + if is_best { 0.05 } else { 0.0 };
            }
            samples.add(&pair, |_| Some(i % 7 != 0));
        }
        samples.finish()
    }

    #[test]
    fn whole_blocks_are_drawn_where_there_are_blocks() {
        let by_pair = drawn(40, false);
        let by_block = drawn(40, true);
        let how = |drawn: &Drawn| drawn.bootstrap.map(|how| (how.by, how.units));
        assert_eq!(how(&by_pair), Some((ResamplingUnit::Pair, 40)));
        assert_eq!(how(&by_block), Some((ResamplingUnit::Block, 14)));
        assert_eq!(by_pair.means[0].acc_by_block, None);
        let [low, high] = by_block.means[0].acc_by_block.expect("14 blocks");
        // NumPy 2.4.6 with a million resamples: 0.762 and 0.929; deviation 0.045.
        assert!(
            (low - 0.762).abs() < 0.006 && (high - 0.929).abs() < 0.006,
            "{low} {high}"
        );
        assert_ne!(by_pair.means[0].iou, by_block.means[0].iou);
    }

    #[test]
    fn too_few_blocks_have_no_interval_however_many_pairs_they_hold() {
        let blocks = FEWEST_UNITS as u32 - 1;
        let found = drawn(3 * blocks, true);
        assert!(
            found
                .comparisons
                .iter()
                .all(|one| one.ci95.is_none() && one.p.is_none())
        );
        assert!(found.comparisons[0].words.contains("too few blocks"));
        assert_eq!(found.means[0].iou, None);
        let enough = drawn(3 * blocks + 1, true);
        assert!(enough.means[0].iou.is_some() && enough.comparisons[0].p.is_some());
    }

    #[test]
    fn acc_that_never_fails_has_no_interval_by_block() {
        let mut samples = Samples::default();
        for i in 0..20 {
            let mut pair = test_fixtures::done(&format!("p{i:02}"), 0.8, &[]);
            pair.attributes.block = Some(format!("b{i}"));
            samples.add(&pair, |_| Some(true));
        }
        let means = samples.finish().means[0];
        assert_eq!(means.acc_by_block, None);
        assert!(means.iou.is_some());
    }

    #[test]
    fn a_project_without_results_draws_nothing() {
        let mut samples = Samples::default();
        samples.add(&test_fixtures::pending("a"), |_| None);
        let found = samples.finish();
        assert_eq!((found.bootstrap, found.comparisons), (None, Vec::new()));
    }
}
