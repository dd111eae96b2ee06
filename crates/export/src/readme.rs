//! The README that is generated into every export.

use std::fmt::Write as _;

use super::format::ExportFormat;
use super::format_writer::{ExportContext, FormatGuide};
use super::left_out::OmissionCounts;
use super::manifest::PairCounts;

/// Name of the README.
pub(super) const README: &str = "README.md";
/// Name of the JSON Schema of a line.
pub(super) const SCHEMA: &str = "schema.json";

/// Frames and heights, which are the same in all exports.
const COORDINATES: &str = include_str!("../../../docs/reference/coordinates.md");

const CITATION: &str = "\
Cite the program as mocban (version above), and the method that it extends as arXiv:2411.05524. `export.json` holds all
settings, so that the export can be made again. `checksums.txt` beside it has the BLAKE3 hash of each file
(`b3sum --check checksums.txt`): an export replaces no file that somebody changed.
";

/// Returns the README of an export in one format.
pub(super) fn render(
    guide: &FormatGuide,
    format: ExportFormat,
    context: &ExportContext,
    pairs: PairCounts,
    left_out: &OmissionCounts,
) -> String {
    let mut text = guide.front_matter.clone();
    let _ = write!(
        text,
        "# Aligned blocks and prints ({format})\n\n{}\n\n",
        guide.purpose
    );
    let _ = writeln!(
        text,
        "Made by {} with `export --to {format}`: {}.\n",
        context.program,
        numbers(pairs, left_out, context.options.least_confidence())
    );
    if pairs.set_apart > 0 {
        let rows = match pairs.set_apart {
            1 => "1 stored row is".to_owned(),
            rows => format!("{rows} stored rows are"),
        };
        let _ = writeln!(
            text,
            "{rows} damaged and not part of this export; `mocban check` lists damaged rows.\n"
        );
    }
    let _ = write!(text, "## Files\n\n| path | content |\n|---|---|\n");
    for [path, meaning] in &guide.files {
        let _ = writeln!(text, "| `{path}` | {meaning} |");
    }
    if guide.schema.is_some() {
        let _ = writeln!(
            text,
            "| `{SCHEMA}` | JSON Schema (draft 2020-12) of a record |"
        );
    }
    let _ = writeln!(text, "\n{}", guide.usage);
    let _ = writeln!(text, "\n{}", guide.fields);
    let _ = writeln!(text, "## Settings of the export\n\n{}", settings(context));
    // The headings become those of a section.
    let coordinates = COORDINATES.replace("\n## ", "\n### ");
    let _ = writeln!(text, "#{coordinates}");
    let _ = write!(text, "## How to cite\n\n{CITATION}");
    text
}

/// Returns how many pairs an export has, and how many it lacks for which reasons. `least` is the lowest confidence that is
/// exported.
fn numbers(pairs: PairCounts, left_out: &OmissionCounts, least: Option<f64>) -> String {
    let noun = if pairs.done == 1 { "pair" } else { "pairs" };
    let mut text = format!("{} {noun} with a result", pairs.done);
    if pairs.without_result > 0 {
        let _ = write!(text, ", {} without", pairs.without_result);
    }
    if pairs.left_out > 0 {
        let _ = write!(text, ", {} left out by the selection", pairs.left_out);
    }
    if left_out.refused() > 0 {
        let _ = write!(text, " ({})", left_out.text(least));
    }
    text
}

/// Returns the options of an export as a list.
fn settings(context: &ExportContext) -> String {
    let options = serde_json::to_value(&context.options).expect("options are JSON");
    let mut text = String::new();
    for (name, value) in options.as_object().into_iter().flatten() {
        let _ = writeln!(text, "- `{name}`: `{value}`");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::numbers;
    use crate::left_out::{OmissionCounts, OmissionReason};
    use crate::manifest::PairCounts;

    #[test]
    fn pairs_that_are_left_out_are_counted_by_reason() {
        let mut pairs = PairCounts {
            done: 1,
            left_out: 2,
            ..PairCounts::default()
        };
        let mut left_out = OmissionCounts::default();
        left_out.add(OmissionReason::WithoutResult);
        left_out.add(OmissionReason::Failed);
        assert_eq!(
            numbers(pairs, &left_out, None),
            "1 pair with a result, 2 left out by the selection (1 without a result, 1 failed by reviewers)"
        );
        (pairs.done, pairs.without_result, pairs.left_out) = (2, 1, 0);
        assert_eq!(
            numbers(pairs, &OmissionCounts::default(), None),
            "2 pairs with a result, 1 without"
        );
    }
}
