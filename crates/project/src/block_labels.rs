//! Writes labels that were made on the page of a block.

use crate::error::{ProjectError, ProjectResult, WithContext as _};
use crate::files::metadata;
use mocban_core::domain::BlockName;
use mocban_store::{Project, StagingFolder, create_folders, place_new_file};

/// Folder of these labels, in the project folder.
const FOLDER: &str = "labels";
/// Name of a file before it is complete.
const PARTIAL: &str = "labels.json";
/// Most files of a block.
const MAX_FILES: u32 = 100_000;

/// Returns why labels may not be saved in the project folder: workers on other computers have another one, and would not find
/// them. `is_shared` says whether the catalog is on a server.
///
/// Without an object store, the results are in the project folder too, so all computers share it. A folder below a named root
/// is found by its stored path.
pub fn unreachable_place(project: &Project, is_shared: bool) -> ProjectResult<Option<String>> {
    let folder = project.dir().join(FOLDER);
    let stored = project.stored_path(&folder.join(PARTIAL))?;
    let is_found = !is_shared || !project.has_remote_artifacts() || project.is_below_root(&stored);
    Ok((!is_found).then(|| {
        let folder = folder.display();
        format!(
            "the labels would be saved in {folder}, where workers on other computers do not find them; use a project folder below \
             one of [storage.roots] that all of them have, or correct the labels in another program and import them"
        )
    }))
}

/// Writes labels of a block to a new file of the project, and returns its path as stored. Earlier files stay.
pub fn write_new(project: &Project, block: &BlockName, bytes: &[u8]) -> ProjectResult<String> {
    let folder = project.dir().join(FOLDER);
    let cannot_write = || format!("cannot write to {}", folder.display());
    create_folders(&folder).with_context(cannot_write)?;
    let name = block.file_name();
    for number in 1..=MAX_FILES {
        let path = folder.join(format!("{name}-{number}.json"));
        if metadata(&path).with_context(cannot_write)?.is_some() {
            continue;
        }
        let staging = StagingFolder::beside(&path).with_context(cannot_write)?;
        let partial = staging.path().join(PARTIAL);
        std::fs::write(&partial, bytes).with_context(cannot_write)?;
        // Another process may have taken the name meanwhile.
        if place_new_file(&partial, &path).with_context(cannot_write)? {
            return Ok(project.stored_path(&path)?);
        }
    }
    let shown = folder.display();
    let text = format!("{shown} has {MAX_FILES} files of block {block}; move some elsewhere");
    Err(ProjectError::unexpected(text))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::{unreachable_place, write_new};
    use mocban_core::domain::BlockName;
    use mocban_store::{Project, ProjectStorage, StorageOptions};

    /// Returns a project with its results in an object store or not, and a root with the name `nas`.
    fn stored(dir: &Path, artifacts: &str, nas: &Path) -> Project {
        let nas = nas.to_str().expect("UTF-8").to_owned();
        let options = StorageOptions {
            artifacts: artifacts.to_owned(),
            roots: BTreeMap::from([("nas".to_owned(), nas)]),
            cache: dir.join("cache").to_str().expect("UTF-8").to_owned(),
            cache_bytes: 1,
        };
        let storage = ProjectStorage::open(&options).expect("valid settings");
        Project::at(dir).with_storage(storage)
    }

    #[test]
    fn a_folder_that_other_computers_do_not_have_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (project, other) = (dir.path().join("p"), dir.path().join("nas"));
        let (store, other) = ("s3://lab/results", other.as_path());
        for (artifacts, nas, is_shared, is_refused) in [
            (store, other, true, true),
            (store, other, false, false),
            (store, dir.path(), true, false),
            ("", other, true, false),
        ] {
            let project = stored(&project, artifacts, nas);
            let refused = unreachable_place(&project, is_shared).expect("a path");
            assert_eq!(refused.is_some(), is_refused, "{artifacts} {is_shared}");
        }
    }

    #[test]
    fn each_file_is_new() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        let block = BlockName::new("ván: 1").expect("a name");
        for (text, expected) in [
            ("one", "labels/ván%3A 1-1.json"),
            ("two", "labels/ván%3A 1-2.json"),
        ] {
            let stored = write_new(&project, &block, text.as_bytes()).expect("written");
            assert_eq!(stored, expected);
            let found = std::fs::read(project.input_path(&stored)).expect("a file");
            assert_eq!(found, text.as_bytes());
        }
        let files = std::fs::read_dir(dir.path().join("labels")).expect("a folder");
        assert_eq!(files.count(), 2);
    }
}
