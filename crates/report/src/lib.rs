//! Statistics of results and verdicts as plain data, and their renderers.
//!
//! [`build()`] streams the pairs through a [`ReportAccumulator`], which sums them up for each metric. `headline.rs` and
//! `warnings.rs` say in sentences what the numbers mean. `render` writes text, JSON, CSV, Markdown, LaTeX and HTML.
//!
//! **Invariant:** Acc comes from people's verdicts on the results that exist now, never from ground truth; renderers compute
//! nothing.

mod accumulate;
mod accuracy_sentence;
mod adjudication;
mod block_accuracy;
mod build;
mod comparison;
mod counted_text;
mod fail_reasons;
mod headline;
mod intervals;
mod model;
mod named_commands;
mod provenance;
pub mod quality_gate;
mod render;
mod report_error;
mod risk_coverage;
mod score_bootstrap;
mod score_comparison;
mod stage_times;
#[cfg(test)]
mod test_fixtures;
mod thresholds;
mod truth_summary;
mod warnings;

pub use accumulate::ReportAccumulator;
pub use adjudication::AdjudicationRules;
pub use block_accuracy::{BlockAccuracy, BoxAccuracy, PrecisionRecall};
pub use build::{build, build_with};
pub use comparison::{Basis, COMPARED_METRICS, Comparison};
pub use counted_text::{CountedPairs, CountedText, TextPart};
pub use fail_reasons::FailReasonCount;
pub use model::{
    BlockCounts, FailureExample, FailureGroup, MetricRow, PairProgress, Report, SCHEMA,
};
pub use named_commands::{CommandPage, NAMED_COMMANDS, NamedCommand, command_page};
pub use provenance::{ChangedSetting, Provenance, UsedSettings};
pub use render::{
    Cover, MAX_PAGE_BYTES, RESERVED_BYTES, ReportFormat, agreement_text, is_changed, is_continued,
    is_report, page, render, summary, with_checksum,
};
pub use report_error::ReportError;
pub use risk_coverage::{
    COVERAGE_PERCENT, LEAST_CONFIDENT_PERCENT, RiskCoverageCurve, RiskCoveragePoint,
};
pub use score_bootstrap::{BootstrapSettings, MeanIntervals};
pub use score_comparison::{Score, ScoreComparison};
pub use stage_times::StageTimes;
pub use thresholds::{BINS, ThresholdDistribution};
pub use truth_summary::TruthSummary;
