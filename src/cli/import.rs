//! `import`: adds pairs of meshes and prints, or whole blocks, to the project, and creates the project if there is
//! none.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context as _;
use clap::Args;
use serde_json::{Value, json};
use tokio::sync::mpsc;

use super::busy::Busy;
use super::context::{Context, now};
use super::exit::{ExitCode, Refusal};
use super::files;
use super::import_blocks::{self, BlockArgs, Imported};
use super::manifest_file::Listing;
use super::missing_files::MissingFiles;
use super::new_project::import_with;
use super::table::count;
use super::truth_file::{self, TruthRow};
use mocban_catalog::{Catalog, ImportChunk, ImportRow, ImportSummary};
use mocban_core::domain::{LengthUnit, PairName};
use mocban_lists::manifest::{ManifestRow, RowIds};
use mocban_store::Project;

/// Maximum number of rows of a chunk that is sent to the catalog, and of the chunks that may wait there.
const CHUNK_ROWS: usize = 2_000;
const WAITING_CHUNKS: usize = 2;
/// A chunk ends with the row that reaches this many bytes of memory.
const CHUNK_BYTES: usize = 2 << 20;

/// End of the message when the file of true alignments is refused.
const NOT_IMPORTED: &str = "nothing was imported";

/// The three ways to name what is imported.
const USAGE: &str = "mocban import [OPTIONS] FILE
       mocban import [OPTIONS] --meshes DIR --prints DIR
       mocban import [OPTIONS] --block MESH --page IMAGE";

/// Arguments of `import`.
#[derive(Debug, Default, Args)]
#[command(override_usage = USAGE)]
pub(super) struct ImportArgs {
    /// A CSV or JSON Lines file with the columns id, mesh, print and optionally character, block, unit,
    /// `scanned_face_down`; or a CSV file of whole blocks with the columns block, mesh, page and optionally labels,
    /// unit, side; paths are relative to the file
    #[arg(required_unless_present_any = ["meshes", "block"], conflicts_with_all = ["meshes", "block"])]
    pub(super) file: Option<PathBuf>,
    /// A directory of meshes, paired with --prints by file stem
    #[arg(long, value_name = "DIR", requires = "prints")]
    pub(super) meshes: Option<PathBuf>,
    /// A directory of prints
    #[arg(long, value_name = "DIR", requires = "meshes")]
    pub(super) prints: Option<PathBuf>,
    #[command(flatten)]
    pub(super) block: BlockArgs,
    /// Unit of the meshes in --meshes or of --block: mm, cm, m or in
    #[arg(long, conflicts_with = "file")]
    pub(super) unit: Option<LengthUnit>,
    /// True alignments, one JSON object per line; the report then gives the errors against them
    #[arg(long, value_name = "FILE")]
    pub(super) truth: Option<PathBuf>,
    /// Import pairs whose files do not exist yet; they fail if they are run before
    #[arg(long)]
    pub(super) allow_missing: bool,
}

pub(super) async fn import(args: ImportArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let list = match Imported::of(args.file.as_deref(), &args.block, args.unit)? {
        Imported::Blocks(source) => {
            refuse_truths(&args)?;
            let busy = Busy::start(context, "importing");
            let outcome = import_blocks::import_blocks(&source, args.allow_missing, context).await;
            drop(busy);
            let outcome = outcome?;
            context.print_json(&import_blocks::as_json(&outcome))?;
            import_blocks::print_outcome(&outcome, context);
            context.next("run");
            return Ok(ExitCode::Done);
        }
        Imported::Pairs(list) => list,
    };
    let busy = Busy::start(context, "importing");
    let outcome = import_pairs(&args, list, context).await;
    drop(busy);
    let outcome = outcome?;
    context.print_json(&as_json(&outcome))?;
    print_outcome(&outcome, context);
    context.next("run");
    Ok(ExitCode::Done)
}

/// Refuses true alignments of pairs in an import of blocks.
fn refuse_truths(args: &ImportArgs) -> anyhow::Result<()> {
    if args.truth.is_none() {
        return Ok(());
    }
    let text = "--truth holds true alignments of pairs, but blocks are imported";
    Err(Refusal::Usage(text.to_owned()).into())
}

/// What an import changed.
#[derive(Debug)]
pub(super) struct ImportOutcome {
    pub(super) summary: ImportSummary,
    pub(super) truths: u64,
    missing: MissingFiles,
    warnings: Vec<String>,
}

