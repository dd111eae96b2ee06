//! `import --block` and `import` of a list of blocks: adds whole blocks with their pages to the project.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::context::{Context, now};
use super::exit::Refusal;
use super::files;
use super::import::{ImportArgs, import_with};
use super::input_paths::on_disk;
use super::manifest_file::{missing_file, refuse};
use super::missing_files::MissingFiles;
use super::table::count;
use crate::catalog::{BlockAttributes, BlockImportSummary};
use crate::domain::BlockName;
use crate::manifest::{BlockRow, is_block_list, parse_blocks};
use crate::store::Project;

/// What an import of blocks changed.
#[derive(Debug)]
pub(super) struct BlockImportOutcome {
    summary: BlockImportSummary,
    missing: MissingFiles,
}

/// Blocks to import.
struct BlockListing {
    rows: Vec<BlockRow>,
    /// Label of row numbers in messages: `blocks.csv: line`, or `block` for a single one.
    label: String,
}

/// Returns whether the arguments name blocks, not pairs.
///
/// # Errors
/// Returns an error if the list cannot be read.
pub(super) fn are_blocks(args: &ImportArgs) -> anyhow::Result<bool> {
    if args.block.is_some() {
        return Ok(true);
    }
    match &args.file {
        Some(file) if !file.is_dir() => {
            let bytes = files::read(file)?;
            Ok(!files::is_jsonl(file, &bytes) && is_block_list(&bytes))
        }
        _ => Ok(false),
    }
}

/// Imports blocks. If the import fails, no block is imported.
///
/// # Errors
/// Returns an error if the list is refused, files are missing, or the catalog or the disk fails.
pub(super) async fn import_blocks(
    args: &ImportArgs,
    context: &Context,
) -> anyhow::Result<BlockImportOutcome> {
    if args.truth.is_some() {
        let text = "--truth holds true alignments of pairs, but blocks are imported";
        return Err(Refusal::Usage(text.to_owned()).into());
    }
    let mut listing = listing(args)?;
    let (storage, url) = context.data_locations()?;
    let project = Project::at(&context.dir()).with_storage(storage);
    if project.has_packs() {
        let text = "blocks cannot be imported into a project whose artifacts are in an object store (storage.artifacts), \
                    because the cut characters are files of the project; use a project without this setting";
        return Err(Refusal::Usage(text.to_owned()).into());
    }
    let mut missing = MissingFiles::default();
    for row in &mut listing.rows {
        locate(row, &listing.label, &project, &mut missing);
    }
    if missing.count > 0 && !args.allow_missing {
        return Err(missing.refusal().into());
    }
    let rows = listing.rows.iter().map(|row| stored_row(row, &project));
    let rows: Vec<BlockAttributes> = rows.collect::<Result<_, _>>()?;
    let summary = import_with(&project, url.as_deref(), async |catalog| {
        Ok(catalog.import_blocks(rows.clone(), now()).await?)
    });
    Ok(BlockImportOutcome {
        summary: summary.await?,
        missing,
    })
}

fn listing(args: &ImportArgs) -> anyhow::Result<BlockListing> {
    if let (Some(mesh), Some(page)) = (&args.block, &args.page) {
        return Ok(BlockListing {
            rows: vec![BlockRow {
                line: 1,
                name: name(args.name.as_deref(), mesh)?,
                mesh: mesh.clone(),
                page: page.clone(),
                labels: args.labels.clone(),
                unit: args.unit,
                side: args.side,
            }],
            label: "block".to_owned(),
        });
    }
    let Some(file) = &args.file else {
        anyhow::bail!("give a list of blocks, or --block and --page");
    };
    let mut rows = parse_blocks(&files::read(file)?).map_err(|problems| refuse(file, &problems))?;
    let folder = file.parent().unwrap_or(Path::new(""));
    for row in &mut rows {
        let paths = [&mut row.mesh, &mut row.page].into_iter();
        for path in paths.chain(row.labels.as_mut()) {
            *path = folder.join(&*path);
        }
    }
    Ok(BlockListing {
        rows,
        label: format!("{}: line", file.display()),
    })
}

/// Returns the given name, or the name of the mesh file without its extension.
fn name(given: Option<&str>, mesh: &Path) -> anyhow::Result<BlockName> {
    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
    BlockName::new(given.unwrap_or(&stem)).map_err(|error| {
        let text = format!("{}: {error}; give another one with --name", mesh.display());
        Refusal::Usage(text).into()
    })
}

/// Replaces the paths of a row by those on disk, and records missing files.
fn locate(row: &mut BlockRow, label: &str, project: &Project, missing: &mut MissingFiles) {
    let (line, name) = (row.line, row.name.clone());
    let required = [("mesh", &mut row.mesh), ("page", &mut row.page)].into_iter();
    for (kind, path) in required.chain(row.labels.as_mut().map(|path| ("labels", path))) {
        let is_below_root = path
            .to_str()
            .is_some_and(|path| project.is_below_root(path));
        if !is_below_root && let Some(found) = on_disk(path) {
            *path = found;
        }
        let found = missing_file(label, line, (kind, path), &name, project);
        found.into_iter().for_each(|line| missing.add(line));
    }
}

fn stored_row(row: &BlockRow, project: &Project) -> anyhow::Result<BlockAttributes> {
    let stored = |path: &PathBuf| project.stored_path(path);
    Ok(BlockAttributes {
        name: row.name.clone(),
        mesh_path: stored(&row.mesh)?,
        page_path: stored(&row.page)?,
        labels_path: row.labels.as_ref().map(stored).transpose()?,
        unit: row.unit,
        side: row.side,
    })
}

/// Prints what an import changed.
pub(super) fn print_outcome(outcome: &BlockImportOutcome, context: &Context) {
    for line in &outcome.missing.lines {
        context.warn(line);
    }
    let summary = &outcome.summary;
    context.info(&format!(
        "{} added, {} changed, {} unchanged",
        count(summary.added, "block"),
        summary.changed.len(),
        summary.unchanged
    ));
    for (name, fields) in &summary.changed {
        context.info(&format!("  {name}: {} changed", fields.join(", ")));
    }
}

pub(super) fn as_json(outcome: &BlockImportOutcome) -> Value {
    let summary = &outcome.summary;
    let changed = summary.changed.iter();
    let changed = changed.map(|(name, fields)| json!({"id": name, "fields": fields}));
    json!({
        "schema": 1,
        "blocks": {
            "added": summary.added,
            "changed": changed.collect::<Value>(),
            "unchanged": summary.unchanged,
        },
        "missing_files": outcome.missing.lines,
    })
}
