//! Scans and prints of a restored project: copied from beside the backup, or found in a folder.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::backup_checks::{check_room, free_beside};
use crate::blocking::blocking;
use crate::error::{ProjectError, ProjectResult, WithContext as _};
use crate::files::metadata;
use crate::input_copy::{CopyOutcome, InputCopier, file_hash};
use crate::input_finder::{FoundPath, is_in_place, plain_file};
use crate::input_list::{CopiedInput, INPUT_LIST, InputCopies, InputList, inputs_folder};
use crate::wanted_inputs::{WantedInput, wanted_inputs};
use mocban_catalog::{Catalog, RetrySelection};
use mocban_core::domain::FailureClass;
use mocban_store::{CATALOG_FILE, Input, NewFolder, Project};

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
    /// Whether this restore has created the folder.
    is_new: bool,
    /// Number of inputs that are read at their old places outside of the project, because no whole copy of them was there.
    pub(crate) elsewhere: u64,
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

    /// Copies into a project what its new catalog names. A copy with another content than its list or the catalog says is
    /// left out.
    ///
    /// # Errors
    /// Refuses a disk without room for what has to be copied.
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
        blocking(copy).await?
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
            is_new: false,
            elsewhere: 0,
            copies: InputCopies {
                folder: self.folder.clone(),
                files: 0,
                bytes: 0,
            },
            paths: HashMap::new(),
        };
        // The copies have to be found wherever the project is moved.
        let plain = project.clone().with_storage(None);
        let mut open = Vec::new();
        for wanted in wanted {
            let Some(copy) = listed.get(wanted.stored.as_str()) else {
                continue;
            };
            // The folder of the project may have it already.
            let is_below = Path::new(&wanted.stored).is_relative();
            if is_below && file_hash(&plain.input_path(&wanted.stored)) == Some(copy.hash) {
                done.paths
                    .insert(wanted.stored.clone(), wanted.stored.clone());
            } else if wanted.may_be(copy.hash) {
                open.push(*copy);
            }
        }
        let left = self.left_over(project, &open);
        done.is_new = left.is_none();
        let placed = match left {
            None => self.copy_all(project, &open)?,
            left => left,
        };
        if let Some((place, there)) = placed {
            for copy in there {
                let path = plain.stored_path(&place.join(&copy.name))?;
                done.paths.insert(copy.stored.clone(), path);
                done.copies.files += 1;
                done.copies.bytes = done.copies.bytes.saturating_add(copy.bytes);
            }
            done.place = Some(place);
        }
        let uncopied = wanted
            .iter()
            .filter(|wanted| !done.paths.contains_key(&wanted.stored));
        let elsewhere = uncopied.filter(|wanted| is_elsewhere(project, &wanted.stored));
        done.elsewhere = elsewhere.count() as u64;
        Ok(done)
    }

    /// Returns the folder of copies that an interrupted restore of the same backup has left, with the copies that are whole. A
    /// folder without a copy that could be made now is none.
    fn left_over<'a>(&self, project: &Project, open: &[&'a CopiedInput]) -> Option<Placed<'a>> {
        let numbered = (2..=MAX_FOLDERS).map(|number| format!("{COPIES}-{number}"));
        let names = std::iter::once(COPIES.to_owned()).chain(numbered);
        let mut folders = names.map(|name| project.dir().join(name));
        folders.find_map(|folder| {
            let is_folder = folder.symlink_metadata().is_ok_and(|meta| meta.is_dir());
            if !is_folder || !matches!(InputList::read_plainly(&folder), Ok(Some(_))) {
                return None;
            }
            let mut there = Vec::with_capacity(open.len());
            for &copy in open {
                if is_whole(&folder, copy) {
                    there.push(copy);
                } else if is_whole(&self.folder, copy) {
                    return None;
                }
            }
            (!there.is_empty()).then_some((folder, there))
        })
    }

    /// Copies files to a new folder in the project, which gets its name when it is whole. Leaves out what cannot be read, has
    /// another content, or is reached through a link. Returns `None` if nothing was copied.
    fn copy_all<'a>(
        &self,
        project: &Project,
        open: &[&'a CopiedInput],
    ) -> ProjectResult<Option<Placed<'a>>> {
        let sources = open.iter().filter_map(|&copy| {
            let bytes = plain_file(&self.folder, &copy.name).ok().flatten()?;
            Some((copy, bytes))
        });
        let sources: Vec<(&CopiedInput, u64)> = sources.collect();
        if sources.is_empty() {
            return Ok(None);
        }
        let failed = || format!("cannot write to {}", project.dir().display());
        // Removes what an interrupted restore has left, so that its room is free.
        let folder = NewFolder::begin(project.dir()).with_context(failed)?;
        let bytes = sources.iter().map(|(_, bytes)| *bytes);
        let needed = bytes.fold(0, u64::saturating_add);
        check_room(needed, free_beside(project.dir()), project.dir())?;
        let copier = InputCopier::begin(folder.path(), INPUT_LIST).with_context(failed)?;
        let mut whole = Vec::with_capacity(sources.len());
        for (copy, _) in sources {
            let source = Input::file(self.folder.join(&copy.name));
            let copied = copier.copy(&source, &copy.name, None, |hash| hash == copy.hash)?;
            if matches!(copied, CopyOutcome::There { .. }) {
                whole.push(copy);
            }
        }
        if whole.is_empty() {
            return Ok(None);
        }
        let listed = whole.iter().copied().cloned().collect();
        InputList::new(listed).write(folder.path())?;
        drop(copier);
        let place = folder.place(COPIES).with_context(failed)?;
        Ok(Some((place, whole)))
    }
}

