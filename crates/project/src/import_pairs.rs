//! Imports pairs of meshes and prints into a project, which is created if there is none.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{ProjectError, ProjectResult, TaskStopped};
use serde_json::{Value, json};
use tokio::sync::mpsc;

use crate::events::{Listener, LongWork};
use crate::exit::Refusal;
use crate::files;
use crate::location::{Location, now};
use crate::manifest_file::Listing;
use crate::missing_files::MissingFiles;
use crate::new_project::import_with;
use crate::truth_file::{self, TruthRow};
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

/// Where the pairs of an import are named.
#[derive(Debug)]
pub enum PairSource {
    /// In a CSV or JSON Lines file.
    List {
        /// Its path.
        file: PathBuf,
        /// Its content, if it was read already: it may be a pipe.
        bytes: Option<Vec<u8>>,
    },
    /// In two folders, paired by file stem.
    Folders {
        /// The folder of meshes.
        meshes: PathBuf,
        /// The folder of prints.
        prints: PathBuf,
        /// Unit of the meshes.
        unit: Option<LengthUnit>,
    },
}

/// Pairs to import, and how.
#[derive(Debug)]
pub struct PairImport {
    /// Where the pairs are named.
    pub source: PairSource,
    /// A file of true alignments, one JSON object per line.
    pub truth: Option<PathBuf>,
    /// Whether files may be missing; such pairs fail if they are run before the files exist.
    pub allow_missing: bool,
}

/// What an import changed.
#[derive(Debug)]
pub struct ImportOutcome {
    /// Pairs by what happened to them.
    pub summary: ImportSummary,
    /// Number of true alignments that were stored.
    pub truths: u64,
    /// Files that do not exist.
    pub missing: MissingFiles,
    /// Warnings about the list, one line each.
    pub warnings: Vec<String>,
}

/// Imports pairs. If the import fails, no pair is imported.
pub async fn import_pairs(
    import: PairImport,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<ImportOutcome> {
    let _work = LongWork::begin(listener, "importing");
    let mut listing = listing(import.source)?;
    let warnings = std::mem::take(&mut listing.warnings);
    let truths = match &import.truth {
        Some(file) => read_truths(file, &listing.ids, location).await?,
        None => Vec::new(),
    };
    let (storage, url) = location.data_locations()?;
    let project = Project::at(&location.dir).with_storage(storage);
    let truths = stored_truths(truths, &project)?;
    let list = Arc::new(ImportList {
        listing,
        truths,
        allow_missing: import.allow_missing,
    });
    let check = async || check_rows(&project, &list).await;
    let store = async |catalog: &Catalog| store_in(catalog, &project, &list).await;
    let (summary, truths, missing) = import_with(&project, url.as_deref(), check, store).await?;
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
) -> ProjectResult<StoredList> {
    let (sender, rows) = mpsc::channel(WAITING_CHUNKS);
    let (project, shared) = (project.clone(), Arc::clone(list));
    let sent = tokio::task::spawn_blocking(move || send_rows(&shared, &project, &sender));
    let stored = catalog.import_all(rows, list.truths.clone(), now()).await;
    // Return a row's error first, because the catalog then only reports that the list ended early.
    let missing = sent.await.map_err(|error| {
        ProjectError::from(TaskStopped(error)).context("the task that reads the list stopped")
    })??;
    let (summary, truths) = stored?;
    Ok((summary, truths, missing))
}

/// Refuses a list that [`store_in`] would refuse because of a file.
async fn check_rows(project: &Project, list: &Arc<ImportList>) -> ProjectResult<()> {
    // Nobody receives the rows.
    let (sender, _) = mpsc::channel(1);
    let (project, list) = (project.clone(), Arc::clone(list));
    let checked = tokio::task::spawn_blocking(move || send_rows(&list, &project, &sender));
    checked.await.map_err(TaskStopped)?.map(|_| ())
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
) -> ProjectResult<MissingFiles> {
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

fn listing(source: PairSource) -> ProjectResult<Listing> {
    match source {
        PairSource::List {
            file,
            bytes: Some(bytes),
        } => Listing::from_bytes(&file, bytes),
        PairSource::List { file, bytes: None } => Listing::from_file(&file),
        PairSource::Folders {
            meshes,
            prints,
            unit,
        } => Listing::from_folders(&meshes, &prints, unit),
    }
}

/// Reads true alignments. Refuses pairs that are neither in the list nor in the project.
async fn read_truths(
    file: &Path,
    listed: &RowIds,
    location: &Location,
) -> ProjectResult<Vec<TruthRow>> {
    let text = String::from_utf8(files::read(file)?)
        .map_err(|error| Refusal::Usage(format!("{}: {error}", file.display())))?;
    let truths =
        truth_file::parse(file, &text).map_err(|error| error.in_file(file, NOT_IMPORTED))?;
    let names = truths.iter().map(|truth| truth.name.clone());
    let others: Vec<PairName> = names.filter(|name| !listed.contains(name)).collect();
    if others.is_empty() {
        return Ok(truths);
    }
    let unknown = match location.open_read_only().await {
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
) -> ProjectResult<Vec<(PairName, Value)>> {
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

fn stored_row(row: &ManifestRow, project: &Project) -> ProjectResult<ImportRow> {
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
