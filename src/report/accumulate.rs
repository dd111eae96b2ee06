//! Adds pairs up to a report, one at a time, without keeping them.
//!
//! What stays in memory a pair, for medians and percentiles: the time of each stage, the threshold of each metric, three
//! numbers a metric where there is truth, its confidence where it is judged, and sums of scores for the bootstrap up to a
//! hundred thousand pairs or blocks.

use std::collections::BTreeMap;

use super::adjudication::AdjudicationSums;
use super::attention_checks::AttentionCheckRates;
use super::comparison::McNemarTests;
use super::consensus::Consensus;
use super::fail_reasons::FailReasonSums;
use super::ground_truth::TruthErrors;
use super::ground_truth_sums::TruthSums;
use super::interval::IntervalMethod;
use super::manual_alignment::{ManualErrorSums, ManualErrors};
use super::model::{Basis, FailureExample, FailureGroup, MetricRow, PairProgress, Report, SCHEMA};
use super::risk_coverage::ConfidenceSamples;
use super::score_bootstrap::{Drawn, Samples};
use super::stage_times::StageTimeSamples;
use super::stats::wilson_95;
use super::thresholds::ThresholdSamples;
use super::warnings;
use crate::catalog::{MetricRecord, PairResults};
use crate::domain::{FailureClass, JobStatus, ThresholdMetric};

/// What the truth says of one pair.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TruthEvaluation {
    /// Errors by metric; empty where there is no truth or it cannot be used.
    pub errors: BTreeMap<ThresholdMetric, TruthErrors>,
    /// Why a truth that is there cannot be used.
    pub problem: Option<String>,
}

/// The sums so far.
#[derive(Debug, Clone)]
pub struct ReportAccumulator {
    pairs: u64,
    progress: PairProgress,
    columns: [MetricSums; ThresholdMetric::ALL.len()],
    samples: Samples,
    by_verdicts: McNemarTests,
    by_truth: McNemarTests,
    sure_by_verdicts: ConfidenceSamples,
    sure_by_truth: ConfidenceSamples,
    failures: BTreeMap<FailureClass, FailureGroup>,
    cuts: ThresholdSamples,
    times: StageTimeSamples,
    caught: Option<AttentionCheckRates>,
    truth_problems: TruthProblems,
}

/// Truths that could not be used.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct TruthProblems {
    /// How many.
    pub(super) count: u64,
    /// The first, in words.
    pub(super) first: Option<String>,
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
    ssim: f64,
    nl_ssim: f64,
    iou: f64,
    iou_box: f64,
    dice: f64,
    truth: TruthSums,
    by_hand: ManualErrorSums,
}

impl Default for ReportAccumulator {
    fn default() -> Self {
        Self {
            pairs: 0,
            progress: PairProgress::default(),
            columns: ThresholdMetric::ALL.map(MetricSums::new),
            samples: Samples::default(),
            by_verdicts: McNemarTests::default(),
            by_truth: McNemarTests::default(),
            sure_by_verdicts: ConfidenceSamples::default(),
            sure_by_truth: ConfidenceSamples::default(),
            failures: BTreeMap::new(),
            cuts: ThresholdSamples::default(),
            times: StageTimeSamples::default(),
            caught: None,
            truth_problems: TruthProblems::default(),
        }
    }
}

