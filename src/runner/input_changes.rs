//! Before a run: which input files are not what they were. Size, time and number first; only what moved is hashed.

use std::path::Path;

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use super::RunError;
use crate::catalog::{Catalog, InputVersion, InputVersions, KnownInputs, PairSelection};
use crate::domain::{ContentHash, PairId};
use crate::store::{InputError, Project, hash_input, stat_input};

/// Pairs looked at in one go.
const PAGE: usize = 1_000;

/// Brings the catalog's knowledge of input files up to date. Files that no stage has read yet are left to it.
pub(super) async fn inputs(
    project: &Project,
    catalog: &Catalog,
    among: Option<&PairSelection>,
) -> Result<(), RunError> {
    let mut page = catalog.known_inputs(None, PAGE, among).await?;
    while let Some(last) = page.last() {
        let after = Some(last.pair);
        let project = project.clone();
        let look = move || -> Vec<_> {
            page.into_par_iter()
                .filter_map(|known| changed(&project, &known))
                .collect()
        };
        // The next ones are read while the files of these are looked at.
        let looking = tokio::task::spawn_blocking(look);
        page = catalog.known_inputs(after, PAGE, among).await?;
        let moved = match looking.await {
            Ok(moved) => moved,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        };
        if !moved.is_empty() {
            catalog.store_inputs(moved).await?;
        }
    }
    Ok(())
}

/// Notes what the files of pairs are that killed their workers before any stage could tell.
pub(super) async fn poisoned(
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
    let look = move || -> Vec<_> {
        let look = |known: KnownInputs| (known.pair, unread(&project, &known));
        known.into_par_iter().map(look).collect()
    };
    let seen = match tokio::task::spawn_blocking(look).await {
        Ok(seen) => seen,
        Err(panic) => std::panic::resume_unwind(panic.into_panic()),
    };
    Ok(catalog.record_poisoned_inputs(seen).await?)
}

/// What the files are that no stage has told of.
fn unread(project: &Project, known: &KnownInputs) -> InputVersions {
    let look = |known: Option<&InputVersion>, stored: &str| match known {
        Some(_) => None,
        None => seen_now(&project.input_path(stored)),
    };
    InputVersions {
        mesh: look(known.mesh.as_ref(), &known.mesh_path),
        print: look(known.print.as_ref(), &known.print_path),
    }
}

/// What changed of a pair's files; `None` when nothing did.
fn changed(project: &Project, known: &KnownInputs) -> Option<(PairId, InputVersions)> {
    let seen = InputVersions {
        mesh: moved(project, &known.mesh_path, known.mesh.as_ref()),
        print: moved(project, &known.print_path, known.print.as_ref()),
    };
    (seen.mesh.is_some() || seen.print.is_some()).then_some((known.pair, seen))
}

/// What a file is now, when it is not what it was. A file that has gone is left alone: results made from it stand.
/// But where the manifest names another path than before, a file that is not there is no longer the old content.
fn moved(project: &Project, stored: &str, known: Option<&InputVersion>) -> Option<InputVersion> {
    let known = known?;
    let path = project.input_path(stored);
    match stat_input(&path) {
        Ok(stat) if stat.as_str() == known.stat => None,
        Ok(_) => seen_now(&path),
        Err(InputError::NotThere(_)) if known.stat.is_empty() => Some(InputVersion {
            hash: ContentHash::of(b""),
            stat: "gone".to_owned(),
        }),
        Err(_) => None,
    }
}

/// What a file is now; `None` when it cannot be read.
pub(super) fn seen_now(path: &Path) -> Option<InputVersion> {
    let (hash, stat) = hash_input(path).ok()?;
    let stat = stat.as_str().to_owned();
    Some(InputVersion { hash, stat })
}
