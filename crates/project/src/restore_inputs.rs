//! Scans and prints of a restored project: copied from beside the backup, or found in a folder.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::error::{ProjectError, ProjectResult, TaskStopped, WithContext as _};
use crate::files::metadata;
use crate::input_copy::{CopyOutcome, InputCopier, file_hash};
use crate::input_list::{CopiedInput, INPUT_LIST, InputCopies, InputList, inputs_folder};
use crate::wanted_inputs::{WantedInput, wanted_inputs};
use mocban_catalog::{Catalog, RetrySelection};
use mocban_core::domain::FailureClass;
use mocban_store::{CATALOG_FILE, Input, NewFolder, Project, StoreError};

/// Name of the folder of copies in a restored project; a number follows if something else has it.
const COPIES: &str = "inputs";
/// Most names of the folder of copies that an interrupted restore may have left.
const MAX_FOLDERS: usize = 100;

/// Scans and prints beside a backup, to be copied.
#[derive(Debug, Clone)]
pub(crate) struct ListedCopies {
    /// Their folder.
    pub(crate) folder: PathBuf,
    list: InputList,
}

/// Scans and prints in a project, before it has a catalog.
#[derive(Debug)]
pub(crate) struct ProjectCopies {
    /// Their folder. `None` if the project had all of them.
    place: Option<PathBuf>,
    /// How much was copied, and from where.
    pub(crate) copies: InputCopies,
    /// New stored paths by the stored paths of the backup.
    paths: HashMap<String, String>,
}

impl ListedCopies {
    /// Returns the copies beside a backup, or `None` if there are none.
    ///
    /// # Errors
    /// Refuses a damaged list.
    pub(crate) fn beside(backup: &Path) -> ProjectResult<Option<Self>> {
        let folder = inputs_folder(backup);
        let list = InputList::read(&folder)?;
        let list = list.filter(|list| !list.files.is_empty());
        Ok(list.map(|list| Self { folder, list }))
    }

    /// Returns how many bytes they have.
    pub(crate) fn bytes(&self) -> u64 {
        self.list.copies(&self.folder).bytes
    }

    /// Copies into a project what its new catalog names. A copy with another content than its list or the catalog says is
    /// left out.
    pub(crate) async fn copy_to(
        self,
        project: &Project,
        new: &Path,
    ) -> ProjectResult<ProjectCopies> {
        let catalog = Catalog::open_read_only(new).await?;
        let wanted = wanted_inputs(&catalog).await;
        catalog.close().await;
        let (project, wanted) = (project.clone(), wanted?);
        let copy = move || self.copy_wanted(&project, &wanted);
        let copied = tokio::task::spawn_blocking(copy).await;
        copied.map_err(TaskStopped)?
    }

    fn copy_wanted(
        &self,
        project: &Project,
        wanted: &[WantedInput],
    ) -> ProjectResult<ProjectCopies> {
        let files = self.list.files.iter();
        let listed: HashMap<&str, &CopiedInput> =
            files.map(|copy| (copy.stored.as_str(), copy)).collect();
        let mut done = ProjectCopies {
            place: None,
            copies: InputList::new(Vec::new()).copies(&self.folder),
            paths: HashMap::new(),
        };
        let mut open = Vec::new();
        for wanted in wanted {
            let Some(copy) = listed.get(wanted.stored.as_str()) else {
                continue;
            };
            // The folder of the project may have it already.
            let is_below = Path::new(&wanted.stored).is_relative();
            if is_below && file_hash(&project.input_path(&wanted.stored)) == Some(copy.hash) {
                done.paths
                    .insert(wanted.stored.clone(), wanted.stored.clone());
            } else if wanted.may_be(copy.hash) {
                open.push(*copy);
            }
        }
        if open.is_empty() {
            return Ok(done);
        }
        let place = match self.left_over(project, &open) {
            Some(place) => place,
            None => self.copy_all(project, &mut open)?,
        };
        for copy in open {
            let path = project.stored_path(&place.join(&copy.name))?;
            done.paths.insert(copy.stored.clone(), path);
            done.copies.files += 1;
            done.copies.bytes = done.copies.bytes.saturating_add(copy.bytes);
        }
        done.place = Some(place);
        Ok(done)
    }

    /// Returns the whole folder of copies that an interrupted restore of the same backup has left.
    fn left_over(&self, project: &Project, open: &[&CopiedInput]) -> Option<PathBuf> {
        let numbered = (2..=MAX_FOLDERS).map(|number| format!("{COPIES}-{number}"));
        let names = std::iter::once(COPIES.to_owned()).chain(numbered);
        let mut folders = names.map(|name| project.dir().join(name));
        folders.find(|folder| {
            let is_there = |copy: &&CopiedInput| {
                let meta = std::fs::metadata(folder.join(&copy.name));
                meta.is_ok_and(|meta| meta.is_file() && meta.len() == copy.bytes)
            };
            let list = InputList::read(folder).ok().flatten();
            list.as_ref() == Some(&self.list) && open.iter().all(is_there)
        })
    }

