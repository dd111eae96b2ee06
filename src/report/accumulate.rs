//! Adds pairs up to a report, one at a time.
//!
//! Kept in memory a pair, for medians and percentiles: the time of each stage, the threshold of each metric, the errors
//! where there is ground truth, its confidence where it is judged, and sums of scores for the bootstrap of up to a
//! hundred thousand units.

use std::collections::BTreeMap;

use super::adjudication::AdjudicationSums;
use super::attention_checks::AttentionCheckRates;
use super::comparison::{Basis, ComparisonSums};
use super::consensus::Consensus;
use super::fail_reasons::FailReasonSums;
use super::ground_truth::TruthErrors;
use super::manual_alignment::{ManualErrorSums, ManualErrors};
use super::model::{FailureExample, FailureGroup, MetricRow, PairProgress, Report, SCHEMA};
use super::risk_coverage::ConfidenceSamples;
use super::score_bootstrap::{BootstrapResults, ScoreSample};
use super::stage_times::StageTimeSamples;
use super::stats::{IntervalMethod, ratio};
use super::thresholds::ThresholdSamples;
use super::truth_evaluation::{TruthEvaluation, TruthProblems};
use super::truth_summary::TruthSums;
use super::warnings::warnings;
use crate::catalog::{MetricRecord, PairResults};
use crate::domain::{FailureClass, JobStatus, Scores, ThresholdMetric};

/// A report while pairs are counted.
#[derive(Debug, Clone)]
pub struct ReportAccumulator {
    pairs: u64,
    progress: PairProgress,
    metrics: [MetricSums; ThresholdMetric::ALL.len()],
    scores: ScoreSample,
    verdict_comparisons: ComparisonSums,
    truth_comparisons: ComparisonSums,
    verdict_confidences: ConfidenceSamples,
    truth_confidences: ConfidenceSamples,
    failures: BTreeMap<FailureClass, FailureGroup>,
    thresholds: ThresholdSamples,
    times: StageTimeSamples,
    attention_checks: Option<AttentionCheckRates>,
    truth_problems: TruthProblems,
}

/// The sums of one metric.
#[derive(Debug, Clone)]
struct MetricSums {
    metric: ThresholdMetric,
    n: u64,
    passed: u64,
    failed: u64,
    unsure: u64,
    conflicts: u64,
    stale: u64,
    rules: AdjudicationSums,
    reasons: FailReasonSums,
    /// Of SSIM, NL-SSIM, `IoU`, `IoU` of boxes, Dice.
    scores: [f64; 5],
    truth: TruthSums,
    manual: ManualErrorSums,
}

impl Default for ReportAccumulator {
    fn default() -> Self {
        Self {
            pairs: 0,
            progress: PairProgress::default(),
            metrics: ThresholdMetric::ALL.map(MetricSums::new),
            scores: ScoreSample::default(),
            verdict_comparisons: ComparisonSums::default(),
            truth_comparisons: ComparisonSums::default(),
            verdict_confidences: ConfidenceSamples::default(),
            truth_confidences: ConfidenceSamples::default(),
            failures: BTreeMap::new(),
            thresholds: ThresholdSamples::default(),
            times: StageTimeSamples::default(),
            attention_checks: None,
            truth_problems: TruthProblems::default(),
        }
    }
}