/// A folder of copies in a project, and its whole copies.
type Placed<'a> = (PathBuf, Vec<&'a CopiedInput>);

/// Returns whether the copy of an input in a folder has the content that its list says.
fn is_whole(folder: &Path, copy: &CopiedInput) -> bool {
    let found = plain_file(folder, &copy.name);
    found.is_ok_and(|bytes| bytes == Some(copy.bytes))
        && file_hash(&folder.join(&copy.name)) == Some(copy.hash)
}

/// Returns whether an input is at its place, outside of the folder of the project.
fn is_elsewhere(project: &Project, stored: &str) -> bool {
    !project.input(stored).path().starts_with(project.dir()) && is_in_place(project, stored)
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
            let kept = || is_in_place(&project, stored).then(|| stored.to_owned());
            Ok(paths.get(stored).cloned().or_else(kept))
        }
    }

    /// Removes the copies again, because there is no project. A folder that was there before stays.
    pub(crate) fn remove(&self) {
        if self.is_new
            && let Some(place) = &self.place
        {
            // What stays is used by the next restore of this backup.
            let _ = std::fs::remove_dir_all(place);
        }
    }
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

#[cfg(test)]
mod tests {
    use std::collections::HashMap;
    use std::path::Path;

    use super::{ListedCopies, ProjectCopies, is_elsewhere};
    use crate::input_list::{CopiedInput, InputList};
    use mocban_core::domain::ContentHash;
    use mocban_store::Project;

    /// Makes a folder of copies with their list.
    fn copies(folder: &Path, names: &[&str]) -> ListedCopies {
        let files = names.iter().map(|name| {
            let path = folder.join(name);
            let parent = path.parent().expect("a folder");
            std::fs::create_dir_all(parent).expect("created");
            std::fs::write(&path, name).expect("written");
            CopiedInput {
                stored: format!("/disk/{name}"),
                name: (*name).to_owned(),
                bytes: name.len() as u64,
                hash: ContentHash::of(name.as_bytes()),
            }
        });
        let list = InputList::new(files.collect());
        list.write(folder).expect("written");
        let folder = folder.to_owned();
        ListedCopies { folder, list }
    }

    /// Returns a new project folder.
    fn project_in(dir: &Path) -> Project {
        Project::create(&dir.join("q")).expect("a folder")
    }