    /// Copies files to a new folder in the project, which gets its name when it is whole. Leaves out of `open` what cannot be
    /// read or has another content.
    fn copy_all(&self, project: &Project, open: &mut Vec<&CopiedInput>) -> ProjectResult<PathBuf> {
        let failed = || format!("cannot write to {}", project.dir().display());
        let folder = NewFolder::begin(project.dir()).with_context(failed)?;
        let copier = InputCopier::begin(folder.path(), INPUT_LIST).with_context(failed)?;
        let mut whole = Vec::with_capacity(open.len());
        for copy in open.drain(..) {
            let source = Input::file(self.folder.join(&copy.name));
            let copied = copier.copy(&source, &copy.name, None, |hash| hash == copy.hash)?;
            if matches!(copied, CopyOutcome::There { .. }) {
                whole.push(copy);
            }
        }
        *open = whole;
        self.list.write(folder.path())?;
        drop(copier);
        folder.place(COPIES).with_context(failed)
    }
}

impl ProjectCopies {
    /// Returns the folder of the copies in the project, if any were needed.
    pub(crate) fn place(&self) -> Option<&Path> {
        self.place.as_deref()
    }

    /// Returns a function that finds the new path of an input, or keeps that of one that is still there.
    pub(crate) fn finder(
        &self,
        project: &Project,
    ) -> impl FnMut(&str) -> FoundPath + Send + 'static + use<> {
        let (paths, project) = (self.paths.clone(), project.clone());
        move |stored: &str| {
            let kept = || project.input(stored).exists().then(|| stored.to_owned());
            Ok(paths.get(stored).cloned().or_else(kept))
        }
    }

    /// Removes the copies again, because there is no project.
    pub(crate) fn remove(&self) {
        if let Some(place) = &self.place {
            // What stays is used by the next restore of this backup.
            let _ = std::fs::remove_dir_all(place);
        }
    }
}

/// The path of an input that was found.
pub(crate) type FoundPath = Result<Option<String>, StoreError>;

/// Returns a function that finds inputs that are not at their old places in a folder: by the list of the folder, or by the
/// end of their paths.
pub(crate) fn finder_in(
    project: &Project,
    folder: &Path,
) -> ProjectResult<impl FnMut(&str) -> FoundPath + Send + 'static + use<>> {
    let list = InputList::read(folder)?.map_or_else(Vec::new, |list| list.files);
    let listed: HashMap<String, String> = list
        .into_iter()
        .map(|copy| (copy.stored, copy.name))
        .collect();
    let (project, folder) = (project.clone(), folder.to_owned());
    Ok(move |stored: &str| {
        if project.input(stored).exists() {
            return Ok(Some(stored.to_owned()));
        }
        match listed.get(stored).map(|name| folder.join(name)) {
            Some(copy) if copy.is_file() => project.stored_path(&copy).map(Some),
            _ => project.find_input(stored, &folder),
        }
    })
}

/// Changes the paths of meshes and prints in a new catalog to where `find` finds them. Returns the paths of missing meshes
/// and prints. A file that cannot be looked up is an error, because it may not be missing.
pub(crate) async fn locate_inputs(
    new: &Path,
    mut find: impl FnMut(&str) -> FoundPath + Send + 'static,
) -> ProjectResult<Vec<String>> {
    let catalog = Catalog::open(new).await?;
    let unreadable = Arc::new(OnceLock::new());
    let first_unreadable = Arc::clone(&unreadable);
    let replaced = catalog.replace_input_paths(move |stored| {
        find(stored).unwrap_or_else(|error| {
            let _ = first_unreadable.set(error);
            None
        })
    });
    let missing = replaced.await;
    if missing.is_ok() {
        // What failed because a file was not there runs again with the file at its new place.
        let unread = FailureClass::Io;
        let (pairs, blocks) = (RetrySelection::Class(unread), RetrySelection::Class(unread));
        catalog.retry_pairs_and_blocks(&pairs, &blocks).await?;
    }
    catalog.close().await;
    if let Some(error) = unreadable.get() {
        let text = format!("cannot look for a mesh or print: {error}");
        return Err(ProjectError::unexpected(text));
    }
    // Changes that are still in the write-ahead log would be lost when the file is renamed.
    let log = metadata(&new.with_file_name(format!("{CATALOG_FILE}-wal")))?;
    if log.is_some_and(|log| log.len() > 0) {
        let text = "the disk is full or reported an error";
        return Err(ProjectError::unexpected(text));
    }
    Ok(missing?)
}
