//! Finds input files that have changed since they were read. A file is hashed only if its size, modification time or
//! inode has changed.

use std::path::Path;

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use super::compute_thread::{run_blocking, task_result};
use super::error::RunError;
use crate::catalog::{Catalog, InputVersion, InputVersions, KnownInputs, PairSelection};
use crate::domain::{ContentHash, PairId};
use crate::store::{InputDigest, InputError, Project, hash_input, stat_input};

/// Pairs compared in one page.
const PAGE: usize = 1_000;

/// Stores the new versions of changed input files in the catalog. Files that no stage has read are skipped.
pub(super) async fn store_changes(
    project: &Project,
    catalog: &Catalog,
    among: Option<&PairSelection>,
) -> Result<(), RunError> {
    let mut page = catalog.known_inputs(None, PAGE, among).await?;
    while let Some(last) = page.last() {
        let after = Some(last.pair);
        let project = project.clone();
        let compare = move || -> Vec<_> {
            page.into_par_iter()
                .filter_map(|known| changes(&project, &known))
                .collect()
        };
        // Read the next page from the catalog while the files of this one are compared.
        let comparing = tokio::task::spawn_blocking(compare);
        page = catalog.known_inputs(after, PAGE, among).await?;
        let changed = task_result(comparing.await);
        if !changed.is_empty() {
            catalog.store_inputs(changed).await?;
        }
    }
    Ok(())
}

/// Stores the current input files of pairs that were quarantined because their workers died. The workers may not have
/// reported the files that they read. Later runs compare the files with these versions to notice a replacement.
pub(super) async fn store_of_poisoned(
    project: &Project,
    catalog: &Catalog,
    pairs: &[PairId],
) -> Result<(), RunError> {
    if pairs.is_empty() {
        return Ok(());
    }
    let among = PairSelection::of(pairs);
    let known = catalog
        .known_inputs(None, pairs.len(), Some(&among))
        .await?;
    let project = project.clone();
    let inputs = run_blocking(move || -> Vec<_> {
        let known = known.into_par_iter();
        known
            .map(|known| (known.pair, unread_inputs(&project, &known)))
            .collect()
    });
    Ok(catalog.record_poisoned_inputs(inputs.await).await?)
}

/// Returns the current state of the input files that no stage has reported.
fn unread_inputs(project: &Project, known: &KnownInputs) -> InputVersions {
    let current = |known: Option<&InputVersion>, stored: &str| match known {
        Some(_) => None,
        None => current(&project.input_path(stored)),
    };
    InputVersions {
        mesh: current(known.mesh.as_ref(), &known.mesh_path),
        print: current(known.print.as_ref(), &known.print_path),
    }
}

/// Returns the new versions of a pair's changed input files. Returns `None` if no file has changed.
fn changes(project: &Project, known: &KnownInputs) -> Option<(PairId, InputVersions)> {
    let changed = InputVersions {
        mesh: change(project, &known.mesh_path, known.mesh.as_ref()),
        print: change(project, &known.print_path, known.print.as_ref()),
    };
    (changed.mesh.is_some() || changed.print.is_some()).then_some((known.pair, changed))
}

/// Returns the current version of a file if it may differ from the known version. A missing file counts as changed only
/// if the manifest has named a new path since the file was read. Otherwise results computed from the file stay valid.
fn change(project: &Project, stored: &str, known: Option<&InputVersion>) -> Option<InputVersion> {
    let known = known?;
    let path = project.input_path(stored);
    match stat_input(&path) {
        Ok(stat) if stat == known.stat => None,
        Ok(_) => current(&path),
        Err(InputError::NotThere(_)) if known.stat.is_empty() => Some(InputVersion {
            hash: ContentHash::of(b""),
            stat: "gone".to_owned(),
        }),
        Err(_) => None,
    }
}

/// Returns the current state of a file. Returns `None` if it cannot be read.
pub(super) fn current(path: &Path) -> Option<InputVersion> {
    hash_input(path).ok().map(Into::into)
}

impl From<InputDigest> for InputVersion {
    fn from(read: InputDigest) -> Self {
        Self {
            hash: read.hash,
            stat: read.stat,
        }
    }
}
