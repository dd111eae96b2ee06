//! The report as plain data. `report --format json` prints it, and all other formats are rendered from it.

use serde::Serialize;

use super::adjudication::AdjudicationRules;
use super::block_accuracy::BlockAccuracy;
use super::comparison::{Basis, Comparison};
use super::counted_text::CountedText;
use super::fail_reasons::FailReasonCount;
use super::provenance::Provenance;
use super::risk_coverage::RiskCoverageCurve;
use super::score_bootstrap::{BootstrapSettings, MeanIntervals};
use super::score_comparison::ScoreComparison;
use super::stage_times::StageTimes;
use super::thresholds::ThresholdDistribution;
use super::truth_summary::TruthSummary;
use mocban_catalog::SetApart;
use mocban_core::domain::{FailureClass, JobStatus, PairName, Reason, Stage, ThresholdMetric};
use mocban_results::attention_checks::AttentionCheckRates;
use mocban_results::manual_alignment::ManualAlignmentErrors;
use mocban_results::number_format::counted;
use mocban_results::stats::IntervalMethod;

/// Version of the JSON form.
pub const SCHEMA: u32 = 1;

/// The report on a project.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of the JSON form.
    pub schema: u32,
    /// The answer in at most three sentences: how many pairs are aligned, Acc, and which differences are significant.
    /// Commands are in backticks.
    pub headline: Vec<CountedText>,
    /// Pairs in the project, in every state.
    pub pairs: u64,
    /// Retired pairs, which are in no other number.
    #[serde(skip_serializing_if = "is_zero")]
    pub retired: u64,
    /// How the intervals of shares are computed.
    pub interval: IntervalMethod,
    /// How many pairs are finished.
    pub progress: PairProgress,
    /// One row per metric, in the order of the paper's table. `relief` comes last and has a row only if it has results.
    pub rows: Vec<MetricRow>,
    /// Metrics compared by which results are right.
    pub comparisons: Vec<Comparison>,
    /// Metrics compared by their scores.
    pub score_comparisons: Vec<ScoreComparison>,
    /// Settings of the bootstrap. `None` if nothing was resampled: there are no results, or more than 100,000 units.
    pub bootstrap: Option<BootstrapSettings>,
    /// Risk-coverage curves of every metric that has confidences: first by verdicts, then by ground truth.
    pub risk_coverage: Vec<RiskCoverageCurve>,
    /// Failed pairs, by class.
    pub failures: Vec<FailureGroup>,
    /// The thresholds that the metrics chose.
    pub thresholds: Vec<ThresholdDistribution>,
    /// Computing times of the stages. Unlike all other fields, they differ from run to run.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub times: Vec<StageTimes>,
    /// Rates at which reviewers detected planted faults. `None` if no planted fault was judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attention_checks: Option<AttentionCheckRates>,
    /// How many whole blocks are finished. `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block_progress: Option<BlockCounts>,
    /// Whole blocks whose true boxes are known, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockAccuracy>,
    /// The first pair whose true alignment cannot be used, with the reason.
    #[serde(skip)]
    pub unusable_truth: Option<String>,
    /// Damaged rows that the numbers do not include.
    #[serde(skip_serializing_if = "SetApart::is_empty")]
    pub set_apart: SetApart,
    /// Caveats on the numbers, in whole sentences.
    pub warnings: Vec<CountedText>,
    /// What the numbers were computed from.
    pub provenance: Provenance,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes a reference"
)]
const fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// Numbers of pairs by state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PairProgress {
    /// Finished all stages.
    pub done: u64,
    /// Failed until somebody retries them.
    pub failed: u64,
    /// Waiting, running or backing off.
    pub pending: u64,
}

/// Numbers of whole blocks by state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct BlockCounts {
    /// All of their pairs are known.
    pub done: u64,
    /// Failed until somebody retries them.
    pub failed: u64,
    /// Waiting, running or backing off.
    pub pending: u64,
}

impl BlockCounts {
    /// Counts the blocks of a project. Returns `None` if it has none.
    pub(super) fn of(states: impl IntoIterator<Item = JobStatus>) -> Option<Self> {
        let mut all = None;
        for status in states {
            let numbers: &mut Self = all.get_or_insert_default();
            *match status {
                JobStatus::Done => &mut numbers.done,
                JobStatus::Quarantined => &mut numbers.failed,
                JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => &mut numbers.pending,
            } += 1;
        }
        all
    }

