//! Exports the aligned pairs of a project for other tools.

use std::path::Path;

use crate::error::ProjectResult;
use crate::events::{Listener, LongWork, warn, warn_about_set_apart};
use crate::exit::Refusal;
use crate::location::Location;
use crate::missing_inputs::{self, MissingInputs};
use crate::own_files::refuse_project_file;
use crate::status::{all_retired, warn_about_stale};
use mocban_core::domain::ThresholdMetric;
use mocban_export::{
    ExportFormat, ExportOptions, ExportSummary, OmissionCounts, ResultFilter,
    export as export_pairs,
};

/// An export of a project.
#[derive(Debug)]
pub struct ExportedProject {
    /// What was written.
    pub summary: ExportSummary,
    /// Lowest confidence that was exported, if results were selected by it.
    pub least_confidence: Option<f64>,
    /// Inputs that are no longer at their places, if files could not be read.
    pub missing_inputs: Option<MissingInputs>,
}

/// Exports pairs to a folder. An earlier export there is replaced as a whole. Options without metrics choose all those of the
/// settings.
///
/// # Errors
/// Returns an error if an option has no effect or no result is selected, the folder is refused, or the catalog or the disk
/// fails.
pub async fn export(
    output: &Path,
    formats: &[ExportFormat],
    mut options: ExportOptions,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<ExportedProject> {
    refuse_project_file(output)?;
    let (project, catalog) = location.open_read_only().await?;
    let config = location.settings()?.config;
    let computed = config.stages.pipeline.method.metrics();
    let unknown = options
        .metrics
        .iter()
        .find(|metric| !computed.contains(metric));
    if let Some(metric) = unknown {
        let names: Vec<&str> = computed.iter().map(|metric| metric.name()).collect();
        let names = names.join(", ");
        let text = format!("the settings compute no {metric}; choose from {names}");
        return Err(Refusal::Usage(text).into());
    }
    let chosen = options.metrics;
    let is_chosen = |metric: &&ThresholdMetric| chosen.is_empty() || chosen.contains(metric);
    options.metrics = computed.iter().filter(is_chosen).copied().collect();
    options.settings = config.that_change_results()?;
    let are_pairs_chosen = options.pairs.is_some();
    let least_confidence = options.least_confidence();
    let selection = UsedSelection::of(&options);
    let checked = options.check(formats);
    checked.map_err(|unused| Refusal::Usage(unused.to_string()))?;
    warn_about_stale(&catalog, location, listener).await?;
    let work = LongWork::begin(listener, "exporting");
    let summary = export_pairs(&catalog, &project, output, formats, options).await;
    drop(work);
    let summary = summary?;
    let retired = all_retired(&catalog).await?;
    let missing_inputs = if summary.is_complete() {
        None
    } else {
        // The export is there already, so what cannot be looked up is no error.
        let found = missing_inputs::missing_of_all(&project, &catalog).await;
        found.ok().flatten()
    };
    catalog.close().await;
    if summary.is_nothing_selected {
        let nothing = retired.unwrap_or_else(|| {
            nothing_selected(
                &summary.left_out,
                are_pairs_chosen,
                selection,
                least_confidence,
            )
        });
        let text = format!("{nothing}; nothing was written to {}", output.display());
        return Err(Refusal::NothingSelected(text).into());
    }
    warn_about_set_apart(listener, &summary.set_apart);
    if let Some(retired) = retired {
        warn(listener, format!("the export has no pairs: {retired}"));
    }
    Ok(ExportedProject {
        summary,
        least_confidence,
        missing_inputs,
    })
}

/// The options that select results.
#[derive(Debug, Clone, Copy)]
struct UsedSelection {
    has_filter: bool,
    has_min_confidence: bool,
}

impl UsedSelection {
    fn of(options: &ExportOptions) -> Self {
        Self {
            has_filter: options.only != ResultFilter::All,
            has_min_confidence: options.min_confidence.is_some(),
        }
    }

    /// Returns which of these options select more with another value.
    const fn advice(self) -> &'static str {
        match (self.has_filter, self.has_min_confidence) {
            (true, true) => "; other values of --only and --min-confidence select more",
            (true, false) => "; another value of --only selects more",
            (false, true) => "; another value of --min-confidence selects more",
            (false, false) => "",
        }
    }
}

/// Returns why no pair has a selected result.
fn nothing_selected(
    left_out: &OmissionCounts,
    are_pairs_chosen: bool,
    selection: UsedSelection,
    least_confidence: Option<f64>,
) -> String {
    let (nothing, advice) = if are_pairs_chosen {
        ("none of the chosen pairs has a result to export", "")
    } else if left_out.all_lack_results() {
        let advice = "; `run` computes results, and `status` says which pairs failed";
        ("no result is selected", advice)
    } else {
        ("no result is selected", selection.advice())
    };
    match left_out.refused() {
        0 => nothing.to_owned(),
        _ => format!("{nothing}: {}{advice}", left_out.text(least_confidence)),
    }
}

#[cfg(test)]
mod tests {
    use super::{UsedSelection, nothing_selected};
    use mocban_export::{OmissionCounts, OmissionReason};

    const ONLY: UsedSelection = UsedSelection {
        has_filter: true,
        has_min_confidence: false,
    };

    #[test]
    fn other_selections_are_advised_only_if_they_select_more() {
        let mut left_out = OmissionCounts::default();
        left_out.add(OmissionReason::WithoutResult);
        let text = nothing_selected(&left_out, false, ONLY, None);
        assert!(!text.contains("--only") && text.contains("`run`"), "{text}");
        left_out.add(OmissionReason::WithoutVerdict);
        let text = nothing_selected(&left_out, false, ONLY, None);
        assert!(text.contains("--only") && !text.contains("`run`"), "{text}");
    }

    #[test]
    fn an_option_that_was_not_given_is_not_advised() {
        let mut left_out = OmissionCounts::default();
        left_out.add(OmissionReason::LowConfidence);
        for (has_filter, has_min_confidence) in [(true, false), (false, true), (true, true)] {
            let used = UsedSelection {
                has_filter,
                has_min_confidence,
            };
            let text = nothing_selected(&left_out, false, used, Some(0.9));
            let named = ["--only", "--min-confidence"].map(|option| text.contains(option));
            assert_eq!(named, [has_filter, has_min_confidence], "{text}");
        }
    }
}
