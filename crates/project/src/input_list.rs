//! The folder of scans and prints beside a backup, and the list of what is in it.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{ProjectResult, WithContext as _};
use crate::exit::Refusal;
use mocban_core::domain::ContentHash;
use mocban_store::{StagingFolder, read_file_or_pipe, write_atomic};

/// The list in a folder of copies.
pub(crate) const INPUT_LIST: &str = "mocban-inputs.json";
/// What the name of the folder has after that of the backup.
const ENDING: &str = ".inputs";
/// Longest list that is read, in bytes.
const MAX_LIST_BYTES: u64 = 256 << 20;
/// Version of the list.
const SCHEMA: u32 = 1;

/// A copy of an input.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CopiedInput {
    /// Path of the input as the backup stores it.
    pub(crate) stored: String,
    /// Path of the copy below the folder, with slashes.
    pub(crate) name: String,
    /// Its length.
    pub(crate) bytes: u64,
    /// Hash of its content.
    pub(crate) hash: ContentHash,
}

/// The copies in a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct InputList {
    schema: u32,
    /// Each copy once.
    pub(crate) files: Vec<CopiedInput>,
}

/// Copies of scans and prints beside a backup.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputCopies {
    /// Their folder.
    pub folder: PathBuf,
    /// Number of files.
    pub files: u64,
    /// Their length together.
    pub bytes: u64,
}

impl InputList {
    /// Makes a list.
    pub(crate) const fn new(files: Vec<CopiedInput>) -> Self {
        Self {
            schema: SCHEMA,
            files,
        }
    }

    /// Reads the list of a folder. Returns `None` if there is none.
    ///
    /// # Errors
    /// Refuses a list of a later version, a damaged one, and one that leads out of its folder.
    pub(crate) fn read(folder: &Path) -> ProjectResult<Option<Self>> {
        let path = folder.join(INPUT_LIST);
        let failed = || format!("cannot read {}", path.display());
        let bytes = match read_file_or_pipe(&path, MAX_LIST_BYTES) {
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::InvalidFilename
                ) =>
            {
                return Ok(None);
            }
            read => read.with_context(failed)?,
        };
        let refuse = |reason: &str| {
            let text = format!(
                "{} {reason}; make the backup again, or name a folder with --inputs",
                path.display()
            );
            Err(Refusal::Usage(text).into())
        };
        let list: Self = match serde_json::from_slice(&bytes) {
            Ok(list) => list,
            Err(error) => return refuse(&format!("is damaged: {error}")),
        };
        if list.schema != SCHEMA {
            return refuse("was written by another version of this program");
        }
        let names: HashSet<&str> = list.files.iter().map(|copy| copy.name.as_str()).collect();
        if names.len() < list.files.len() || !names.into_iter().all(is_below) {
            return refuse("names a file twice or outside its folder");
        }
        Ok(Some(list))
    }

    /// Writes the list to a folder, in place of an earlier one.
    pub(crate) fn write(&self, folder: &Path) -> ProjectResult<()> {
        let path = folder.join(INPUT_LIST);
        let failed = || format!("cannot write {}", path.display());
        let bytes = serde_json::to_vec(self).map_err(std::io::Error::other);
        let written = bytes.and_then(|bytes| write_atomic(&path, &bytes));
        written.with_context(failed)
    }

    /// Returns how much the folder holds.
    pub(crate) fn copies(&self, folder: &Path) -> InputCopies {
        InputCopies {
            folder: folder.to_owned(),
            files: self.files.len() as u64,
            bytes: self
                .files
                .iter()
                .fold(0, |sum, copy| sum.saturating_add(copy.bytes)),
        }
    }
}

/// Returns the folder of the scans and prints of a backup, which need not exist.
pub fn inputs_folder(backup: &Path) -> PathBuf {
    // A path may end with a slash.
    let mut name = backup.file_name().unwrap_or_default().to_owned();
    name.push(ENDING);
    backup.with_file_name(name)
}

