//! Statistics of results and verdicts as plain data, and their renderers.
//!
//! [`build()`] streams the pairs through a [`ReportAccumulator`]. [`agreement()`] counts verdicts of several reviewers.
//! [`consensus`] decides which verdict counts for a result, [`pair_artifacts`] reads the stored stages of a pair,
//! [`ground_truth`] and `manual_alignment` give errors against known alignments, and [`stats`] has intervals and tests.
//! `render` writes text, JSON, CSV, Markdown, LaTeX and HTML.
//!
//! **Invariant:** Acc comes from people's verdicts on the results that exist now, never from ground truth; renderers compute
//! nothing.

mod accumulate;
mod accuracy_sentence;
mod adjudication;
mod attention_checks;
mod block_accuracy;
mod box_matching;
mod build;
mod comparison;
pub mod consensus;
mod fail_reasons;
pub mod gallery;
pub mod ground_truth;
mod headline;
mod intervals;
mod manual_alignment;
mod model;
pub mod number_format;
pub mod pair_artifacts;
mod provenance;
pub mod quality_gate;
mod render;
mod report_error;
mod reviewer_agreement;
mod risk_coverage;
mod score_bootstrap;
mod score_comparison;
mod stage_times;
pub mod stats;
#[cfg(any(test, feature = "test-helpers"))]
pub mod test_fixtures;
mod thresholds;
mod truth_evaluation;
mod truth_summary;
mod warnings;

pub use accumulate::ReportAccumulator;
pub use adjudication::AdjudicationRules;
pub use attention_checks::{AttentionCheckRates, is_inattentive};
pub use block_accuracy::{BlockAccuracy, BoxAccuracy, PrecisionRecall};
pub use build::{build, build_with};
pub use comparison::{Basis, COMPARED_METRICS, Comparison};
pub use consensus::Consensus;
pub use fail_reasons::FailReasonCount;
pub use manual_alignment::{ManualAlignmentErrors, ManualCorrection, ManualErrors};
pub use model::{FailureExample, FailureGroup, MetricRow, PairProgress, Report, SCHEMA};
pub use provenance::{ChangedSetting, Provenance, UsedSettings};
pub use render::{Cover, MAX_PAGE_BYTES, ReportFormat, agreement_text, page, render, summary};
pub use report_error::ReportError;
pub use reviewer_agreement::{
    MIN_RESULTS, ReviewerAgreement, ReviewerPair, ReviewerRecord, VerdictAgreement, agreement,
};
pub use risk_coverage::{
    COVERAGE_PERCENT, LEAST_CONFIDENT_PERCENT, RiskCoverageCurve, RiskCoveragePoint,
};
pub use score_bootstrap::{BootstrapSettings, MeanIntervals};
pub use score_comparison::{Score, ScoreComparison};
pub use stage_times::StageTimes;
pub use stats::{IntervalMethod, Rate, ResamplingUnit};
pub use thresholds::{BINS, ThresholdDistribution};
pub use truth_evaluation::{TruthEvaluation, evaluate_pairs, mask_iou, tops_iou};
pub use truth_summary::TruthSummary;
