//! What to export: metrics, results, pictures and splits.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::Value;

use super::format::ExportFormat;
use super::left_out::OmissionReason;
use super::split::SplitSettings;
use mocban_catalog::{MetricRecord, PairResults};
use mocban_core::InputLimits;
use mocban_core::domain::{MetricOutcome, PairName, ThresholdMetric, enum_names};
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

    /// Returns the lowest confidence of exported results, if there is one.
    pub fn least_confidence(&self) -> Option<f64> {
        let of_filter = match self.only {
            ResultFilter::Confident => Some(MetricOutcome::LOW_CONFIDENCE),
            ResultFilter::All | ResultFilter::Passed => None,
        };
        let limits = of_filter.into_iter().chain(self.min_confidence);
        limits.reduce(f64::max)
    }

    /// Returns why a pair is left out, or `None` if it is exported. `is_kept` says whether one of its results is exported.
    pub(super) fn reason_to_leave_out(
        &self,
        pair: &PairResults,
        is_kept: bool,
    ) -> Option<OmissionReason> {
        let chosen = self.pairs.as_ref();
        if chosen.is_some_and(|pairs| !pairs.contains(&pair.attributes.name)) {
            return Some(OmissionReason::NotChosen);
        }
        if is_kept || !self.selects_results() {
            return None;
        }
        let selected = pair.metrics.iter();
        let selected = selected.filter(|record| self.metrics.contains(&record.outcome.metric));
        let reasons = selected.filter_map(|record| self.refusal(record));
        Some(reasons.max().unwrap_or(OmissionReason::WithoutResult))
    }

    /// Returns whether a result is exported.
    pub(super) fn keeps(&self, record: &MetricRecord) -> bool {
        self.metrics.contains(&record.outcome.metric) && self.refusal(record).is_none()
    }

    /// Returns why the result of a selected metric is left out.
    fn refusal(&self, record: &MetricRecord) -> Option<OmissionReason> {
        if self.only == ResultFilter::Passed {
            match Consensus::of(record) {
                Consensus::Passed => {}
                Consensus::Unjudged => return Some(OmissionReason::WithoutVerdict),
                Consensus::Stale => return Some(OmissionReason::EarlierVerdict),
                Consensus::Unsure | Consensus::Conflict => return Some(OmissionReason::Unsure),
                Consensus::Failed => return Some(OmissionReason::Failed),
            }
        }
        let least = self.least_confidence()?;
        match record.outcome.confidence {
            Some(confidence) if confidence >= least => None,
            Some(_) => Some(OmissionReason::LowConfidence),
            None => Some(OmissionReason::WithoutConfidence),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ExportOptions, OmissionReason, ResultFilter};
    use mocban_catalog::PairResults;
    use mocban_core::InputLimits;
    use mocban_core::domain::ThresholdMetric;
    use mocban_core::domain::Verdict::{Fail, Pass, Unsure};
    use mocban_results::test_fixtures::{done, pending, with_confidence};

    fn options(only: ResultFilter, min_confidence: Option<f64>) -> ExportOptions {
        ExportOptions {
            only,
            min_confidence,
            ..ExportOptions::all_of(&ThresholdMetric::ALL, InputLimits::SUGGESTED)
        }
    }

    fn reason(pair: &PairResults, options: &ExportOptions) -> Option<OmissionReason> {
        let is_kept = pair.metrics.iter().any(|record| options.keeps(record));
        options.reason_to_leave_out(pair, is_kept)
    }

    #[test]
    fn a_pair_is_left_out_for_the_reason_of_the_filter() {
        let passed = options(ResultFilter::Passed, None);
        let mut stale = done("a", 0.8, &[]);
        for record in &mut stale.metrics {
            record.older_verdicts = 1;
        }
        for (pair, expected) in [
            (done("a", 0.8, &[Pass]), None),
            (done("a", 0.8, &[]), Some(OmissionReason::WithoutVerdict)),
            (stale, Some(OmissionReason::EarlierVerdict)),
            (done("a", 0.8, &[Unsure]), Some(OmissionReason::Unsure)),
            (done("a", 0.8, &[Pass, Fail]), Some(OmissionReason::Unsure)),
            (done("a", 0.8, &[Fail]), Some(OmissionReason::Failed)),
            (pending("a"), Some(OmissionReason::WithoutResult)),
        ] {
            assert_eq!(reason(&pair, &passed), expected);
        }
        let mut unknown = with_confidence("a", 0.6);
        for record in &mut unknown.metrics {
            record.outcome.confidence = None;
        }
        let confident = options(ResultFilter::Confident, None);
        let surer = options(ResultFilter::Confident, Some(0.7));
        assert_eq!(surer.least_confidence(), Some(0.7));
        for (pair, options, expected) in [
            (with_confidence("a", 0.6), &confident, None),
            (
                with_confidence("a", 0.6),
                &surer,
                Some(OmissionReason::LowConfidence),
            ),
            (unknown, &confident, Some(OmissionReason::WithoutConfidence)),
        ] {
            assert_eq!(reason(&pair, options), expected);
        }
        let all = options(ResultFilter::All, None);
        assert_eq!(reason(&pending("a"), &all), None);
        let chosen = ExportOptions {
            pairs: Some([pending("b").attributes.name].into()),
            ..all
        };
        assert_eq!(reason(&pending("b"), &chosen), None);
        assert_eq!(
            reason(&done("a", 0.8, &[Pass]), &chosen),
            Some(OmissionReason::NotChosen)
        );
    }
}
