//! Copies catalog, verdicts and settings to one file, and scans and prints to a folder beside it. The copy is consistent even
//! during a run.

use std::fs::Metadata;
use std::io::ErrorKind;
use std::path::Path;

use crate::backup_inputs::{InputSaver, SavedInputs};
use crate::blocking::blocking;
use crate::error::{ProjectError, ProjectResult, WithContext as _};

use crate::events::{Listener, LongWork};
use crate::exit::Refusal;
use crate::files::{self, is_backup, metadata};
use crate::input_list::inputs_folder;
use crate::location::Location;
use crate::own_files::project_role;
use mocban_catalog::Catalog;
use mocban_store::{
    CATALOG_FILE, Project, SETTINGS_FILE, StagingFolder, TargetLock, rename_into_place,
};
use mocban_system::platform::stat;

/// What a backup holds.
#[derive(Debug, Clone)]
pub struct Backup {
    /// Its length.
    pub bytes: u64,
    /// Number of pairs.
    pub pairs: u64,
    /// Number of verdicts.
    pub verdicts: u64,
    /// Scans and prints beside it, if they were asked for.
    pub inputs: Option<SavedInputs>,
}

/// Writes a backup of a project, and if asked for its scans and prints to a folder beside it. An existing backup is replaced
/// only when the new one is complete. Scans and prints are copied after that, so that a disk that fails costs no backup.
///
/// # Errors
/// Refuses a place that something else has, and a disk without room for scans and prints, before more than a hidden copy of
/// the catalog is written.
pub async fn backup(
    file: &Path,
    with_inputs: bool,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<Backup> {
    let work = LongWork::begin(listener, "copying the catalog");
    let (project, catalog) = location.open_read_only().await?;
    let shown = file.display();
    let failed = || format!("cannot write the backup {shown}");
    check_target(file, &project)?;
    files::create_parent(file)?;
    let _lock = TargetLock::acquire(file).with_context(failed)?;
    let settings = files::small(&project.settings_path())?;
    let staging = StagingFolder::beside(file).with_context(failed)?;
    let copy = staging.path().join(CATALOG_FILE);
    let copied = catalog.back_up(&copy, settings.as_deref()).await;
    copied.with_context(failed)?;
    catalog.close().await;
    let (pairs, verdicts) = count_rows(staging.path()).await.with_context(failed)?;
    let saver = if with_inputs {
        Some(InputSaver::plan(&copy, &project, inputs_folder(file)).await?)
    } else {
        None
    };
    // Somebody may have created the file in the meantime.
    check_target(file, &project)?;
    let begin = |saver: InputSaver| saver.begin().map(|copier| (saver, copier));
    let saver = saver.map(begin).transpose()?;
    rename_into_place(&copy, file).with_context(failed)?;
    let bytes = std::fs::metadata(file).with_context(failed)?.len();
    // A folder that a kill leaves from here on is that of the scans and prints.
    drop(staging);
    drop(work);
    let inputs = match saver {
        None => None,
        Some((saver, copier)) => {
            let _work = LongWork::begin(listener, "copying the scans and prints");
            let save = move || saver.save(&copier);
            let saved = blocking(save).await?;
            Some(saved.with_context(|| {
                format!("the backup {shown} is complete, but not its scans and prints")
            })?)
        }
    };
    Ok(Backup {
        bytes,
        pairs,
        verdicts,
        inputs,
    })
}

/// Returns the numbers of pairs and verdicts in the catalog of a directory. Errors name that catalog.
pub(crate) async fn count_rows(dir: &Path) -> ProjectResult<(u64, u64)> {
    let count = async {
        let catalog = Catalog::open_read_only(&dir.join(CATALOG_FILE)).await?;
        let counted = rows_of(&catalog).await?;
        catalog.close().await;
        Ok(counted)
    };
    count
        .await
        .map_err(|error: ProjectError| ProjectError::unexpected(error.text(dir)))
}

/// Returns the numbers of pairs and verdicts in a catalog.
pub(crate) async fn rows_of(catalog: &Catalog) -> ProjectResult<(u64, u64)> {
    let verdicts = catalog.count_verdicts().await?;
    let pairs = catalog.counters().await?.values().sum();
    Ok((pairs, verdicts))
}

/// Refuses a target that exists and is not a backup.
fn check_target(file: &Path, project: &Project) -> ProjectResult<()> {
    let shown = file.display();
    let refuse = |reason: &str| Err(Refusal::Usage(format!("{shown} {reason}")).into());
    let failed = || format!("cannot read {shown}");
    let found = metadata(file).with_context(failed)?;
    let is_named = |known: &str| file.file_name().is_some_and(|name| name == known);
    // The parent of a bare file name is empty.
    let parent = Path::new(".").join(file.parent().unwrap_or(file));
    // The catalog and the settings of this project may be elsewhere.
    let is_here =
        [CATALOG_FILE, SETTINGS_FILE].into_iter().any(is_named) && is_same(&parent, project.dir())?;
    let role = if is_here || is_same(file, &project.catalog_path())? {
        Some("is a file of a project")
    } else {
        project_role(file)
    };
    if let Some(role) = role {
        return refuse(&format!("{role}; name another file for the backup"));
    }
    if file.file_name().is_none() || found.as_ref().is_some_and(Metadata::is_dir) {
        return refuse("is a directory; name a file for the backup");
    }
    match found {
        None => Ok(()),
        Some(meta) if meta.len() == 0 && meta.is_file() => Ok(()),
        Some(_) if is_backup(file).with_context(failed)? => Ok(()),
        Some(_) => refuse("exists and is not a backup; name another file"),
    }
}

/// Returns whether two paths name the same existing file or folder.
fn is_same(one: &Path, other: &Path) -> ProjectResult<bool> {
    let identity = |path: &Path| match stat(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        found => found
            .map(|found| Some(found.id))
            .with_context(|| format!("cannot read {}", path.display())),
    };
    let one = identity(one)?;
    Ok(one.is_some() && one == identity(other)?)
}