    /// Returns the clause on blocks whose pairs are not all known, or `None` if every block is done.
    pub(super) fn unfinished(self) -> Option<String> {
        let parts = [
            (self.failed, "failed", "failed"),
            (self.pending, "is not finished", "are not finished"),
        ];
        let parts = parts.into_iter().filter(|(n, _, _)| *n > 0);
        let verb = |n, one, more| if n == 1 { one } else { more };
        let parts: Vec<String> = parts
            .map(|(n, one, more)| format!("{} {}", counted(n, "block"), verb(n, one, more)))
            .collect();
        (!parts.is_empty()).then(|| parts.join(" and "))
    }
}

/// One metric's row. A mean over no pairs is `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricRow {
    /// The metric.
    pub metric: ThresholdMetric,
    /// Pairs with a result of this metric. The means are over these pairs.
    pub n: u64,
    /// Results with a verdict: passed, failed and unsure.
    pub judged: u64,
    /// Results with at least one pass and no fail, and conflicts adjudicated as a pass.
    pub passed: u64,
    /// Results with at least one fail and no pass, and conflicts adjudicated as a fail.
    pub failed: u64,
    /// Results on which all reviewers were unsure, and conflicts that no adjudication has settled.
    pub unsure: u64,
    /// The unsure results on which reviewers disagree.
    pub conflicts: u64,
    /// Results without a verdict whose earlier result had one.
    pub stale: u64,
    /// Results with a confidence below 0.5. `None` if no result has a confidence.
    pub low_confidence: Option<u64>,
    /// `passed / (passed + failed)`. `None` if nothing was passed or failed.
    pub acc: Option<f64>,
    /// The 95 % interval of `acc`, by the report's method.
    pub acc_ci95: Option<[f64; 2]>,
    /// Acc under three rules for disagreement. `None` without verdicts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rules: Option<AdjudicationRules>,
    /// Why reviewers failed results. A result counts for every reason given.
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
    /// Results with at least one piece of missing ink or missing wood.
    pub disagreeing: u64,
    /// Mean share of the stroke tops that lack ink.
    pub missing_ink: Option<f64>,
    /// Mean share of the ink that lacks wood.
    pub missing_wood: Option<f64>,
    /// Bootstrap intervals of the means.
    pub means_ci95: MeanIntervals,
    /// Errors against ground truth. `None` if no result has ground truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthSummary>,
    /// Errors against manual alignments. `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub manual_alignment: Option<ManualAlignmentErrors>,
}

/// Failed pairs of one class.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureGroup {
    /// The class.
    pub class: FailureClass,
    /// Number of pairs.
    pub count: u64,
    /// The first of them by name, at most [`FailureGroup::MAX_LISTED`].
    pub pairs: Vec<FailureExample>,
}

impl FailureGroup {
    /// Most pairs listed in a group.
    pub const MAX_LISTED: usize = 100;
}

/// A failed pair.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureExample {
    /// The pair.
    pub id: PairName,
    /// The stage that failed.
    pub stage: Stage,
    /// The error message.
    pub error: String,
}

impl MetricRow {
    /// Returns the number of failed results with a given reason. `None` stands for results without any reason.
    pub fn failed_for(&self, reason: Option<Reason>) -> u64 {
        let mut given = self.failed_reasons.iter();
        given
            .find(|given| given.reason == reason)
            .map_or(0, |given| given.count)
    }
}

impl Report {
    /// Returns the report without computing times and dates, which differ from run to run.
    #[must_use]
    pub fn without_times(mut self) -> Self {
        self.times = Vec::new();
        self.provenance.last_result = None;
        self
    }

    /// Returns whether anybody judged a result.
    pub fn has_verdicts(&self) -> bool {
        self.rows.iter().any(|row| row.judged > 0)
    }

    /// Returns whether the project holds ground truth.
    pub fn has_truth(&self) -> bool {
        self.rows.iter().any(|row| row.truth.is_some())
    }

    /// Returns the risk-coverage curve of a metric, or `None` if it has no confidences.
    pub fn risk_coverage(
        &self,
        basis: Basis,
        metric: ThresholdMetric,
    ) -> Option<&RiskCoverageCurve> {
        let mut curves = self.risk_coverage.iter();
        curves.find(|curve| curve.basis == basis && curve.metric == metric)
    }

    /// Returns the row of a metric.
    pub fn row(&self, metric: ThresholdMetric) -> Option<&MetricRow> {
        self.rows.iter().find(|row| row.metric == metric)
    }

    /// Returns the row whose Acc is in the headline: that of the default metric, or the first with an Acc. `None` if there is
    /// none.
    pub fn row_with_acc(&self) -> Option<&MetricRow> {
        let by_default = self.row(ThresholdMetric::DEFAULT);
        let judged = by_default.filter(|row| row.acc.is_some());
        judged.or_else(|| self.rows.iter().find(|row| row.acc.is_some()))
    }
}
