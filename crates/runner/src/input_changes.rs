//! Finds input files that have changed since they were read. A file is hashed only if its size, modification time or
//! inode has changed.

use std::path::PathBuf;

use super::error::RunError;
use super::input_reads::{ReadItem, ReadLimits, read_each};
use super::retry::retried;
use mocban_catalog::{Catalog, InputVersion, InputVersions, KnownInputs, PairSelection};
use mocban_core::domain::PairId;
use mocban_store::{Input, Project, hash_input, stat_input};

/// Pairs compared in one page.
const PAGE: usize = 1_000;

/// Stores the new versions of changed input files in the catalog. Skips files that no stage has read. A file counts as
/// unchanged if reading it fails or is ended by `limits`.
pub(super) async fn store_changes(
    project: &Project,
    catalog: &Catalog,
    selection: Option<&PairSelection>,
    limits: &ReadLimits,
) -> Result<(), RunError> {
    let read = async |after| retried!(catalog.known_inputs(after, PAGE, selection));
    let mut page = read(None).await?;
    while let Some(last) = page.last()
        && limits.stop.level() < limits.until
    {
        let after = Some(last.pair);
        let compared = page.into_iter().map(|known| ComparedInputs {
            project: project.clone(),
            known,
        });
        // Read the catalog's next page while the files of the current page are compared.
        let (changed, next) = tokio::join!(read_each(compared.collect(), limits), read(after));
        let changed: Vec<_> = changed.into_iter().flatten().flatten().collect();
        if !changed.is_empty() {
            retried!(catalog.store_inputs(changed.clone()))?;
        }
        page = next?;
    }
    Ok(())
}

/// Stores the versions of input files that no stage has read, for pairs that were quarantined because their workers
/// died or hung. A later run compares the files with these versions.
pub(super) async fn store_inputs_of_quarantined(
    project: &Project,
    catalog: &Catalog,
    pairs: &[PairId],
    limits: &ReadLimits,
) -> Result<(), RunError> {
    if pairs.is_empty() {
        return Ok(());
    }
    let number = pairs.len();
    tracing::info!(
        number,
        "pairs failed because their workers died or hung, several times or alone"
    );
    let selection = PairSelection::of(pairs);
    let known = retried!(catalog.known_inputs(None, pairs.len(), Some(&selection)))?;
    let unread = known.into_iter().map(|known| UnreadInputs {
        project: project.clone(),
        known,
    });
    let inputs = read_each(unread.collect(), limits).await;
    let inputs: Vec<_> = inputs.into_iter().flatten().collect();
    Ok(retried!(catalog.record_poisoned_inputs(inputs.clone()))?)
}

/// Returns the current versions of two files. Returns `None` for a file if reading it fails or is ended by `limits`.
pub(super) async fn current_of_both(
    inputs: [Input; 2],
    limits: &ReadLimits,
) -> [Option<InputVersion>; 2] {
    let files = inputs.into_iter().map(CurrentInput).collect();
    let mut found = read_each(files, limits)
        .await
        .into_iter()
        .map(Option::flatten);
    [found.next().flatten(), found.next().flatten()]
}

/// A pair whose input files are compared with the known ones.
struct ComparedInputs {
    project: Project,
    known: KnownInputs,
}

impl ReadItem for ComparedInputs {
    type Output = Option<(PairId, InputVersions)>;

    fn read(&self) -> Self::Output {
        changes(&self.project, &self.known)
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.known.mesh_path)
    }
}

/// A pair whose unread input files are hashed.
struct UnreadInputs {
    project: Project,
    known: KnownInputs,
}

impl ReadItem for UnreadInputs {
    type Output = (PairId, InputVersions);

    fn read(&self) -> Self::Output {
        (self.known.pair, unread_inputs(&self.project, &self.known))
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.known.mesh_path)
    }
}

/// A file that is hashed.
struct CurrentInput(Input);

impl ReadItem for CurrentInput {
    type Output = Option<InputVersion>;

    fn read(&self) -> Self::Output {
        current(&self.0)
    }

    fn path(&self) -> PathBuf {
        self.0.path().to_owned()
    }
}

/// Returns the current version of each input file without a known version.
fn unread_inputs(project: &Project, known: &KnownInputs) -> InputVersions {
    let current = |known: Option<&InputVersion>, stored: &str| match known {
        Some(_) => None,
        None => current(&project.input(stored)),
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
/// if an import has changed its path since the last read.
fn change(project: &Project, stored: &str, known: Option<&InputVersion>) -> Option<InputVersion> {
    let known = known?;
    let input = project.input(stored);
    match stat_input(&input) {
        Ok(stat) if stat == known.stat => None,
        Ok(_) => current(&input),
        Err(error) if error.is_correctable() && known.stat.is_empty() => Some(InputVersion::gone()),
        Err(_) => None,
    }
}

/// Returns the current version of a file, or `None` if the file cannot be read.
fn current(input: &Input) -> Option<InputVersion> {
    hash_input(input).ok()
}