    /// Returns the names of copies.
    fn names<'a>(copies: &[&'a CopiedInput]) -> Vec<&'a str> {
        copies.iter().map(|copy| copy.name.as_str()).collect()
    }

    #[test]
    fn what_an_interrupted_restore_left_is_used_if_it_is_whole() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let listed = copies(&dir.path().join("b.inputs"), &["1.stl", "2.stl"]);
        let open: Vec<&CopiedInput> = listed.list.files.iter().collect();
        let project = project_in(dir.path());
        assert!(listed.left_over(&project, &open).is_none(), "there is none");
        let copied = listed.copy_all(&project, &open).expect("copied");
        let (place, whole) = copied.expect("two copies");
        assert_eq!(names(&whole), ["1.stl", "2.stl"]);
        let left = listed.left_over(&project, &open).expect("it is whole");
        assert_eq!(left.0, place);
        assert_eq!(names(&left.1), ["1.stl", "2.stl"]);
        // The length alone says nothing.
        std::fs::write(place.join("1.stl"), "other").expect("written");
        assert!(listed.left_over(&project, &open).is_none());
        // Without a whole copy beside the backup, it would be left out again.
        std::fs::write(listed.folder.join("1.stl"), "wrong").expect("written");
        let left = listed.left_over(&project, &open).expect("as good as new");
        assert_eq!(names(&left.1), ["2.stl"]);
    }

    #[test]
    fn damaged_copies_are_left_out_of_the_folder_and_of_its_list() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let listed = copies(&dir.path().join("b.inputs"), &["1.stl", "2.stl"]);
        let open: Vec<&CopiedInput> = listed.list.files.iter().collect();
        let project = project_in(dir.path());
        std::fs::write(listed.folder.join("1.stl"), "wrong").expect("written");
        let copied = listed.copy_all(&project, &open).expect("copied");
        let (place, whole) = copied.expect("one copy");
        assert_eq!(names(&whole), ["2.stl"]);
        let list = InputList::read(&place).expect("read").expect("a list");
        assert_eq!(list.files, [listed.list.files[1].clone()]);
        std::fs::remove_file(listed.folder.join("2.stl")).expect("removed");
        let none = listed.copy_all(&project, &open).expect("nothing fails");
        assert!(none.is_none());
        let entries = std::fs::read_dir(project.dir()).expect("a folder");
        assert_eq!(entries.count(), 1, "only the first folder");
    }

    #[test]
    fn a_failed_restore_removes_only_a_folder_that_it_created() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let listed = copies(&dir.path().join("inputs"), &["1.stl"]);
        let mut copied = ProjectCopies {
            place: Some(listed.folder.clone()),
            is_new: false,
            elsewhere: 0,
            copies: listed.list.copies(&listed.folder),
            paths: HashMap::new(),
        };
        copied.remove();
        assert!(listed.folder.join("1.stl").exists());
        copied.is_new = true;
        copied.remove();
        assert!(!listed.folder.exists());
    }

    #[cfg(unix)]
    #[test]
    fn links_among_the_copies_are_not_followed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let listed = copies(&dir.path().join("b.inputs"), &["1.stl", "a/2.stl", "3.stl"]);
        let open: Vec<&CopiedInput> = listed.list.files.iter().collect();
        let project = project_in(dir.path());
        let outside = dir.path().join("outside");
        std::fs::create_dir(&outside).expect("a folder");
        std::fs::rename(listed.folder.join("1.stl"), outside.join("1.stl")).expect("moved");
        std::fs::rename(listed.folder.join("a/2.stl"), outside.join("2.stl")).expect("moved");
        std::fs::remove_dir(listed.folder.join("a")).expect("removed");
        for (target, name) in [(outside.join("1.stl"), "1.stl"), (outside.clone(), "a")] {
            std::os::unix::fs::symlink(target, listed.folder.join(name)).expect("a link");
        }
        let copied = listed.copy_all(&project, &open).expect("copied");
        assert_eq!(names(&copied.expect("one copy").1), ["3.stl"]);
    }

    #[test]
    fn an_input_outside_of_the_project_is_counted_if_it_is_there() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = project_in(dir.path());
        let outside = dir.path().join("1.stl");
        let stored = outside.to_str().expect("UTF-8");
        assert!(!is_elsewhere(&project, stored), "it is missing");
        std::fs::write(&outside, "scan").expect("written");
        std::fs::write(project.dir().join("1.stl"), "scan").expect("written");
        assert!(is_elsewhere(&project, stored));
        assert!(!is_elsewhere(&project, "1.stl"));
    }
}
