//! Builds a report by adding one pair at a time.
//!
//! Most numbers are only summed. For medians and percentiles, each pair's stage times, thresholds and errors stay in
//! memory. For risk-coverage curves, confidences stay in memory. For the bootstrap, sums of scores stay in memory for
//! up to 100,000 resampling units.

use std::collections::BTreeMap;

use super::adjudication::AdjudicationRules;
use super::comparison::{Basis, ComparisonSums};
use super::fail_reasons::FailReasonSums;
use super::headline::headline;
use super::model::{
    BlockCounts, FailureExample, FailureGroup, MetricRow, PairProgress, Report, SCHEMA,
};
use super::provenance::ProvenanceSums;
use super::risk_coverage::RiskCoverageCurve;
use super::score_bootstrap::{MeanIntervals, ScoreSample};
use super::stage_times::StageTimes;
use super::thresholds::{ThresholdDistribution, relative_height};
use super::truth_summary::TruthSummary;
use super::warnings::{TruthProblems, warnings};
use mocban_catalog::{MetricRecord, PairResults, SetApart};
use mocban_core::domain::{FailureClass, JobStatus, Stage, ThresholdMetric};
use mocban_results::TruthEvaluation;
use mocban_results::attention_checks::AttentionCheckRates;
use mocban_results::consensus::Consensus;
use mocban_results::ground_truth::TruthErrors;
use mocban_results::manual_alignment::{ManualAlignmentErrors, ManualErrors};
use mocban_results::stats::{IntervalMethod, Rate, ratio};

/// The sums from which a report is made.
#[derive(Debug, Clone, Default)]
pub struct ReportAccumulator {
    pairs: u64,
    retired: u64,
    progress: PairProgress,
    metrics: [MetricSums; ThresholdMetric::ALL.len()],
    scores: ScoreSample,
    /// For each [`Basis`].
    comparisons: [ComparisonSums; Basis::ALL.len()],
    failures: BTreeMap<FailureClass, FailureGroup>,
    /// Computing times of each stage, in milliseconds.
    times_ms: [Vec<f64>; Stage::ALL.len()],
    attention_checks: Option<AttentionCheckRates>,
    block_progress: Option<BlockCounts>,
    truth_problems: TruthProblems,
    provenance: ProvenanceSums,
}

/// The sums of one metric.
#[derive(Debug, Clone, Default)]
struct MetricSums {
    n: u64,
    passed: u64,
    failed: u64,
    unsure: u64,
    conflicts: u64,
    stale: u64,
    /// Results with a confidence, and those of low confidence.
    with_confidence: u64,
    low_confidence: u64,
    rules: AdjudicationRules,
    reasons: FailReasonSums,
    /// Of SSIM, NL-SSIM, `IoU`, `IoU` of boxes, Dice.
    scores: [f64; 5],
    /// Results with at least one piece of missing ink or missing wood.
    disagreeing: u64,
    /// Of the shares of missing ink and of missing wood.
    missing: [f64; 2],
    truth: Vec<TruthErrors>,
    manual: Vec<ManualErrors>,
    /// Relative heights of the thresholds.
    thresholds: Vec<f64>,
    /// For each [`Basis`]: the confidence of each result, and whether the result is right. Undecided results are left
    /// out.
    confidences: [Vec<(f64, bool)>; Basis::ALL.len()],
}