impl ReportAccumulator {
    /// Counts one pair. Pairs are added in the order of their names, so that sums are reproducible.
    pub fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        self.pairs += 1;
        self.count_status(pair);
        self.truth_problems.add(pair, truth);
        self.thresholds.add(pair);
        self.times.add(&pair.stages);
        for sums in &mut self.metrics {
            if let Some(record) = pair.metric(sums.metric) {
                sums.add(record, truth.errors.get(&sums.metric));
            }
        }
        let passed = |metric| Consensus::of(pair.metric(metric)?).passed();
        let right = |metric| truth.errors.get(&metric).map(TruthErrors::pass);
        let confidence = |metric| pair.metric(metric)?.outcome.confidence;
        self.scores.add(pair, passed);
        self.verdict_comparisons.add(passed);
        self.truth_comparisons.add(right);
        self.verdict_confidences
            .add(|metric| confidence(metric).zip(passed(metric)));
        self.truth_confidences
            .add(|metric| confidence(metric).zip(right(metric)));
    }

    /// Counts a pair's errors against its manual alignment.
    pub fn add_manual_errors(&mut self, errors: &BTreeMap<ThresholdMetric, ManualErrors>) {
        for sums in &mut self.metrics {
            if let Some(errors) = errors.get(&sums.metric) {
                sums.manual.add(*errors);
            }
        }
    }

    /// Sets the planted faults that reviewers detected; ignored where none were answered.
    pub fn set_attention_checks(&mut self, rates: AttentionCheckRates) {
        self.attention_checks = (rates.all.n > 0).then_some(rates);
    }

    fn count_status(&mut self, pair: &PairResults) {
        match pair.status {
            JobStatus::Done => self.progress.done += 1,
            JobStatus::Quarantined => {
                self.progress.failed += 1;
                self.count_failure(pair);
            }
            JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => {
                self.progress.pending += 1;
            }
        }
    }

    fn count_failure(&mut self, pair: &PairResults) {
        let Some(stored) = &pair.failure else {
            return;
        };
        let class = stored.failure.class;
        let group = self.failures.entry(class).or_insert(FailureGroup {
            class,
            count: 0,
            pairs: Vec::new(),
        });
        group.count += 1;
        if group.pairs.len() < FailureGroup::MAX_LISTED {
            group.pairs.push(FailureExample {
                id: pair.attributes.name.clone(),
                stage: stored.stage,
                error: stored.failure.message.clone(),
            });
        }
    }

    /// Returns the report on all pairs added.
    pub fn finish(self) -> Report {
        let metrics = self.metrics.into_iter().filter(MetricSums::has_row);
        let bootstrap = self.scores.finish();
        let rows: Vec<MetricRow> = metrics.map(|sums| sums.finish(&bootstrap)).collect();
        let mut comparisons = self.verdict_comparisons.finish(Basis::Verdicts);
        comparisons.extend(self.truth_comparisons.finish(Basis::Truth));
        let mut risk_coverage = self.verdict_confidences.finish(Basis::Verdicts);
        risk_coverage.extend(self.truth_confidences.finish(Basis::Truth));
        Report {
            schema: SCHEMA,
            pairs: self.pairs,
            interval: IntervalMethod::default(),
            progress: self.progress,
            warnings: warnings(
                self.progress,
                &rows,
                &self.truth_problems,
                bootstrap.skipped,
            ),
            rows,
            comparisons,
            score_comparisons: bootstrap.comparisons,
            bootstrap: bootstrap.settings,
            risk_coverage,
            failures: self.failures.into_values().collect(),
            thresholds: self.thresholds.finish(),
            times: self.times.finish(),
            attention_checks: self.attention_checks,
        }
    }
}

impl MetricSums {
    fn new(metric: ThresholdMetric) -> Self {
        Self {
            metric,
            n: 0,
            passed: 0,
            failed: 0,
            unsure: 0,
            conflicts: 0,
            stale: 0,
            rules: AdjudicationSums::default(),
            reasons: FailReasonSums::default(),
            scores: [0.0; 5],
            truth: TruthSums::default(),
            manual: ManualErrorSums::default(),
        }
    }

    /// Returns whether the report has a row for the metric: the paper's always, others where they have results.
    fn has_row(&self) -> bool {
        self.n > 0 || ThresholdMetric::PAPER.contains(&self.metric)
    }

    fn add(&mut self, record: &MetricRecord, truth: Option<&TruthErrors>) {
        self.n += 1;
        let Scores {
            ssim,
            nl_ssim,
            iou,
            iou_box,
            dice,
            ..
        } = record.outcome.scores;
        let scores = [ssim, nl_ssim, iou, iou_box, dice];
        for (sum, score) in self.scores.iter_mut().zip(scores) {
            *sum += score;
        }
        self.rules.add(record);
        self.reasons.add(record);
        self.count_consensus(Consensus::of(record));
        if let Some(errors) = truth {
            self.truth.add(errors);
        }
    }

    fn count_consensus(&mut self, consensus: Consensus) {
        match consensus {
            Consensus::Unjudged => {}
            Consensus::Stale => self.stale += 1,
            Consensus::Passed => self.passed += 1,
            Consensus::Failed => self.failed += 1,
            Consensus::Unsure => self.unsure += 1,
            Consensus::Conflict => {
                self.unsure += 1;
                self.conflicts += 1;
            }
        }
    }

