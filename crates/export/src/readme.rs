//! The README that is generated into every export.

use std::fmt::Write as _;

use super::format::ExportFormat;
use super::format_writer::{ExportContext, FormatGuide};
use super::manifest::PairCounts;

/// Name of the README.
pub(super) const README: &str = "README.md";
/// Name of the JSON Schema of a line.
pub(super) const SCHEMA: &str = "schema.json";

/// Frames and heights, which are the same in all exports.
const COORDINATES: &str = include_str!("../../../docs/reference/coordinates.md");

const CITATION: &str = "\
Cite the program as mocban (version above), and the method that it extends as arXiv:2411.05524. `export.json` holds all
settings, so that the export can be made again.
";

/// Returns the README of an export in one format.
pub(super) fn render(
    guide: &FormatGuide,
    format: ExportFormat,
    context: &ExportContext,
    pairs: PairCounts,
) -> String {
    let mut text = guide.front_matter.clone();
    let _ = write!(
        text,
        "# Aligned blocks and prints ({format})\n\n{}\n\n",
        guide.purpose
    );
    let _ = writeln!(
        text,
        "Made by {} with `export --to {format}`: {} pairs with a result, {} without, {} left out by the selection.\n",
        context.program, pairs.done, pairs.without_result, pairs.left_out
    );
    if pairs.set_apart > 0 {
        let _ = writeln!(
            text,
            "{} stored rows are damaged and not part of this export; `mocban check` lists them.\n",
            pairs.set_apart
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

/// Returns the options of an export as a list.
fn settings(context: &ExportContext) -> String {
    let options = serde_json::to_value(&context.options).expect("options are JSON");
    let mut text = String::new();
    for (name, value) in options.as_object().into_iter().flatten() {
        let _ = writeln!(text, "- `{name}`: `{value}`");
    }
    text
}
