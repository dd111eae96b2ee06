//! From the catalog to a report as plain data, and from there to text, JSON, CSV, Markdown, LaTeX and HTML.
//!
//! [`build()`] streams the pairs through a [`ReportAccumulator`], [`agree()`] through counts of what reviewers say; everything else is
//! pure.

mod accumulate;
mod adjudication;
mod agreement;
mod attention_checks;
mod bootstrap;
mod build;
mod comparison;
pub(crate) mod consensus;
mod fail_reasons;
pub mod gallery;
pub mod ground_truth;
mod ground_truth_sums;
mod interval;
mod manual_alignment;
mod model;
pub mod pair_artifacts;
pub mod quality_gate;
mod rate;
mod render;
mod reviewer_agreement;
pub mod risk_coverage;
mod score;
mod score_bootstrap;
mod score_comparison;
mod stage_times;
pub mod stats;
#[cfg(test)]
pub(crate) mod test_fixtures;
mod thresholds;
mod warnings;

pub use accumulate::{ReportAccumulator, TruthEvaluation};
pub use adjudication::AdjudicationRules;
pub use agreement::{Agreement, ENOUGH};
pub use attention_checks::AttentionCheckRates;
pub use build::{PAGE, ReportError, build, build_with, finding, with_truth};
pub use consensus::Consensus;
pub use fail_reasons::FailReasonCount;
pub use interval::IntervalMethod;
pub use manual_alignment::{ManualAlignmentErrors, ManualCorrection, ManualErrors};
pub use model::{
    Basis, Comparison, FailureExample, FailureGroup, MetricRow, PairProgress, Report, RiskCoverage,
    RiskCoveragePoint, SCHEMA, TruthSummary,
};
pub use rate::Rate;
pub use render::{Cover, MOST_BYTES, ReportFormat, agree_text, page, render};
pub use reviewer_agreement::{ReviewerAgreement, ReviewerPair, ReviewerRecord, agree};
pub use score::Score;
pub use score_bootstrap::{BootstrapSettings, FEWEST_UNITS, MeanIntervals, ResamplingUnit};
pub use score_comparison::ScoreComparison;
pub use stage_times::StageTimes;
pub use thresholds::{BINS, ThresholdDistribution};
