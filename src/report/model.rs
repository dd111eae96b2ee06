//! The report as plain data: what `report --format json` prints and every other form is made from.

use serde::Serialize;

use super::adjudication::AdjudicationRules;
use super::attention_checks::AttentionCheckRates;
use super::fail_reasons::FailReasonCount;
use super::interval::IntervalMethod;
use super::manual_alignment::ManualAlignmentErrors;
use super::score_bootstrap::{BootstrapSettings, MeanIntervals};
use super::score_comparison::ScoreComparison;
use super::stage_times::StageTimes;
use super::thresholds::ThresholdDistribution;
use crate::domain::{FailureClass, PairName, Reason, Stage, ThresholdMetric};

/// Version of the JSON form.
pub const SCHEMA: u32 = 1;

/// The whole report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of this form.
    pub schema: u32,
    /// Pairs in the project, in whatever state.
    pub pairs: u64,
    /// How the intervals are computed.
    pub interval: IntervalMethod,
    /// How far they are.
    pub progress: PairProgress,
    /// One row a metric, in the order of the paper's table; `relief` last and only where there are results of it.
    pub rows: Vec<MetricRow>,
    /// Metrics against each other, pair by pair.
    pub comparisons: Vec<Comparison>,
    /// Metrics against each other by their scores, pair by pair.
    pub score_comparisons: Vec<ScoreComparison>,
    /// How the intervals of means and of the score comparisons were drawn; `None` without results, and above 100,000
    /// pairs, where chance hardly moves a mean.
    pub bootstrap: Option<BootstrapSettings>,
    /// Accuracy against coverage, by reviewers and then by truth, for each metric that has confidences.
    pub coverage: Vec<RiskCoverage>,
    /// Pairs without result because they failed, by class.
    pub failures: Vec<FailureGroup>,
    /// Where the metrics cut the relief.
    pub thresholds: Vec<ThresholdDistribution>,
    /// How long the stages took. Everything else is the same whenever the same results are told.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub times: Vec<StageTimes>,
    /// Planted faults that reviewers caught, where any were answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caught: Option<AttentionCheckRates>,
    /// What a reader of the table must know, in whole sentences.
    pub warnings: Vec<String>,
}

/// How far the pairs are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PairProgress {
    /// All stages behind them.
    pub done: u64,
    /// Failed for good until somebody retries them.
    pub failed: u64,
    /// Not there yet: waiting, in work, backing off or set aside.
    pub pending: u64,
}

/// One metric's row. A mean over no pairs is `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricRow {
    /// Which metric.
    pub metric: ThresholdMetric,
    /// Pairs that finished with a result of this metric; the means are over these.
    pub n: u64,
    /// Results with a verdict: passed, failed and unsure.
    pub read: u64,
    /// Passed by every reviewer who could tell.
    pub passed: u64,
    /// Failed by every reviewer who could tell.
    pub failed: u64,
    /// Neither: nobody could tell, or reviewers contradict each other.
    pub unsure: u64,
    /// Those of the unsure on which reviewers contradict each other.
    pub conflicts: u64,
    /// Results without a verdict whose earlier result had one.
    pub stale: u64,
    /// `passed / (passed + failed)`; `None` where nobody has told.
    pub acc: Option<f64>,
    /// The 95 % interval of `acc`, as the report's `interval` says.
    pub acc_ci95: Option<[f64; 2]>,
    /// Acc under three rules, where somebody has read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rules: Option<AdjudicationRules>,
    /// Why reviewers failed the failed ones; a result counts for every reason given.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failed_reasons: Vec<FailReasonCount>,
    /// Mean structural similarity.
    pub ssim: Option<f64>,
    /// Mean structural similarity without the luminance factor.
    pub nl_ssim: Option<f64>,
    /// Mean intersection over union of the masks by pixel.
    pub iou: Option<f64>,
    /// Mean intersection over union of the bounding boxes.
    pub iou_box: Option<f64>,
    /// Mean Dice coefficient of the masks by pixel.
    pub dice: Option<f64>,
    /// Bootstrap intervals of the means.
    pub means_ci95: MeanIntervals,
    /// Agreement with true alignments, where the project holds them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthSummary>,
    /// Distance from alignments by hand, where people made any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_hand: Option<ManualAlignmentErrors>,
}

/// A metric's agreement with the true alignments; never mixed with people's verdicts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TruthSummary {
    /// Results that have a usable truth.
    pub n: u64,
    /// Of these, those with angle, landmarks and mask all right.
    pub passed: u64,
    /// `passed / n`.
    pub acc: Option<f64>,
    /// The 95 % interval of `acc`, as the report's `interval` says.
    pub acc_ci95: Option<[f64; 2]>,
    /// Share with an angle error of at most 5 degrees.
    pub angle_le_5deg: Option<f64>,
    /// Median angle error in degrees.
    pub angle_median_deg: Option<f64>,
    /// Median landmark error in percent of the character's height.
    pub tre_median_pct: Option<f64>,
    /// Median intersection over union of the depth mask with the true stroke tops, where there is a tops mask.
    pub mask_iou_median: Option<f64>,
    /// Results in mirror writing.
    pub mirrored: u64,
}

