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
    use super::write_new;
    use mocban_core::domain::BlockName;
    use mocban_store::Project;

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
