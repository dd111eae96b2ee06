//! Makes a project of a backup.

use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::error::{ProjectError, ProjectResult, WithContext as _};

use crate::backup::count_rows;
use crate::events::{Listener, LongWork, warn};
use crate::exit::Refusal;
use crate::files::{self, is_backup, metadata};
use crate::input_finder::finder_in;
use crate::input_list::{InputCopies, has_list, inputs_folder};
use crate::location::Location;
use crate::missing_inputs::{self, MissingInputs};
use crate::new_project::{check_new_folder, warn_about_name};
use crate::restore_inputs::{ListedCopies, ProjectCopies, locate_inputs};
use mocban_catalog::Catalog;
use mocban_config::{LocalSettings, make_local};
use mocban_core::domain::{ErrorCode, FileKind, pointer_of};
use mocban_store::{
    CATALOG_FILE, NewFolder, Project, ProjectStorage, SETTINGS_FILE, StagingFolder, TargetLock,
    place_new_file, write_synced,
};

/// A backup to restore.
#[derive(Debug)]
pub struct RestoreRequest {
    /// The backup.
    pub backup: PathBuf,
    /// The project folder to create; it may hold meshes and prints already.
    pub dir: PathBuf,
    /// A folder where meshes and prints are looked for that are no longer at their old places. `None` to copy those beside
    /// the backup into the project, if there are any.
    pub inputs: Option<PathBuf>,
}

/// What a restored project holds.
#[derive(Debug)]
pub struct Restored {
    /// Number of pairs.
    pub pairs: u64,
    /// Number of verdicts.
    pub verdicts: u64,
    /// Settings of the backup, made local.
    pub settings: Option<LocalSettings>,
    /// Scans and prints that are now in the project, and the folder beside the backup that they were copied from.
    pub copied: Option<InputCopies>,
    /// The folder of the project that they were copied to; `None` if the project had all of them.
    pub copied_to: Option<PathBuf>,
    /// Number of scans and prints that are read at their old places, because the folder beside the backup has no whole copy.
    pub elsewhere: u64,
    /// Paths of meshes and prints that neither `--inputs` nor the folder beside the backup has.
    pub missing: Vec<String>,
    /// Without such a folder, files that are not at their old places.
    pub not_in_place: Option<MissingInputs>,
}