/// Imports pairs. If the import fails, no pair is imported. `list` is the content of the list, if it was read already.
///
/// # Errors
/// Returns an error if a list is refused, or the catalog or the disk fails.
pub(super) async fn import_pairs(
    args: &ImportArgs,
    list: Option<Vec<u8>>,
    context: &Context,
) -> anyhow::Result<ImportOutcome> {
    let mut listing = listing(args, list)?;
    let warnings = std::mem::take(&mut listing.warnings);
    let truths = match &args.truth {
        Some(file) => read_truths(file, &listing.ids, context).await?,
        None => Vec::new(),
    };
    let (storage, url) = context.data_locations()?;
    let project = Project::at(&context.dir()).with_storage(storage);
    let truths = stored_truths(truths, &project)?;
    let list = Arc::new(ImportList {
        listing,
        truths,
        allow_missing: args.allow_missing,
    });
    let check = async || check_rows(&project, &list).await;
    let import = async |catalog: &Catalog| store_in(catalog, &project, &list).await;
    let (summary, truths, missing) = import_with(&project, url.as_deref(), check, import).await?;
    Ok(ImportOutcome {
        summary,
        truths,
        missing,
        warnings,
    })
}

/// What to import.
struct ImportList {
    listing: Listing,
    truths: Vec<(PairName, Value)>,
    /// Whether files may be missing.
    allow_missing: bool,
}

/// The summary of an import, the number of stored true alignments, and the missing files.
type StoredList = (ImportSummary, u64, MissingFiles);

/// Imports the list into a catalog.
async fn store_in(
    catalog: &Catalog,
    project: &Project,
    list: &Arc<ImportList>,
) -> anyhow::Result<StoredList> {
    let (sender, rows) = mpsc::channel(WAITING_CHUNKS);
    let (project, shared) = (project.clone(), Arc::clone(list));
    let sent = tokio::task::spawn_blocking(move || send_rows(&shared, &project, &sender));
    let stored = catalog.import_all(rows, list.truths.clone(), now()).await;
    // Return a row's error first, because the catalog then only reports that the list ended early.
    let missing = sent
        .await
        .context("the task that reads the list stopped")??;
    let (summary, truths) = stored?;
    Ok((summary, truths, missing))
}

/// Refuses a list that [`store_in`] would refuse because of a file.
async fn check_rows(project: &Project, list: &Arc<ImportList>) -> anyhow::Result<()> {
    // Nobody receives the rows.
    let (sender, _) = mpsc::channel(1);
    let (project, list) = (project.clone(), Arc::clone(list));
    let checked = tokio::task::spawn_blocking(move || send_rows(&list, &project, &sender));
    checked.await?.map(|_| ())
}

/// Sends the rows to the catalog in chunks. Returns the missing files.
///
/// # Errors
/// Returns an error if files are missing that must exist, or the path of a file cannot be stored. The catalog then
/// imports nothing.
fn send_rows(
    list: &ImportList,
    project: &Project,
    sender: &mpsc::Sender<ImportChunk>,
) -> anyhow::Result<MissingFiles> {
    let (mut missing, mut chunk, mut bytes) = (MissingFiles::default(), Vec::new(), 0);
    let mut outcome = Ok(());
    list.listing.rows(project, |row, lines| {
        for line in lines {
            missing.add(line);
        }
        match stored_row(&row, project) {
            Ok(row) => {
                bytes += memory(&row);
                chunk.push(row);
            }
            Err(error) if outcome.is_ok() => outcome = Err(error),
            Err(_) => {}
        }
        if chunk.len() == CHUNK_ROWS || bytes >= CHUNK_BYTES {
            // The catalog stops receiving after an error, which it reports itself.
            let _ = sender.blocking_send(ImportChunk::Rows(std::mem::take(&mut chunk)));
            bytes = 0;
        }
    });
    outcome?;
    if missing.count > 0 && !list.allow_missing {
        return Err(missing.refusal().into());
    }
    for last in [ImportChunk::Rows(chunk), ImportChunk::End] {
        let _ = sender.blocking_send(last);
    }
    Ok(missing)
}

fn listing(args: &ImportArgs, list: Option<Vec<u8>>) -> anyhow::Result<Listing> {
    match (&args.file, &args.meshes, &args.prints) {
        (Some(file), ..) => match list {
            Some(bytes) => Listing::from_bytes(file, bytes),
            None => Listing::from_file(file),
        },
        (None, Some(meshes), Some(prints)) => Listing::from_folders(meshes, prints, args.unit),
        (None, ..) => anyhow::bail!("give a manifest, or --meshes and --prints"),
    }
}

