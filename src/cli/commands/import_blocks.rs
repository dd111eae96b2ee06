//! `import --block` and `import` of a list of blocks: arguments and output.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_core::domain::{BlockSide, LengthUnit, any_case};
use mocban_project::import_blocks::{BlockImportOutcome, BlockSource, ImportedBlock};

/// Arguments of an import of one block.
#[derive(Debug, Default, Args)]
pub(crate) struct BlockArgs {
    /// The scan of a whole block, from which `run` cuts the characters as pairs
    #[arg(
        long,
        value_name = "MESH",
        requires = "page",
        conflicts_with = "meshes"
    )]
    pub(crate) block: Option<PathBuf>,
    /// The image of the printed page of --block
    #[arg(long, value_name = "IMAGE", requires = "block")]
    pub(crate) page: Option<PathBuf>,
    /// Boxes of the characters on --page, such as a project of the VGG Image Annotator [default: found by `run`]
    #[arg(long, value_name = "FILE", requires = "block")]
    pub(crate) labels: Option<PathBuf>,
    /// The side of --block that the page shows: front (towards the positive direction of the nearest axis of the mesh)
    /// or back [default: found by `run`]
    #[arg(long, requires = "block", value_parser = any_case::<BlockSide>)]
    pub(crate) side: Option<BlockSide>,
    /// Id of --block [default: the file name of the mesh without extension]
    #[arg(long, requires = "block")]
    pub(crate) name: Option<String>,
}

impl BlockArgs {
    /// Returns the block that the arguments name, if there is one.
    pub(crate) fn source(&self, unit: Option<LengthUnit>) -> Option<BlockSource> {
        let (Some(mesh), Some(page)) = (&self.block, &self.page) else {
            return None;
        };
        Some(BlockSource::One(ImportedBlock {
            mesh: mesh.clone(),
            page: page.clone(),
            labels: self.labels.clone(),
            side: self.side,
            name: self.name.clone(),
            unit,
        }))
    }
}

/// Prints what an import changed.
pub(crate) fn print_outcome(outcome: &BlockImportOutcome, context: &Context) {
    for line in &outcome.missing.lines {
        context.warn(line);
    }
    for line in &outcome.warnings {
        context.warn(line);
    }
    if let Some(renamed) = &outcome.renamed {
        context.info(renamed);
    }
    let summary = &outcome.summary;
    context.info(&format!(
        "{} added, {} changed, {} unchanged",
        count(summary.added, "block"),
        summary.changed.len(),
        summary.unchanged
    ));
    if summary.other_files > 0 {
        let blocks = count(summary.other_files, "block");
        context.info(&format!(
            "{blocks} with another scan, page or labels; the next run looks at them"
        ));
    }
    for (name, fields) in &summary.changed {
        context.info(&format!("  {name}: {} changed", fields.join(", ")));
    }
}

pub(crate) fn as_json(outcome: &BlockImportOutcome) -> Value {
    let summary = &outcome.summary;
    let changed = summary.changed.iter();
    let changed = changed.map(|(name, fields)| json!({"id": name, "fields": fields}));
    json!({
        "schema": 1,
        "blocks": {
            "added": summary.added,
            "changed": changed.collect::<Value>(),
            "other_files": summary.other_files,
            "unchanged": summary.unchanged,
        },
        "missing_files": outcome.missing.lines,
        "warnings": outcome.warnings,
        "renamed_columns": outcome.renamed,
    })
}
