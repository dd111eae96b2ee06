//! What to export: metrics, results, pictures and splits.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::Value;

use super::format::ExportFormat;
use super::split::SplitSettings;
use mocban_catalog::MetricRecord;
use mocban_core::InputLimits;
use mocban_core::domain::{MetricOutcome, PairName, ThresholdMetric, Verdict, enum_names};
use mocban_results::Consensus;

/// Default size of shards in MiB.
const SHARD_MIB: u64 = 256;

/// Which results are exported.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ResultFilter {
    /// All pairs, also those without a result.
    #[default]
    All,
    /// Results whose confidence is not low.
    Confident,
    /// Results that the reviewers passed.
    Passed,
}

enum_names! {
    pub ResultFilter, "a selection of results":
    All = "all", Confident = "confident", Passed = "passed",
}

/// What to export, and how.
#[expect(
    clippy::struct_excessive_bools,
    reason = "independent choices of the command line"
)]
#[derive(Debug, Clone, Serialize)]
pub struct ExportOptions {
    /// Metrics to export. A pair without a result still has one line for each of these metrics.
    pub metrics: Vec<ThresholdMetric>,
    /// The only pairs that are exported; `None` for all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<BTreeSet<PairName>>,
    /// Which results are exported.
    pub only: ResultFilter,
    /// Lowest confidence of exported results, 0..=1.
    pub min_confidence: Option<f64>,
    /// Side in pixels of all pictures. `None` keeps the size of the print.
    pub canvas_px: Option<u32>,
    /// How pairs are divided into train, validation and test.
    pub split: Option<SplitSettings>,
    /// Whether to write computing times, which make the bytes differ from run to run.
    pub with_times: bool,
    /// Whether CSV files begin with a byte order mark, which Excel needs to read them as UTF-8.
    pub csv_bom: bool,
    /// Whether CSV files have semicolons between columns and decimal commas, as Excel in many languages reads them.
    pub csv_decimal_comma: bool,
    /// Whether Parquet tables hold the pictures.
    pub images: bool,
    /// Size in MiB at which the next shard or table begins.
    pub shard_mib: Option<u64>,
    /// Licence of the data, for the dataset card.
    pub license: Option<String>,
    /// The settings that may change results, for the manifest of the export.
    #[serde(skip)]
    pub settings: Value,
    /// Limits of the input files.
    #[serde(skip)]
    pub limits: InputLimits,
}

/// An option that no chosen format can use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{option} has no effect on {formats}, which {lack}; leave it out")]
pub struct UnusedOption {
    option: &'static str,
    formats: String,
    lack: &'static str,
}

impl ExportOptions {
    /// Returns options that export everything about `metrics`.
    pub fn all_of(metrics: &[ThresholdMetric], limits: InputLimits) -> Self {
        Self {
            metrics: metrics.to_vec(),
            pairs: None,
            only: ResultFilter::All,
            min_confidence: None,
            canvas_px: None,
            split: None,
            with_times: false,
            csv_bom: false,
            csv_decimal_comma: false,
            images: false,
            shard_mib: None,
            license: None,
            settings: Value::Null,
            limits,
        }
    }

    /// Checks that at least one of the formats can use each option.
    ///
    /// # Errors
    /// Returns an error that names the option and the formats.
    pub fn check(&self, formats: &[ExportFormat]) -> Result<(), UnusedOption> {
        let given = [
            (
                "--canvas",
                self.canvas_px.is_some(),
                ExportFormat::writes_pictures as fn(ExportFormat) -> bool,
                "writes no pictures of the print's frame",
            ),
            (
                "--split",
                self.split.is_some(),
                ExportFormat::writes_splits,
                "has no splits",
            ),
            (
                "--csv-bom",
                self.csv_bom,
                |format| format == ExportFormat::Csv,
                "writes no CSV",
            ),
            (
                "--csv-decimal-comma",
                self.csv_decimal_comma,
                |format| format == ExportFormat::Csv,
                "writes no CSV",
            ),
            (
                "--images",
                self.images,
                |format| format == ExportFormat::Parquet,
                "has its own pictures or none",
            ),
            (
                "--shard-mib",
                self.shard_mib.is_some(),
                |format| matches!(format, ExportFormat::HuggingFace | ExportFormat::WebDataset),
                "writes no shards",
            ),
            (
                "--license",
                self.license.is_some(),
                |format| format == ExportFormat::HuggingFace,
                "has no dataset card",
            ),
        ];
        for (option, is_given, uses, lack) in given {
            if is_given && !formats.iter().any(|format| uses(*format)) {
                let names: Vec<&str> = formats.iter().map(|format| format.name()).collect();
                return Err(UnusedOption {
                    option,
                    formats: names.join(", "),
                    lack,
                });
            }
        }
        Ok(())
    }

    /// Returns the size at which the next shard or table begins, in bytes.
    pub(super) fn shard_bytes(&self) -> u64 {
        self.shard_mib.unwrap_or(SHARD_MIB) << 20
    }

    /// Returns whether pairs and results may be left out.
    pub fn is_filtered(&self) -> bool {
        self.selects_results() || self.pairs.is_some()
    }

    /// Returns whether pairs without a selected result are left out.
    fn selects_results(&self) -> bool {
        self.only != ResultFilter::All || self.min_confidence.is_some()
    }

    /// Returns whether a pair with these selected results is exported.
    pub(super) fn keeps_pair(&self, name: &PairName, kept: &[&MetricRecord]) -> bool {
        let is_chosen = self.pairs.as_ref().is_none_or(|pairs| pairs.contains(name));
        is_chosen && !(self.selects_results() && kept.is_empty())
    }

    /// Returns whether a result is exported.
    pub(super) fn keeps(&self, record: &MetricRecord) -> bool {
        let confidence = record.outcome.confidence;
        let reaches = |least: f64| confidence.is_some_and(|found| found >= least);
        let is_wanted = match self.only {
            ResultFilter::All => true,
            ResultFilter::Confident => reaches(MetricOutcome::LOW_CONFIDENCE),
            ResultFilter::Passed => Consensus::of(record).verdict() == Some(Verdict::Pass),
        };
        let is_selected = self.metrics.contains(&record.outcome.metric);
        is_selected && is_wanted && self.min_confidence.is_none_or(reaches)
    }
}