/// Reads true alignments. Refuses pairs that are neither in the list nor in the project.
async fn read_truths(
    file: &Path,
    listed: &RowIds,
    context: &Context,
) -> anyhow::Result<Vec<TruthRow>> {
    let text = String::from_utf8(files::read(file)?)
        .map_err(|error| Refusal::Usage(format!("{}: {error}", file.display())))?;
    let truths =
        truth_file::parse(file, &text).map_err(|error| error.in_file(file, NOT_IMPORTED))?;
    let names = truths.iter().map(|truth| truth.name.clone());
    let others: Vec<PairName> = names.filter(|name| !listed.contains(name)).collect();
    if others.is_empty() {
        return Ok(truths);
    }
    let unknown = match context.open_read_only().await {
        Ok((_, catalog)) => {
            let unknown = catalog.unknown_names(&others).await?;
            catalog.close().await;
            unknown
        }
        Err(_) => others,
    };
    match truths.iter().find(|truth| unknown.contains(&truth.name)) {
        Some(truth) => Err(truth_file::unknown_pair(truth)
            .in_file(file, NOT_IMPORTED)
            .into()),
        None => Ok(truths),
    }
}

/// Converts true alignments to their stored form. A `tops_mask` below the project's directory is stored relative to it,
/// like the paths of inputs.
fn stored_truths(
    truths: Vec<TruthRow>,
    project: &Project,
) -> anyhow::Result<Vec<(PairName, Value)>> {
    truths
        .into_iter()
        .map(|mut truth| {
            if let Some(mask) = &truth.tops_mask {
                truth.value["tops_mask"] = json!(project.stored_path(mask)?);
            }
            Ok((truth.name, truth.value))
        })
        .collect()
}

fn stored_row(row: &ManifestRow, project: &Project) -> anyhow::Result<ImportRow> {
    Ok(ImportRow {
        name: row.name.clone(),
        mesh_path: project.stored_path(&row.mesh)?,
        print_path: project.stored_path(&row.print)?,
        unit: row.unit,
        scanned_face_down: row.scanned_face_down,
        character: row.character.clone(),
        block: row.block.clone(),
        meta: row.meta.clone().into_iter().collect(),
        prior: None,
    })
}

/// Returns roughly the memory that a row needs, in bytes.
fn memory(row: &ImportRow) -> usize {
    let cells = [&row.character, &row.block].into_iter().flatten();
    let meta = row.meta.iter();
    size_of::<ImportRow>()
        + row.mesh_path.len()
        + row.print_path.len()
        + cells.map(String::len).sum::<usize>()
        + meta
            .map(|(key, value)| key.len() + value_memory(value))
            .sum::<usize>()
}

/// Returns roughly the memory that a JSON value needs, in bytes. A number of one digit needs much more than its text.
fn value_memory(value: &Value) -> usize {
    size_of::<Value>()
        + match value {
            Value::Null | Value::Bool(_) | Value::Number(_) => 0,
            Value::String(text) => text.len(),
            Value::Array(values) => values.iter().map(value_memory).sum(),
            Value::Object(entries) => entries
                .iter()
                .map(|(key, value)| size_of::<String>() + key.len() + value_memory(value))
                .sum(),
        }
}

/// Prints what an import changed, after its warnings.
pub(super) fn print_outcome(outcome: &ImportOutcome, context: &Context) {
    const MAX_WARNINGS: usize = 20;
    const MAX_CHANGES: usize = 10;
    for line in outcome.missing.lines.iter().take(MAX_WARNINGS) {
        context.warn(line);
    }
    if let Some(more) = outcome.missing.count.checked_sub(MAX_WARNINGS + 1) {
        context.warn(&format!("{} more files do not exist", more + 1));
    }
    for line in &outcome.warnings {
        context.warn(line);
    }
    let summary = &outcome.summary;
    let truths = match outcome.truths {
        0 => String::new(),
        truths => format!("; {} stored", count(truths, "true alignment")),
    };
    context.info(&format!(
        "{} added, {} changed, {} unchanged{truths}",
        count(summary.added, "pair"),
        summary.changed.len(),
        summary.unchanged
    ));
    for change in summary.changed.iter().take(MAX_CHANGES) {
        let fields = change.fields.join(", ");
        context.info(&format!("  {}: {fields} changed", change.name));
    }
    if let Some(more) = summary.changed.len().checked_sub(MAX_CHANGES + 1) {
        context.info(&format!("  and {} more", more + 1));
    }
}

fn as_json(outcome: &ImportOutcome) -> Value {
    let summary = &outcome.summary;
    let changed = summary.changed.iter();
    let changed = changed.map(|change| json!({"id": change.name, "fields": change.fields}));
    json!({
        "schema": 1,
        "added": summary.added,
        "changed": changed.collect::<Value>(),
        "unchanged": summary.unchanged,
        "truths": outcome.truths,
        "missing_files": outcome.missing.lines,
        "more_missing_files": outcome.missing.count - outcome.missing.lines.len(),
        "warnings": outcome.warnings,
    })
}
