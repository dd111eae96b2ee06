//! Finds the inputs of a restored project in a folder.

use std::collections::HashMap;
use std::fs::Metadata;
use std::path::Path;

use crate::events::{Listener, warn};
use crate::input_list::{InputList, has_list, is_not_there};
use crate::input_names::named_parts;
use mocban_store::{Project, StoreError};

/// The path of an input that was found.
pub(crate) type FoundPath = Result<Option<String>, StoreError>;

/// Returns a function that finds inputs that are not at their old places in a folder: by the list of the folder, or by the
/// end of their paths. Warns about a list that cannot be read.
pub(crate) fn finder_in(
    project: &Project,
    folder: &Path,
    listener: &dyn Listener,
) -> impl FnMut(&str) -> FoundPath + Send + 'static + use<> {
    let list = InputList::read_plainly(folder).unwrap_or_else(|error| {
        let text = format!("{error}; scans and prints are found there by their paths alone");
        warn(listener, text);
        None
    });
    let list = list.map_or_else(Vec::new, |list| list.files);
    let listed: HashMap<String, String> = list
        .into_iter()
        .map(|copy| (copy.stored, copy.name))
        .collect();
    let is_of_backup = has_list(folder);
    let (project, folder) = (project.clone(), folder.to_owned());
    let plain = project.clone().with_storage(None);
    move |stored: &str| {
        if is_in_place(&project, stored) {
            return Ok(Some(stored.to_owned()));
        }
        if !is_of_backup {
            return plain.find_input(stored, &folder);
        }
        // A backup makes no links.
        let names = listed.get(stored).cloned().into_iter();
        for name in names.chain(ends_of(stored)) {
            let path = folder.join(&name);
            match plain_file(&folder, &name) {
                Ok(None) => {}
                Ok(Some(_)) => return plain.stored_path(&path).map(Some),
                Err(source) => return Err(StoreError::Io { path, source }),
            }
        }
        Ok(None)
    }
}

/// Returns a stored path as names below a folder: whole, without its first folder, and so on down to its file name.
fn ends_of(stored: &str) -> Vec<String> {
    let parts = named_parts(stored);
    let ends = 0..parts.len();
    ends.map(|first| parts[first..].join("/")).collect()
}

/// Returns the length of a file below a folder, or `None` if there is none. A link is none: it may lead out of the folder.
pub(crate) fn plain_file(folder: &Path, name: &str) -> std::io::Result<Option<u64>> {
    let mut path = folder.to_owned();
    let mut found: Option<Metadata> = None;
    for part in Path::new(name).components() {
        path.push(part);
        let meta = match path.symlink_metadata() {
            Err(error) if is_not_there(error.kind()) => return Ok(None),
            meta => meta?,
        };
        if meta.is_symlink() {
            return Ok(None);
        }
        found = Some(meta);
    }
    Ok(found.filter(Metadata::is_file).map(|meta| meta.len()))
}

/// Returns whether an input is at its place. Sends no request for one in an object store.
pub(crate) fn is_in_place(project: &Project, stored: &str) -> bool {
    let input = project.input(stored);
    input.is_remote() || input.exists()
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};
    use std::sync::Mutex;

    use super::{finder_in, plain_file};
    use crate::events::{Listener, ProjectEvent};
    use crate::input_list::{CopiedInput, INPUT_LIST, InputList};
    use mocban_core::domain::ContentHash;
    use mocban_store::Project;

    /// Makes a folder of two copies with their list.
    fn copies(dir: &Path) -> PathBuf {
        let folder = dir.join("b.inputs");
        std::fs::create_dir_all(folder.join("disk")).expect("a folder");
        let files = ["disk/1.stl", "2.stl"].map(|name| {
            std::fs::write(folder.join(name), name).expect("written");
            CopiedInput {
                stored: format!("/disk/{name}"),
                name: name.to_owned(),
                bytes: name.len() as u64,
                hash: ContentHash::of(name.as_bytes()),
            }
        });
        let list = InputList::new(Vec::from(files));
        list.write(&folder).expect("written");
        folder
    }

    /// Keeps warnings.
    #[derive(Default)]
    struct HeardWarnings(Mutex<Vec<String>>);

    impl Listener for HeardWarnings {
        fn event(&self, event: ProjectEvent<'_>) {
            if let ProjectEvent::Warning(text) = event {
                self.0.lock().expect("no panic").push(text);
            }
        }
    }

    #[test]
    fn copies_with_a_damaged_list_are_found_by_their_paths() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (project, folder) = (Project::at(&dir.path().join("q")), copies(dir.path()));
        let heard = HeardWarnings::default();
        for is_damaged in [false, true] {
            if is_damaged {
                std::fs::write(folder.join(INPUT_LIST), "{").expect("written");
            }
            let mut find = finder_in(&project, &folder, &heard);
            for (stored, name) in [
                ("/disk/1.stl", Some("disk/1.stl")),
                ("/disk/2.stl", Some("2.stl")),
                ("/disk/3.stl", None),
            ] {
                let path = name.map(|name| folder.join(name));
                let path = path.map(|path| project.stored_path(&path).expect("UTF-8"));
                assert_eq!(find(stored).expect("looked up"), path, "{stored}");
            }
        }
        let warnings = heard.0.into_inner().expect("no panic");
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("is damaged"), "{warnings:?}");
        assert!(!warnings[0].contains("make the backup again"));
    }

    #[cfg(unix)]
    #[test]
    fn links_of_a_folder_of_copies_are_not_followed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (project, folder) = (Project::at(&dir.path().join("q")), copies(dir.path()));
        let outside = dir.path().join("outside");
        std::fs::rename(folder.join("disk"), &outside).expect("moved");
        std::fs::rename(folder.join("2.stl"), outside.join("2.stl")).expect("moved");
        for (target, name) in [(outside.join("2.stl"), "2.stl"), (outside.clone(), "disk")] {
            std::os::unix::fs::symlink(target, folder.join(name)).expect("a link");
        }
        std::fs::write(folder.join("3.stl"), "scan").expect("written");
        let mut find = finder_in(&project, &folder, &());
        for (stored, is_found) in [
            ("/disk/disk/1.stl", false),
            ("/disk/2.stl", false),
            ("/disk/3.stl", true),
        ] {
            let found = find(stored).expect("looked up");
            assert_eq!(found.is_some(), is_found, "{stored}");
        }
    }

    #[test]
    fn only_a_file_has_a_length() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let folder = copies(dir.path());
        for (name, bytes) in [
            ("disk/1.stl", Some(10)),
            ("disk", None),
            ("2.stl/3.stl", None),
            ("4.stl", None),
            ("", None),
        ] {
            let found = plain_file(&folder, name).expect("looked up");
            assert_eq!(found, bytes, "{name:?}");
        }
    }
}