impl ReportAccumulator {
    /// Counts one pair. Pairs must be added in the order of their names, so that sums are reproducible.
    pub fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        self.pairs += 1;
        self.count_status(pair);
        self.truth_problems.add(pair, truth);
        self.provenance.add(pair);
        for record in &pair.stages {
            self.times_ms[record.stage.index()].push(record.ms as f64);
        }
        for (sums, metric) in self.metrics.iter_mut().zip(ThresholdMetric::ALL) {
            if let Some(record) = pair.metric(metric) {
                sums.add(record, truth.errors.get(&metric));
            }
        }
        let passed = |metric| Consensus::of(pair.metric(metric)?).passed();
        let right = |metric| truth.errors.get(&metric).map(TruthErrors::pass);
        self.scores.add(pair, passed);
        self.comparisons[Basis::Verdicts as usize].add(passed);
        self.comparisons[Basis::Truth as usize].add(right);
    }

    /// Counts a pair's errors against its manual alignment.
    pub fn add_manual_errors(&mut self, errors: &BTreeMap<ThresholdMetric, ManualErrors>) {
        for (metric, errors) in errors {
            self.metrics[*metric as usize].manual.push(*errors);
        }
    }

    /// Sets the rates at which reviewers detected planted faults, unless no planted fault was judged.
    pub fn set_attention_checks(&mut self, rates: AttentionCheckRates) {
        self.attention_checks = (rates.all.n > 0).then_some(rates);
    }

    /// Sets how many pairs are retired. They are not added.
    pub const fn set_retired(&mut self, retired: u64) {
        self.retired = retired;
    }

    /// Sets how many whole blocks are finished.
    pub fn set_block_progress(&mut self, blocks: Option<BlockCounts>) {
        self.block_progress = blocks;
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
    pub fn finish(mut self) -> Report {
        let bootstrap = self.scores.finish();
        let (mut rows, mut thresholds) = (Vec::new(), Vec::new());
        let mut curves = Basis::ALL.map(|_| Vec::new());
        for (metric, mut sums) in ThresholdMetric::ALL.into_iter().zip(self.metrics) {
            thresholds.extend(ThresholdDistribution::of(metric, &mut sums.thresholds));
            for ((curves, samples), basis) in
                curves.iter_mut().zip(&mut sums.confidences).zip(Basis::ALL)
            {
                curves.extend(RiskCoverageCurve::of(basis, metric, samples));
            }
            // The paper's metrics always have a row. Other metrics have one if they have results.
            if sums.n > 0 || ThresholdMetric::PAPER.contains(&metric) {
                rows.push(sums.finish(metric, bootstrap.means[metric as usize]));
            }
        }
        let comparisons = self.comparisons.into_iter().zip(Basis::ALL);
        let times = Stage::ALL.into_iter().zip(&mut self.times_ms);
        let mut report = Report {
            schema: SCHEMA,
            headline: Vec::new(),
            pairs: self.pairs,
            retired: self.retired,
            interval: IntervalMethod::default(),
            progress: self.progress,
            warnings: warnings(
                self.progress,
                &rows,
                &self.truth_problems,
                bootstrap.skipped,
                self.attention_checks.as_ref(),
            ),
            rows,
            comparisons: comparisons
                .flat_map(|(sums, basis)| sums.finish(basis))
                .collect(),
            score_comparisons: bootstrap.comparisons,
            bootstrap: bootstrap.settings,
            risk_coverage: curves.into_iter().flatten().collect(),
            failures: self.failures.into_values().collect(),
            thresholds,
            times: times
                .filter_map(|(stage, ms)| StageTimes::of(stage, ms))
                .collect(),
            attention_checks: self.attention_checks,
            block_progress: self.block_progress,
            blocks: Vec::new(),
            unusable_truth: self.truth_problems.first,
            set_apart: SetApart::default(),
            provenance: self.provenance.finish(),
        };
        report.headline = headline(&report);
        report
    }
}

impl MetricSums {
    fn add(&mut self, record: &MetricRecord, truth: Option<&TruthErrors>) {
        let (outcome, consensus) = (&record.outcome, Consensus::of(record));
        let scores = &outcome.scores;
        let scores = [
            scores.ssim,
            scores.nl_ssim,
            scores.iou,
            scores.iou_box,
            scores.dice,
        ];
        for (sum, score) in self.scores.iter_mut().zip(scores) {
            *sum += score;
        }
        let found = &outcome.disagreement;
        self.with_confidence += u64::from(outcome.confidence.is_some());
        self.low_confidence += u64::from(outcome.is_low_confidence());
        self.disagreeing += u64::from(found.pieces > 0);
        self.missing[0] += found.missing_ink;
        self.missing[1] += found.missing_wood;
        self.n += 1;
        self.rules.add(record);
        self.reasons.add(record);
        self.count_consensus(consensus);
        self.truth.extend(truth);
        self.thresholds
            .push(relative_height(outcome.threshold_level));
        let right = [consensus.passed(), truth.map(TruthErrors::pass)];
        for (samples, right) in self.confidences.iter_mut().zip(right) {
            samples.extend(outcome.confidence.zip(right));
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

    fn finish(self, metric: ThresholdMetric, means_ci95: MeanIntervals) -> MetricRow {
        let [ssim, nl_ssim, iou, iou_box, dice] = self.scores.map(|sum| ratio(sum, self.n));
        let [missing_ink, missing_wood] = self.missing.map(|sum| ratio(sum, self.n));
        let acc = Rate::new(self.passed, self.passed + self.failed);
        let judged = acc.n + self.unsure;
        MetricRow {
            metric,
            n: self.n,
            judged,
            passed: self.passed,
            failed: self.failed,
            unsure: self.unsure,
            conflicts: self.conflicts,
            stale: self.stale,
            low_confidence: (self.with_confidence > 0).then_some(self.low_confidence),
            acc: acc.share,
            acc_ci95: acc.ci95,
            rules: (judged > 0).then_some(self.rules),
            failed_reasons: self.reasons.finish(),
            ssim,
            nl_ssim,
            iou,
            iou_box,
            dice,
            disagreeing: self.disagreeing,
            missing_ink,
            missing_wood,
            means_ci95,
            truth: TruthSummary::of(&self.truth),
            manual_alignment: ManualAlignmentErrors::of(&self.manual),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::ReportAccumulator;
    use crate::test_fixtures;
    use mocban_core::domain::{FailureClass, ThresholdMetric, Verdict};
    use mocban_results::TruthEvaluation;

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
        for name in ["a", "b", "c", "d", "e", "f"] {
            let pair = test_fixtures::done_by_paper(name, 0.8, &[Verdict::Pass]);
            report.add(&pair, &TruthEvaluation::default());
        }
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