/// Returns the copies of scans and prints beside a backup, or `None` if there are none.
///
/// # Errors
/// Refuses a damaged list.
pub fn copies_beside(backup: &Path) -> ProjectResult<Option<InputCopies>> {
    let folder = inputs_folder(backup);
    let list = InputList::read(&folder)?;
    Ok(list
        .filter(|list| !list.files.is_empty())
        .map(|list| list.copies(&folder)))
}

/// Removes what interrupted backups left among the scans and prints beside a backup. Returns how many there were.
pub fn unfinished_copies(backup: &Path) -> usize {
    StagingFolder::remove_stale(&inputs_folder(backup).join(INPUT_LIST))
}

/// Returns whether a folder holds the scans and prints of a backup, which are no new ones.
pub fn is_inputs_folder(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default();
    name.as_encoded_bytes().ends_with(ENDING.as_bytes()) && has_list(folder)
}

/// Returns whether a folder has a list of copies.
pub(crate) fn has_list(folder: &Path) -> bool {
    folder.join(INPUT_LIST).is_file()
}

/// Returns whether a name is that of the list, or of what is written beside it.
pub(crate) fn is_of_list(name: &OsStr) -> bool {
    let beside = format!(".{INPUT_LIST}.");
    name == INPUT_LIST || name.as_encoded_bytes().starts_with(beside.as_bytes())
}

/// Returns whether a path stays below its folder, and is not that of the list.
fn is_below(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let is_plain = parts.all(|part| matches!(part, Component::Normal(_)));
    is_plain && !name.is_empty() && !is_of_list(OsStr::new(name))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{CopiedInput, INPUT_LIST, InputList, copies_beside, inputs_folder};
    use super::{is_inputs_folder, is_of_list};
    use mocban_core::domain::ContentHash;

    fn copy(name: &str) -> CopiedInput {
        CopiedInput {
            stored: format!("/disk/{name}"),
            name: name.to_owned(),
            bytes: 7,
            hash: ContentHash::of(name.as_bytes()),
        }
    }

    #[test]
    fn a_list_is_read_as_it_was_written() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let backup = dir.path().join("ván 4.sqlite");
        let folder = inputs_folder(&backup);
        assert!(folder.ends_with("ván 4.sqlite.inputs"));
        assert_eq!(copies_beside(&backup).expect("looked up"), None);
        std::fs::create_dir(&folder).expect("a folder");
        assert!(!is_inputs_folder(&folder));
        let list = InputList::new(vec![copy("chữ/1.stl"), copy("chữ/1.png")]);
        list.write(&folder).expect("written");
        let read = InputList::read(&folder).expect("read").expect("a list");
        assert_eq!(read, list);
        assert!(is_inputs_folder(&folder) && !is_inputs_folder(dir.path()));
        let found = copies_beside(&backup).expect("read").expect("copies");
        assert_eq!((found.files, found.bytes), (2, 14));
        let entries = std::fs::read_dir(&folder).expect("a folder").flatten();
        assert!(
            entries
                .map(|entry| entry.file_name())
                .all(|name| is_of_list(&name))
        );
    }

    #[test]
    fn a_list_that_is_damaged_or_leads_elsewhere_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let written = |list: &InputList| serde_json::to_string(list).expect("JSON");
        let sound = written(&InputList::new(vec![copy("1.stl")]));
        for text in [
            "{".to_owned(),
            sound.replace("\"schema\":1", "\"schema\":2"),
            written(&InputList::new(vec![copy("../1.stl")])),
            written(&InputList::new(vec![copy("/etc/passwd")])),
            written(&InputList::new(vec![copy("")])),
            written(&InputList::new(vec![copy(INPUT_LIST)])),
            written(&InputList::new(vec![copy("1.stl"), copy("1.stl")])),
        ] {
            std::fs::write(dir.path().join(INPUT_LIST), &text).expect("written");
            let refused = InputList::read(dir.path()).expect_err(&text);
            assert!(
                refused.to_string().contains("make the backup again"),
                "{refused}"
            );
        }
        assert_eq!(
            InputList::read(Path::new("/none")).expect("looked up"),
            None
        );
    }
}