    fn finish(self, bootstrap: &BootstrapResults) -> MetricRow {
        let [ssim, nl_ssim, iou, iou_box, dice] = self.scores.map(|sum| ratio(sum, self.n));
        let decided = self.passed + self.failed;
        let judged = decided + self.unsure;
        MetricRow {
            metric: self.metric,
            n: self.n,
            judged,
            passed: self.passed,
            failed: self.failed,
            unsure: self.unsure,
            conflicts: self.conflicts,
            stale: self.stale,
            acc: ratio(self.passed as f64, decided),
            acc_ci95: IntervalMethod::Wilson.interval_95(self.passed, decided),
            rules: (judged > 0).then(|| self.rules.finish()),
            failed_reasons: self.reasons.finish(),
            ssim,
            nl_ssim,
            iou,
            iou_box,
            dice,
            means_ci95: bootstrap.means[self.metric as usize],
            truth: self.truth.finish(),
            manual_alignment: self.manual.finish(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::ReportAccumulator;
    use crate::domain::{FailureClass, ThresholdMetric, Verdict};
    use crate::report::{TruthEvaluation, test_fixtures};

    #[test]
    fn means_are_over_finished_pairs_only() {
        let mut report = ReportAccumulator::default();
        let none = TruthEvaluation::default();
        report.add(&test_fixtures::done("a", 0.8, &[]), &none);
        report.add(
            &test_fixtures::failed("b", FailureClass::BadInput, "b.stl is empty"),
            &none,
        );
        report.add(&test_fixtures::done("c", 0.6, &[]), &none);
        report.add(&test_fixtures::pending("d"), &none);
        let report = report.finish();
        assert_eq!((report.pairs, report.progress.pending), (4, 1));
        for row in &report.rows {
            assert_eq!(row.n, 2);
            assert!((row.iou.expect("two pairs") - 0.7).abs() < 1e-12);
            assert_eq!((row.acc, row.acc_ci95, row.judged), (None, None, 0));
            assert_eq!(row.truth, None);
        }
        assert_eq!(report.failures.len(), 1);
        assert_eq!(report.failures[0].pairs[0].error, "b.stl is empty");
    }

    #[test]
    fn unsure_is_judged_but_neither_passed_nor_failed() {
        let mut report = ReportAccumulator::default();
        let all = [Verdict::Pass, Verdict::Pass, Verdict::Fail, Verdict::Unsure];
        for (name, verdict) in ["a", "b", "c", "d"].into_iter().zip(all) {
            report.add(
                &test_fixtures::done(name, 0.8, &[verdict]),
                &TruthEvaluation::default(),
            );
        }
        let report = report.finish();
        let row = report
            .row(ThresholdMetric::Density)
            .expect("every metric has a row");
        assert_eq!(
            (row.judged, row.passed, row.failed, row.unsure),
            (4, 2, 1, 1)
        );
        assert_eq!(row.acc, Some(2.0 / 3.0));
    }

    #[test]
    fn empty_project_has_three_empty_rows() {
        let report = ReportAccumulator::default().finish();
        assert_eq!(report.rows.len(), 3);
        assert!(
            report
                .rows
                .iter()
                .all(|row| row.n == 0 && row.ssim.is_none())
        );
        assert!(report.comparisons.is_empty() && report.warnings.is_empty());
    }

    #[test]
    fn the_papers_method_has_the_papers_rows_only() {
        let mut report = ReportAccumulator::default();
        let pair = test_fixtures::done_by_paper("a", 0.8, &[Verdict::Pass]);
        report.add(&pair, &TruthEvaluation::default());
        let report = report.finish();
        let metrics: Vec<_> = report.rows.iter().map(|row| row.metric).collect();
        assert_eq!(metrics, ThresholdMetric::PAPER);
        assert_eq!(report.comparisons.len(), 3);
        assert_eq!(report.warnings.len(), 1, "{:?}", report.warnings);
        assert!(report.warnings[0].contains("needs at least 10 pairs"));
    }

    #[test]
    fn failures_beyond_the_listed_are_still_counted() {
        let mut report = ReportAccumulator::default();
        for i in 0..130 {
            let pair = test_fixtures::failed(&format!("p{i:03}"), FailureClass::Io, "gone");
            report.add(&pair, &TruthEvaluation::default());
        }
        let report = report.finish();
        assert_eq!(report.failures[0].count, 130);
        assert_eq!(report.failures[0].pairs.len(), 100);
    }
}
