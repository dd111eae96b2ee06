//! Imports pairs of meshes and prints into a project, which is created if there is none.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use crate::blocking::blocking;
use crate::empty_import;
use crate::error::{ProjectResult, WithContext as _};
use serde_json::{Value, json};
use tokio::sync::mpsc;

use crate::events::{Listener, LongWork};
use crate::exit::Refusal;
use crate::files;
use crate::location::{Location, now};
use crate::lost_values::lost_values;
use crate::manifest_file::{ListedRows, Listing, list_content};
use crate::missing_files::MissingFiles;
use crate::new_project::{import_with, warn_about_name};
use crate::pair_choices::PairChoices;
use crate::row_spool::RowSpool;
use crate::truth_file::{self, TruthRow};
use mocban_catalog::{Catalog, ImportRow, ImportSummary, ImportTerms, SameFiles};
use mocban_core::domain::cancel::{ThreadToken, poll};
use mocban_core::domain::{LengthUnit, PairName};
use mocban_core::locked;
use mocban_lists::manifest::{ManifestRow, RowIds};
use mocban_store::{Project, StoredPaths};
use mocban_system::failpoint::{self, Point};

/// Maximum number of chunks of rows that wait for the catalog.
const WAITING_CHUNKS: usize = 2;

/// End of the message when the file of true alignments is refused.
const NOT_IMPORTED: &str = "nothing was imported";

/// Refuses other pairs than were shown.
const CHANGED: &str = "the files or the list changed after the pairs were shown; nothing was imported: look at the pairs again";

/// Refuses an import without pairs.
const ALL_LEFT_OUT: &str = "all pairs are left out, so there is nothing to import";

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
    /// What is accepted.
    pub allowed: AllowedChanges,
    /// What a person chose before.
    pub choices: PairChoices,
}

/// Changes that an import makes only if the user allows them.
#[derive(Debug, Clone, Copy, Default)]
pub struct AllowedChanges {
    /// Whether files may be missing; such pairs and blocks fail if they are run before the files exist.
    pub missing: bool,
    /// Whether most known pairs or blocks may get other files.
    pub files: bool,
    /// Whether pairs that the list does not have are retired.
    pub replace: bool,
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
    /// Which columns of the list were read under other names.
    pub renamed: Option<String>,
}

