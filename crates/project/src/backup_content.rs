//! What a backup holds, before a project is made of it.

use std::collections::HashSet;
use std::path::Path;
use std::time::UNIX_EPOCH;

use crate::backup::rows_of;
use crate::error::{ProjectError, ProjectResult, WithContext as _};
use crate::input_list::{InputCopies, InputList, inputs_folder};
use crate::input_places::InputPlaces;
use crate::restore::check_backup;
use crate::wanted_inputs::first_wanted_inputs;
use mocban_catalog::Catalog;
use mocban_core::domain::UnixMillis;
use mocban_store::Project;

/// Largest number of pairs whose files are looked for among the copies.
const MAX_COMPARED: usize = 100_000;
/// Most files that are named.
const MAX_NAMED: usize = 3;

/// What a backup holds. Scans and prints may be beside it; artifacts are in no backup.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BackupContent {
    /// Its length.
    pub bytes: u64,
    /// When its file was last written.
    pub written: Option<UnixMillis>,
    /// When the last attempt at a stage ended.
    pub last_activity: Option<UnixMillis>,
    /// Number of pairs.
    pub pairs: u64,
    /// Number of whole blocks.
    pub blocks: u64,
    /// Number of verdicts.
    pub verdicts: u64,
    /// Scans and prints beside it, which a restore copies.
    pub copies: Option<InputCopies>,
    /// Number of inputs of the first pairs and of all blocks that are not among the copies: they were missing or changed when
    /// the others were copied, or are in an object store.
    pub not_copied: u64,
    /// Paths of the first ones.
    pub first_not_copied: Vec<String>,
    /// What is wrong with their list, if it cannot be read. They are then found by their paths, and not copied.
    pub list_problem: Option<String>,
    /// Without copies or with a chosen folder, the scans and prints that a project in the new folder would find. Otherwise, none
    /// is looked at.
    pub inputs: InputPlaces,
}

/// Reads what a backup holds for a project in the folder `dir`, which need not exist. Scans and prints are looked for in the
/// folder `chosen`, if there is one. Writes nothing.
///
/// # Errors
/// Returns an error if the file is not a backup, or is damaged where it is read.
pub async fn backup_content(
    backup: &Path,
    dir: &Path,
    chosen: Option<&Path>,
) -> ProjectResult<BackupContent> {
    check_backup(backup)?;
    let meta = std::fs::metadata(backup);
    let meta = meta.with_context(|| format!("cannot read {}", backup.display()))?;
    let folder = inputs_folder(backup);
    let (list, list_problem) = match InputList::read_plainly(&folder) {
        Ok(list) => (list, None),
        Err(error) => (None, Some(error.text(dir))),
    };
    let list = list.filter(|list| !list.files.is_empty());
    let copies = list.as_ref().map(|list| list.copies(&folder));
    let catalog = Catalog::open_backup(backup).await?;
    let read = async {
        let (pairs, verdicts) = rows_of(&catalog).await?;
        let blocks = catalog.count_blocks().await?;
        let last_activity = catalog.last_activity().await?;
        let inputs = match copies {
            Some(_) if chosen.is_none() => InputPlaces::default(),
            _ => InputPlaces::of_backup(&Project::at(dir), &catalog, chosen).await?,
        };
        let (not_copied, first_not_copied) = match &list {
            Some(list) => missing_copies(list, &catalog).await?,
            None => (0, Vec::new()),
        };
        Ok::<_, ProjectError>(BackupContent {
            bytes: meta.len(),
            written: written(&meta),
            last_activity,
            pairs,
            blocks,
            verdicts,
            copies,
            not_copied,
            first_not_copied,
            list_problem,
            inputs,
        })
    };
    let content = read.await;
    catalog.close().await;
    content
}

/// Returns how many inputs of the catalog a list of copies does not have, among those of the first pairs and of all blocks,
/// and the paths of a few.
async fn missing_copies(list: &InputList, catalog: &Catalog) -> ProjectResult<(u64, Vec<String>)> {
    let copied: HashSet<&str> = list.files.iter().map(|copy| copy.stored.as_str()).collect();
    let (wanted, _) = first_wanted_inputs(catalog, MAX_COMPARED).await?;
    let (mut number, mut first) = (0, Vec::new());
    for input in wanted {
        if !copied.contains(input.stored.as_str()) {
            number += 1;
            if first.len() < MAX_NAMED {
                first.push(input.stored);
            }
        }
    }
    Ok((number, first))
}

/// Returns when a file was last written, if the file system knows.
pub fn written(meta: &std::fs::Metadata) -> Option<UnixMillis> {
    let since = meta.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    UnixMillis::try_from(since.as_millis()).ok()
}
