//! The origin of a report's numbers as lines of text, which all formats for people print last.

use super::comparison_tables::mean_intervals;
use crate::model::Report;
use crate::provenance::UsedSettings;
use mocban_results::number_format::{counted, format_count};

/// A line: what it is about, and its text.
pub(super) type ProvenanceLine = (&'static str, String);

/// What lines are about.
pub(super) const LABELS: [&str; 7] = [
    "Program",
    "Settings",
    "Inputs",
    "Results",
    "Verdicts",
    "Seed",
    "Last result",
];

/// Width of these labels in aligned text.
pub(super) const LABEL_WIDTH: usize = 12;

/// Returns the lines, in order.
pub(super) fn provenance_lines(report: &Report) -> Vec<ProvenanceLine> {
    let found = &report.provenance;
    let mut lines = vec![("Program", format!("mocban {}", found.version))];
    let is_single = found.settings.len() == 1;
    lines.extend((found.settings.iter()).map(|used| ("Settings", settings(used, is_single))));
    let aligned: u64 = found.settings.iter().map(|used| used.pairs).sum();
    if aligned > 0 {
        let (pairs, inputs) = (counted(aligned, "aligned pair"), found.inputs_hash.short());
        lines.push(("Inputs", format!("{pairs}, meshes and prints {inputs}")));
        lines.push(("Results", found.results_hash.short()));
    }
    if found.verdicts > 0 {
        let verdicts = format_count(found.verdicts);
        let reviewers = counted(found.reviewers, "reviewer");
        lines.push(("Verdicts", format!("{verdicts} by {reviewers}")));
    }
    let has_intervals = mean_intervals(report).is_some();
    let bootstrap = report.bootstrap.as_ref().filter(|_| has_intervals);
    lines.extend(bootstrap.map(|used| ("Seed", format!("{} (bootstrap)", used.seed))));
    let time = found.last_result.as_deref();
    lines.extend(time.map(|time| {
        (
            "Last result",
            time.replace('T', " ").replace('Z', " +00:00"),
        )
    }));
    debug_assert!(
        lines.iter().all(|(what, _)| LABELS.contains(what)),
        "an earlier report is recognized by its labels"
    );
    lines
}

/// Returns the fingerprint of settings, with the settings that are not the default ones.
fn settings(used: &UsedSettings, is_single: bool) -> String {
    let mut parts = vec![used.fingerprint.short()];
    if !is_single {
        parts.push(counted(used.pairs, "pair"));
    }
    match used.changed.as_deref() {
        None => {}
        Some([]) => parts.push("all default".to_owned()),
        Some(changed) => parts.extend(
            (changed.iter())
                .map(|one| format!("{} = {} (default {})", one.name, one.value, one.default)),
        ),
    }
    parts.join(", ")
}