/// Imports pairs. If the import fails, or its future is dropped, no pair is imported. Looking at the files polls for a
/// cancellation.
pub async fn import_pairs(
    import: PairImport,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<ImportOutcome> {
    let _work = LongWork::begin(listener, "importing");
    let is_of_folders = matches!(import.source, PairSource::Folders { .. });
    let mut listing = listing(import.source, &import.choices)?;
    if let Some(why) = listing.no_pair.take() {
        return Err(why.into());
    }
    let mut warnings = std::mem::take(&mut listing.warnings);
    let renamed = listing.renamed.take();
    let truths = match &import.truth {
        Some(file) if listing.refused.is_none() => {
            let truths = read_truths(file, &listing.ids, location).await?;
            warnings.extend(truth_file::unread_fields(file, &truths));
            truths
        }
        Some(_) | None => Vec::new(),
    };
    let (storage, url) = location.data_locations()?;
    let project = Project::at(&location.dir).with_storage(storage);
    warn_about_name(project.dir(), listener);
    let truths = stored_truths(truths, &project)?;
    // The files are looked at before the catalog is locked, because a disk may be slow and a list long.
    let looked_at = project.clone();
    let token = ThreadToken::current();
    let spooled = blocking(move || {
        token.scope(|| spool(&listing, &looked_at, import.allowed, &import.choices))
    });
    let (rows, missing, unusable) = spooled.await??;
    warnings.extend(unusable);
    let (rows, terms) = (
        Arc::new(Mutex::new(rows)),
        ImportTerms {
            truths,
            changed_files: import.allowed.files,
            replace: import.allowed.replace,
            keep_columns: is_of_folders,
        },
    );
    let store = async |catalog: &Catalog| store_in(catalog, &rows, terms.clone()).await;
    let (summary, truths) = import_with(&project, url.as_deref(), store).await?;
    let same_files = summary.same_files.as_ref().map(
        |SameFiles { id, known, count }| {
            format!("pairs with the same mesh and print as one of the project: {count}, first {id}, as {known}")
        },
    );
    warnings.extend(same_files);
    warnings.extend(lost_values(&summary.lost, "pair"));
    if summary.added == 0 {
        warnings.extend(empty_import::note(&project, now()));
    }
    Ok(ImportOutcome {
        summary,
        truths,
        missing,
        warnings,
        renamed,
    })
}

/// Imports the rows into a catalog. Returns the summary and the number of stored true alignments.
async fn store_in(
    catalog: &Catalog,
    rows: &Arc<Mutex<RowSpool>>,
    terms: ImportTerms,
) -> ProjectResult<(ImportSummary, u64)> {
    let (sender, chunks) = mpsc::channel(WAITING_CHUNKS);
    let rows = Arc::clone(rows);
    let sent = blocking(move || {
        let mut rows = locked(&rows);
        rows.send(&sender)
    });
    let stored = catalog.import_all(chunks, terms, now()).await;
    // Return the error of reading first, because the catalog then only reports that the list ended early.
    let sent = sent.await?;
    sent.with_context(|| "cannot read the temporary file of the list".to_owned())?;
    Ok(stored?)
}

/// Looks at the files of all rows. Returns the rows as they are stored, the missing files, and warnings about files that
/// cannot be inputs.
///
/// # Errors
/// Returns an error if files are missing that must exist, if the path of a file cannot be stored, or if there is no space
/// for a temporary file.
fn spool(
    listing: &Listing,
    project: &Project,
    allowed: AllowedChanges,
    choices: &PairChoices,
) -> ProjectResult<(RowSpool, MissingFiles, Vec<String>)> {
    let failed = || "cannot write a temporary file for the list".to_owned();
    let mut spool = RowSpool::new().with_context(failed)?;
    let mut paths = StoredPaths::new(project)?;
    let mut missing = MissingFiles::default();
    let mut outcome = Ok(());
    let mut count = 0_u64;
    let ListedRows { hash, unusable } = listing.rows(project, |mut row, lines| {
        poll();
        count += 1;
        choices.add_block(&mut row);
        failpoint::hit("import", Point::Computed, Some(&row.name));
        for line in lines {
            missing.add(line);
        }
        if outcome.is_ok() {
            outcome =
                stored_row(&row, &mut paths).and_then(|row| spool.push(&row).with_context(failed));
        }
    });
    if let Some(refused) = &listing.refused {
        return Err(missing.added_to(refused, allowed.missing).into());
    }
    outcome?;
    let is_other = |shown| shown != hash;
    if choices.shown.is_some_and(is_other) {
        return Err(Refusal::Usage(CHANGED.to_owned()).into());
    }
    if count == 0 {
        return Err(Refusal::Usage(ALL_LEFT_OUT.to_owned()).into());
    }
    if missing.count > 0 && !allowed.missing {
        return Err(missing.refusal().into());
    }
    Ok((spool, missing, unusable))
}

/// Reads what a source names, as a person has chosen.
pub(crate) fn listing(source: PairSource, choices: &PairChoices) -> ProjectResult<Listing> {
    match source {
        PairSource::List { file, bytes } => {
            let bytes = bytes.map_or_else(|| list_content(&file), Ok)?;
            Listing::from_bytes(&file, bytes, choices)
        }
        PairSource::Folders {
            meshes,
            prints,
            unit,
        } => Listing::from_folders(&meshes, &prints, unit, &choices.changes),
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
    let (unknown, known) = match location.open_read_only().await {
        Ok((_, catalog)) => {
            let unknown = catalog.unknown_names(&others).await?;
            let known = match unknown.as_slice() {
                [] => Vec::new(),
                _ => catalog.pair_names().await?,
            };
            catalog.close().await;
            (unknown, known)
        }
        Err(_) => (others, Vec::new()),
    };
    match truths.iter().find(|truth| unknown.contains(&truth.name)) {
        Some(truth) => Err(truth_file::unknown_pair(truth, &known)
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

fn stored_row(row: &ManifestRow, paths: &mut StoredPaths<'_>) -> ProjectResult<ImportRow> {
    Ok(ImportRow {
        name: row.name.clone(),
        mesh_path: paths.stored(&row.mesh)?,
        print_path: paths.stored(&row.print)?,
        unit: row.unit,
        scanned_face_down: row.scanned_face_down,
        character: row.character.clone(),
        block: row.block.clone(),
        meta: row.meta.clone().into_iter().collect(),
        prior: None,
    })
}