impl ReportAccumulator {
    /// Counts one pair in. Pairs come in the order of their names, so that sums are the same every time.
    pub fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        self.pairs += 1;
        self.count_status(pair);
        self.count_truth_problem(pair, truth);
        self.cuts.add(pair);
        self.times.add(&pair.stages);
        for column in &mut self.columns {
            if let Some(record) = pair.metric(column.metric) {
                column.add(record, truth.errors.get(&column.metric));
            }
        }
        let told = |metric| Consensus::of(pair.metric(metric)?).told();
        let right = |metric| truth.errors.get(&metric).map(TruthErrors::pass);
        let sure = |metric| pair.metric(metric)?.outcome.confidence;
        self.samples.add(pair, told);
        self.by_verdicts.add(told);
        self.by_truth.add(right);
        self.sure_by_verdicts
            .add(|metric| sure(metric).zip(told(metric)));
        self.sure_by_truth
            .add(|metric| sure(metric).zip(right(metric)));
    }

    /// Counts in how far a pair's results are from its alignment by hand.
    pub fn add_by_hand(&mut self, errors: &BTreeMap<ThresholdMetric, ManualErrors>) {
        for column in &mut self.columns {
            if let Some(errors) = errors.get(&column.metric) {
                column.by_hand.add(*errors);
            }
        }
    }

    /// Takes in the planted faults that reviewers caught; none where none were answered.
    pub fn caught(&mut self, caught: AttentionCheckRates) {
        self.caught = (caught.all.n > 0).then_some(caught);
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
        if group.pairs.len() < FailureGroup::SHOWN {
            group.pairs.push(FailureExample {
                id: pair.attributes.name.clone(),
                stage: stored.stage,
                error: stored.failure.message.clone(),
            });
        }
    }

    fn count_truth_problem(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        if let Some(problem) = &truth.problem {
            self.truth_problems.count += 1;
            let first = || format!("{}: {problem}", pair.attributes.name);
            self.truth_problems.first.get_or_insert_with(first);
        }
    }

    /// The report over all pairs counted.
    pub fn finish(self) -> Report {
        let told = self.columns.into_iter().filter(MetricSums::is_told);
        let drawn = self.samples.finish();
        let rows: Vec<MetricRow> = told.map(|column| column.finish(&drawn)).collect();
        let mut comparisons = self.by_verdicts.finish(Basis::Verdicts);
        comparisons.extend(self.by_truth.finish(Basis::Truth));
        let mut coverage = self.sure_by_verdicts.finish(Basis::Verdicts);
        coverage.extend(self.sure_by_truth.finish(Basis::Truth));
        Report {
            schema: SCHEMA,
            pairs: self.pairs,
            interval: IntervalMethod::default(),
            progress: self.progress,
            warnings: warnings::of(self.progress, &rows, &self.truth_problems, drawn.lack),
            rows,
            comparisons,
            score_comparisons: drawn.comparisons,
            bootstrap: drawn.bootstrap,
            coverage,
            failures: self.failures.into_values().collect(),
            thresholds: self.cuts.finish(),
            times: self.times.finish(),
            caught: self.caught,
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
            ssim: 0.0,
            nl_ssim: 0.0,
            iou: 0.0,
            iou_box: 0.0,
            dice: 0.0,
            truth: TruthSums::default(),
            by_hand: ManualErrorSums::default(),
        }
    }

    /// Whether the report has a row for it: the paper's always, others where there are results.
    fn is_told(&self) -> bool {
        self.n > 0 || ThresholdMetric::PAPER.contains(&self.metric)
    }

    fn add(&mut self, record: &MetricRecord, truth: Option<&TruthErrors>) {
        let scores = &record.outcome.scores;
        self.n += 1;
        self.ssim += scores.ssim;
        self.nl_ssim += scores.nl_ssim;
        self.iou += scores.iou;
        self.iou_box += scores.iou_box;
        self.dice += scores.dice;
        self.rules.add(record);
        self.reasons.add(record);
        self.count_standing(Consensus::of(record));
        if let Some(errors) = truth {
            self.truth.add(errors);
        }
    }

    fn count_standing(&mut self, standing: Consensus) {
        match standing {
            Consensus::Unread => {}
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

    fn finish(self, drawn: &Drawn) -> MetricRow {
        let mean = |sum: f64| share(sum, self.n);
        let told = self.passed + self.failed;
        MetricRow {
            metric: self.metric,
            n: self.n,
            read: told + self.unsure,
            passed: self.passed,
            failed: self.failed,
            unsure: self.unsure,
            conflicts: self.conflicts,
            stale: self.stale,
            acc: share(self.passed as f64, told),
            acc_ci95: wilson_95(self.passed, told),
            rules: (told + self.unsure > 0).then(|| self.rules.finish()),
            failed_reasons: self.reasons.finish(),
            ssim: mean(self.ssim),
            nl_ssim: mean(self.nl_ssim),
            iou: mean(self.iou),
            iou_box: mean(self.iou_box),
            dice: mean(self.dice),
            means_ci95: drawn.means[self.metric as usize],
            truth: self.truth.finish(),
            by_hand: self.by_hand.finish(),
        }
    }
}

/// Sum over count; `None` of nothing.
pub(super) fn share(sum: f64, n: u64) -> Option<f64> {
    (n > 0).then(|| sum / n as f64)
}

#[cfg(test)]
mod tests {
    use super::{ReportAccumulator, TruthEvaluation};
    use crate::domain::{FailureClass, ThresholdMetric, Verdict};
    use crate::report::test_fixtures;

    #[test]
    fn means_are_over_finished_pairs_only() {
        let mut tally = ReportAccumulator::default();
        let none = TruthEvaluation::default();
        tally.add(&test_fixtures::done("a", 0.8, &[]), &none);
        tally.add(
            &test_fixtures::failed("b", FailureClass::BadInput, "b.stl is empty"),
            &none,
        );
        tally.add(&test_fixtures::done("c", 0.6, &[]), &none);
        tally.add(&test_fixtures::pending("d"), &none);
        let report = tally.finish();
        assert_eq!((report.pairs, report.progress.pending), (4, 1));
        for row in &report.rows {
            assert_eq!(row.n, 2);
            assert!((row.iou.expect("two pairs") - 0.7).abs() < 1e-12);
            assert_eq!((row.acc, row.acc_ci95, row.read), (None, None, 0));
            assert_eq!(row.truth, None);
        }
        assert_eq!(report.failures.len(), 1);
        assert_eq!(report.failures[0].pairs[0].error, "b.stl is empty");
    }

    #[test]
    fn unsure_is_read_but_neither_passed_nor_failed() {
        let mut tally = ReportAccumulator::default();
        let all = [Verdict::Pass, Verdict::Pass, Verdict::Fail, Verdict::Unsure];
        for (name, verdict) in ["a", "b", "c", "d"].into_iter().zip(all) {
            tally.add(
                &test_fixtures::done(name, 0.8, &[verdict]),
                &TruthEvaluation::default(),
            );
        }
        let report = tally.finish();
        let row = report
            .row(ThresholdMetric::Density)
            .expect("every metric has a row");
        assert_eq!((row.read, row.passed, row.failed, row.unsure), (4, 2, 1, 1));
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
    fn the_papers_method_has_the_papers_rows_and_no_complaint() {
        let mut tally = ReportAccumulator::default();
        let pair = test_fixtures::done_by_paper("a", 0.8, &[Verdict::Pass]);
        tally.add(&pair, &TruthEvaluation::default());
        let report = tally.finish();
        let metrics: Vec<_> = report.rows.iter().map(|row| row.metric).collect();
        assert_eq!(metrics, ThresholdMetric::PAPER);
        assert_eq!(report.comparisons.len(), 3);
        // But that one pair is few.
        assert_eq!(report.warnings.len(), 1, "{:?}", report.warnings);
        assert!(report.warnings[0].contains("takes 10 pairs at least"));
    }

    #[test]
    fn failures_beyond_the_shown_are_still_counted() {
        let mut tally = ReportAccumulator::default();
        for i in 0..130 {
            let pair = test_fixtures::failed(&format!("p{i:03}"), FailureClass::Io, "gone");
            tally.add(&pair, &TruthEvaluation::default());
        }
        let report = tally.finish();
        assert_eq!(report.failures[0].count, 130);
        assert_eq!(report.failures[0].pairs.len(), 100);
    }
}