/// Makes a project of a backup. Everything that can refuse it is checked before more than a hidden copy of the catalog is
/// written. `location` has the settings of the environment and of flags, which must not lead the new project to a server.
///
/// # Errors
/// Returns an error if the backup, the folders or the settings are refused, or the disk fails. Then there is no project.
pub async fn restore(
    request: &RestoreRequest,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<Restored> {
    let _work = LongWork::begin(listener, "restoring the project");
    let RestoreRequest {
        backup,
        dir,
        inputs,
    } = request;
    check_backup(backup)?;
    if let Some(inputs) = inputs {
        check_inputs(inputs)?;
    }
    check_directory(&Project::at(dir))?;
    check_new_folder(dir)?;
    warn_about_name(dir, listener);
    location.at(dir).require_local("the restored project")?;
    let copies = match inputs {
        Some(_) => None,
        None => ListedCopies::beside(backup)?,
    };
    if copies.is_none() {
        warn_about_unlisted(backup, inputs.as_deref(), listener);
    }
    let is_copied = copies.is_some();
    let existed = dir.exists();
    let mut restored = restore_into(request, location, copies, listener).await;
    if let (Ok(restored), None, false) = (&mut restored, inputs, is_copied) {
        // The project is there already, so what cannot be looked up is no error.
        if let Ok((project, catalog)) = location.at(dir).open_read_only().await {
            let missing = missing_inputs::missing(&project, &catalog, restored.pairs).await;
            restored.not_in_place = missing.ok().flatten();
            catalog.close().await;
        }
    }
    if restored.is_err() && !existed {
        // Fails unless the directory is empty.
        let _ = std::fs::remove_dir(dir);
    }
    restored
}

/// Returns whether a folder may become a project that is restored: it does not exist, is empty, or has only what an
/// interrupted restore left.
pub fn is_free(dir: &Path) -> ProjectResult<bool> {
    let failed = || format!("cannot read {}", dir.display());
    let entries = match std::fs::read_dir(dir) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(true),
        Err(error) if error.kind() == ErrorKind::NotADirectory => return Ok(false),
        entries => entries.with_context(failed)?,
    };
    for entry in entries {
        let entry = entry.with_context(failed)?;
        if !is_left_over(&entry.file_name()) && !has_list(&entry.path()) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Returns whether an interrupted restore leaves an entry with this name: settings, or what is written beside the catalog or
/// a folder of copies.
fn is_left_over(name: &OsStr) -> bool {
    let beside = format!(".{CATALOG_FILE}.");
    let is_beside_catalog = name.as_encoded_bytes().starts_with(beside.as_bytes());
    name == SETTINGS_FILE || is_beside_catalog || NewFolder::is_unfinished(name)
}

/// Warns about a folder beside the backup that is not used, because nothing says which inputs its files are.
fn warn_about_unlisted(backup: &Path, inputs: Option<&Path>, listener: &dyn Listener) {
    let folder = inputs_folder(backup);
    if inputs.is_none() && folder.is_dir() {
        let shown = folder.display();
        let text = format!(
            "{shown} lists no scans and prints, so it is not used; `backup --with-inputs` completes it, or name it with --inputs"
        );
        warn(listener, text);
    }
}

/// Creates the project. The catalog comes last: a directory without a catalog is no project.
async fn restore_into(
    request: &RestoreRequest,
    location: &Location,
    copies: Option<ListedCopies>,
    listener: &dyn Listener,
) -> ProjectResult<Restored> {
    let RestoreRequest {
        backup,
        dir,
        inputs,
    } = request;
    let failed = || format!("cannot restore {} to {}", backup.display(), dir.display());
    let project = Project::create(dir).with_context(failed)?;
    let catalog = project.catalog_path();
    let _lock = TargetLock::acquire(&catalog).with_context(failed)?;
    let staging = StagingFolder::beside(&catalog).with_context(failed)?;
    let new = staging.path().join(CATALOG_FILE);
    let settings = Catalog::restore_backup(backup, &new)
        .await
        .with_context(failed)?;
    let settings = settings.as_deref().map(make_local);
    let text = settings.as_ref().map(|settings| &*settings.text);
    if let Some(text) = text {
        check_settings(&project, text).with_context(failed)?;
    }
    let storage = storage_of(&project, text, location, staging.path()).with_context(failed)?;
    let project = project.with_storage(storage);
    let copied = match copies {
        None => None,
        Some(copies) => {
            let copied = copies.copy_to(&project, &new).await;
            Some(copied.map_err(|error| match error.code() {
                // A refusal says all, and is known in other languages.
                ErrorCode::Usage => error,
                _ => error.context(failed()),
            })?)
        }
    };
    let placed = place_project(
        &project,
        &staging,
        inputs.as_deref(),
        copied.as_ref(),
        settings,
        listener,
        &failed,
    );
    let placed = placed.await;
    if placed.is_err()
        && let Some(copied) = &copied
    {
        copied.remove();
    }
    placed
}

/// Gives a project the catalog in a staging folder, after its inputs were located. `failed` says what failed.
async fn place_project(
    project: &Project,
    staging: &StagingFolder,
    inputs: Option<&Path>,
    copied: Option<&ProjectCopies>,
    settings: Option<LocalSettings>,
    listener: &dyn Listener,
    failed: &dyn Fn() -> String,
) -> ProjectResult<Restored> {
    let (catalog, new) = (project.catalog_path(), staging.path().join(CATALOG_FILE));
    let located = match (copied, inputs) {
        (Some(copied), _) => locate_inputs(&new, copied.finder(project)).await,
        (None, Some(inputs)) => locate_inputs(&new, finder_in(project, inputs, listener)).await,
        (None, None) => Ok(Vec::new()),
    };
    let missing = located.map_err(|error| ProjectError::unexpected(error.text(staging.path())))?;
    let (pairs, verdicts) = count_rows(staging.path()).await.with_context(failed)?;
    check_directory(project)?;
    let wrote_settings = match &settings {
        Some(settings) => {
            write_settings(project, &settings.text, staging.path()).with_context(failed)?
        }
        None => false,
    };
    if !place_new_file(&new, &catalog).with_context(failed)? {
        // Another process created a project in the meantime, which has no settings of its own.
        if wrote_settings {
            let _ = std::fs::remove_file(project.settings_path());
        }
        return Err(is_project_already(project));
    }
    Ok(Restored {
        pairs,
        verdicts,
        settings,
        copied: copied.map(|copied| copied.copies.clone()),
        copied_to: copied.and_then(ProjectCopies::place).map(Path::to_owned),
        elsewhere: copied.map_or(0, |copied| copied.elsewhere),
        missing,
        not_in_place: None,
    })
}

/// Returns the named roots of the settings that the new project will have, if they are valid. Without settings in the backup,
/// those of its folder hold.
fn storage_of(
    project: &Project,
    settings: Option<&str>,
    location: &Location,
    staging: &Path,
) -> ProjectResult<Option<ProjectStorage>> {
    let dir = match settings {
        None => project.dir().to_owned(),
        Some(text) => {
            let dir = staging.join("settings");
            std::fs::create_dir(&dir)?;
            std::fs::write(dir.join(SETTINGS_FILE), text)?;
            dir
        }
    };
    let found = location.at(&dir).data_locations().ok();
    Ok(found.and_then(|(storage, _)| storage))
}

/// Writes the settings file of a project. An equal file may exist: a restore that was killed has written it. Returns
/// whether the file was written.
fn write_settings(project: &Project, text: &str, staging: &Path) -> ProjectResult<bool> {
    let path = project.settings_path();
    let new = staging.join(SETTINGS_FILE);
    write_synced(&new, text.as_bytes())?;
    if place_new_file(&new, &path)? {
        return Ok(true);
    }
    check_settings(project, text)?;
    Ok(false)
}

/// Refuses other settings in the project folder than those of the backup.
fn check_settings(project: &Project, text: &str) -> ProjectResult<()> {
    let path = project.settings_path();
    if files::small(&path)?.is_none_or(|found| found == text.as_bytes()) {
        return Ok(());
    }
    let text = format!(
        "{} exists and differs from the settings that the backup would write there; rename it",
        path.display()
    );
    Err(Refusal::Usage(text).into())
}

/// Refuses inputs that are not a directory.
fn check_inputs(inputs: &Path) -> ProjectResult<()> {
    let shown = inputs.display();
    let found = metadata(inputs).with_context(|| format!("cannot read {shown}"))?;
    if found.is_some_and(|found| found.is_dir()) {
        // Otherwise every file would look missing.
        std::fs::read_dir(inputs).with_context(|| format!("cannot read {shown}"))?;
        return Ok(());
    }
    Err(Refusal::Usage(format!("there is no directory {shown}")).into())
}

/// Refuses a file that is not a backup.
pub(crate) fn check_backup(backup: &Path) -> ProjectResult<()> {
    let shown = backup.display();
    let failed = || format!("cannot read {shown}");
    let refuse = |text: String| Err(Refusal::Usage(text).into());
    if metadata(backup).with_context(failed)?.is_none() {
        return refuse(format!("there is no file {shown}"));
    }
    if !is_backup(backup).with_context(failed)? {
        if files::kind(backup) == Some(FileKind::LfsPointer) {
            return refuse(format!("{shown} {}", pointer_of("backup")));
        }
        return refuse(format!("{shown} is not a backup"));
    }
    // The log of a catalog in use holds changes that the file lacks.
    let mut log = backup.as_os_str().to_owned();
    log.push("-wal");
    let log = metadata(Path::new(&log)).with_context(failed)?;
    if log.is_some_and(|log| log.len() > 0) {
        return refuse(format!(
            "{shown} is the catalog of a project in use; `backup` copies it"
        ));
    }
    Ok(())
}

/// Refuses a directory that is a project.
fn check_directory(project: &Project) -> ProjectResult<()> {
    let shown = project.dir().display();
    let catalog = metadata(&project.catalog_path());
    if catalog
        .with_context(|| format!("cannot read {shown}"))?
        .is_some()
    {
        return Err(is_project_already(project));
    }
    Ok(())
}

fn is_project_already(project: &Project) -> ProjectError {
    let shown = project.dir().display();
    Refusal::Usage(format!(
        "{shown} is a project already; name another directory"
    ))
    .into()
}

#[cfg(test)]
mod tests {
    use super::{Location, Project, check_settings, is_free, storage_of};

    #[test]
    fn only_a_folder_without_files_of_others_becomes_a_project() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let new = dir.path().join("new");
        assert!(is_free(&new).expect("looked up"), "there is none");
        let left = new.join(".catalog.sqlite.12-0.mocban-partial");
        std::fs::create_dir_all(left).expect("a folder");
        std::fs::write(new.join("mocban.toml"), "").expect("written");
        std::fs::create_dir(new.join(".new.12-0.mocban-partial")).expect("a folder");
        std::fs::create_dir(new.join("inputs")).expect("a folder");
        assert!(!is_free(&new).expect("listed"), "a folder of somebody");
        std::fs::write(new.join("inputs/mocban-inputs.json"), "").expect("written");
        assert!(is_free(&new).expect("listed"), "of an interrupted restore");
        std::fs::write(new.join("scan.stl"), "").expect("written");
        assert!(!is_free(&new).expect("listed"));
        assert!(!is_free(&new.join("scan.stl")).expect("a file"));
    }

    #[test]
    fn other_settings_are_refused_before_anything_is_copied() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        check_settings(&project, "[run]\n").expect("there are none");
        std::fs::write(project.settings_path(), "[run]\n").expect("written");
        check_settings(&project, "[run]\n").expect("they are equal");
        let refused = check_settings(&project, "[fit]\n").expect_err("they differ");
        let text = refused.to_string();
        assert!(text.contains("exists and differs"), "{text}");
    }

    #[test]
    fn the_named_roots_of_the_settings_are_those_of_the_new_project() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(&dir.path().join("q"));
        let location = Location::new(dir.path().join("q"));
        let root = dir.path().join("scans");
        for (place, is_root) in [(root.display().to_string(), true), (String::new(), false)] {
            let staging = tempfile::tempdir().expect("a temporary directory");
            let text = toml_roots(&place);
            let storage = storage_of(&project, Some(&text), &location, staging.path());
            let found = project.clone().with_storage(storage.expect("written"));
            let is_found = found.input_path("scans:1/a.stl") == root.join("1/a.stl");
            assert_eq!(is_found, is_root, "{place:?}");
        }
        let staging = dir.path().join("none");
        let none = storage_of(&project, None, &location, &staging);
        assert!(none.expect("no settings").is_none());
    }

    /// Returns settings with a root.
    fn toml_roots(place: &str) -> String {
        format!("[storage.roots]\nscans = {place:?}\n")
    }
}