/// What a comparison counts as right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Basis {
    /// People's verdicts.
    Verdicts,
    /// True alignments.
    Truth,
}

/// Two metrics on the same pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// What counts as right.
    pub basis: Basis,
    /// The first metric.
    pub a: ThresholdMetric,
    /// The second.
    pub b: ThresholdMetric,
    /// Pairs judged for both.
    pub n: u64,
    /// Right for `a` only.
    pub a_only: u64,
    /// Right for `b` only.
    pub b_only: u64,
    /// Name of the test that gave `p`.
    pub test: &'static str,
    /// Its two-sided p; `None` without discordant pairs.
    pub p: Option<f64>,
    /// The same after Holm's correction over the comparisons of this basis.
    pub p_holm: Option<f64>,
    /// What follows, in words.
    pub words: String,
}

/// How right one metric's results are when the least confident are left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RiskCoverage {
    /// What counts as right.
    pub basis: Basis,
    /// Which metric.
    pub metric: ThresholdMetric,
    /// Results that have a confidence and are known to be right or wrong.
    pub n: u64,
    /// Of these, the wrong ones.
    pub failures: u64,
    /// How many the least confident 3 % are, rounded up.
    pub least_n: u64,
    /// The wrong ones among these.
    pub failures_in_least: u64,
    /// From everything kept down to half.
    pub points: Vec<RiskCoveragePoint>,
}

/// The results kept at one coverage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RiskCoveragePoint {
    /// Share of the results that is kept, the most confident ones, 0..=1.
    pub coverage: f64,
    /// How many that are, rounded down.
    pub n: u64,
    /// Of these, the right ones.
    pub passed: u64,
    /// `passed / n`; `None` where nothing is kept.
    pub acc: Option<f64>,
    /// The 95 % interval of `acc`, as the report's `interval` says.
    pub acc_ci95: Option<[f64; 2]>,
    /// The least confidence that is kept.
    pub least_confidence: Option<f64>,
}

/// Failed pairs of one class.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureGroup {
    /// The class.
    pub class: FailureClass,
    /// How many.
    pub count: u64,
    /// The first of them by name, at most [`FailureGroup::SHOWN`].
    pub pairs: Vec<FailureExample>,
}

impl FailureGroup {
    /// Most pairs named in a group.
    pub const SHOWN: usize = 100;
}

/// A failed pair.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureExample {
    /// The pair.
    pub id: PairName,
    /// Where it failed.
    pub stage: Stage,
    /// Why.
    pub error: String,
}

impl MetricRow {
    /// Failed results for which reviewers gave a reason, or none.
    pub fn failed_for(&self, reason: Option<Reason>) -> u64 {
        let mut given = self.failed_reasons.iter();
        given
            .find(|given| given.reason == reason)
            .map_or(0, |given| given.count)
    }
}

impl Report {
    /// The same with another interval.
    #[must_use]
    pub fn with_interval(mut self, interval: IntervalMethod) -> Self {
        self.interval = interval;
        self.caught = self.caught.map(|caught| caught.with_interval(interval));
        for row in &mut self.rows {
            row.acc_ci95 = interval.of(row.passed, row.passed + row.failed);
            row.rules = row.rules.map(|rules| rules.with_interval(interval));
            if let Some(truth) = &mut row.truth {
                truth.acc_ci95 = interval.of(truth.passed, truth.n);
            }
        }
        for point in self.coverage.iter_mut().flat_map(|curve| &mut curve.points) {
            point.acc_ci95 = interval.of(point.passed, point.n);
        }
        self
    }

    /// The same without computing times, which differ from run to run.
    #[must_use]
    pub fn without_times(self) -> Self {
        Self {
            times: Vec::new(),
            ..self
        }
    }

    /// Whether anybody has judged a result.
    pub fn anybody_read(&self) -> bool {
        self.rows.iter().any(|row| row.read > 0)
    }

    /// Whether the project holds true alignments.
    pub fn has_truth(&self) -> bool {
        self.rows.iter().any(|row| row.truth.is_some())
    }

    /// The accuracy against coverage of a metric, where it has confidences.
    pub fn coverage(&self, basis: Basis, metric: ThresholdMetric) -> Option<&RiskCoverage> {
        let mut curves = self.coverage.iter();
        curves.find(|curve| curve.basis == basis && curve.metric == metric)
    }

    /// The row of a metric.
    pub fn row(&self, metric: ThresholdMetric) -> Option<&MetricRow> {
        self.rows.iter().find(|row| row.metric == metric)
    }
}
