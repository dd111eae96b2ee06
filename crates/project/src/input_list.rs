//! The folder of scans and prints beside a backup, and the list of what is in it.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::byte_size::byte_size;
use crate::error::{ProjectError, ProjectResult, WithContext as _};
use crate::exit::Refusal;
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::spelling::fold_case;
use mocban_core::domain::{ContentHash, ErrorCode};
use mocban_store::{InputError, StagingFolder, open_regular, read_up_to, write_atomic};

/// The list in a folder of copies.
pub(crate) const INPUT_LIST: &str = "mocban-inputs.json";
/// What the name of the folder has after that of the backup.
const ENDING: &str = ".inputs";
/// Longest list that is written and read, in bytes: about five million inputs.
const MAX_LIST_BYTES: u64 = 1 << 30;
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
        Self::read_plainly(folder).map_err(|error| {
            if error.code() != ErrorCode::Usage {
                return error;
            }
            let folder = shell_quoted(&folder.to_string_lossy());
            let text = format!(
                "{error}; make the backup again, or find its files by their paths with --inputs {folder}"
            );
            ProjectError::from(Refusal::Usage(text))
        })
    }

    /// Reads the list of a folder like [`Self::read`]. The error only says what is wrong with the list.
    pub(crate) fn read_plainly(folder: &Path) -> ProjectResult<Option<Self>> {
        let path = folder.join(INPUT_LIST);
        let failed = || format!("cannot read {}", path.display());
        let file = match open_regular(&path) {
            Err(InputError::NotThere(_)) => return Ok(None),
            Err(InputError::Io { source, .. }) if is_not_there(source.kind()) => return Ok(None),
            opened => opened.with_context(failed)?.0,
        };
        let bytes = read_up_to(file, MAX_LIST_BYTES).with_context(failed)?;
        let refuse = |reason: &str| {
            let text = format!("{} {reason}", path.display());
            Err(Refusal::Usage(text).into())
        };
        let list: Self = match serde_json::from_slice(&bytes) {
            Ok(list) => list,
            Err(error) => return refuse(&format!("is damaged: {error}")),
        };
        if list.schema != SCHEMA {
            return refuse("was written by another version of this program");
        }
        let mut names = HashSet::with_capacity(list.files.len());
        let mut found = list.files.iter().map(|copy| comparable(&copy.name));
        if !found.all(|name| name.is_some_and(|name| names.insert(name))) {
            return refuse("names a file twice or outside its folder");
        }
        Ok(Some(list))
    }

    /// Writes the list to a folder, in place of an earlier one.
    ///
    /// # Errors
    /// Refuses a list that would be too long to be read again.
    pub(crate) fn write(&self, folder: &Path) -> ProjectResult<()> {
        let path = folder.join(INPUT_LIST);
        let bytes = self.encoded(&path, MAX_LIST_BYTES)?;
        let written = write_atomic(&path, &bytes);
        written.with_context(|| format!("cannot write {}", path.display()))
    }

    /// Returns the content of the list, of at most `limit` bytes.
    fn encoded(&self, path: &Path, limit: u64) -> ProjectResult<Vec<u8>> {
        let bytes = serde_json::to_vec(self).map_err(std::io::Error::other)?;
        let length = bytes.len() as u64;
        if length > limit {
            let text = format!(
                "{} would name {} files in {}, and lists of at most {} are read; divide the project into smaller ones",
                path.display(),
                self.files.len(),
                byte_size(length),
                byte_size(limit)
            );
            return Err(Refusal::Usage(text).into());
        }
        Ok(bytes)
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

/// Returns whether a folder holds the scans and prints of a backup. An import must not offer them as new files.
pub fn is_inputs_folder(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default();
    name.as_encoded_bytes().ends_with(ENDING.as_bytes()) && has_list(folder)
}

/// Returns whether a folder has a list of copies.
pub(crate) fn has_list(folder: &Path) -> bool {
    folder.join(INPUT_LIST).is_file()
}

/// Returns whether a name is that of the list, or of what is written beside it, also where upper and lower case are the same.
pub(crate) fn is_of_list(name: &OsStr) -> bool {
    let name = fold_case(&name.to_string_lossy());
    name == INPUT_LIST || name.starts_with(&format!(".{INPUT_LIST}."))
}

/// Returns whether an error says that there is no file with this name.
pub(crate) fn is_not_there(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::InvalidFilename
    )
}

/// Returns a path below its folder in a form that is equal for two paths if some file system takes them for one file. Returns
/// `None` if it leads out of the folder, or to the list.
fn comparable(name: &str) -> Option<String> {
    let parts = Path::new(name).components().map(|part| match part {
        Component::Normal(part) => part.to_str().map(fold_case),
        _ => None,
    });
    let parts = parts.collect::<Option<Vec<String>>>()?;
    let is_list = is_of_list(OsStr::new(parts.first()?));
    (!is_list).then(|| parts.join("/"))
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
            written(&InputList::new(vec![copy("MOCBAN-INPUTS.JSON")])),
            written(&InputList::new(vec![copy(".mocban-inputs.json.1/new")])),
            written(&InputList::new(vec![copy("1.stl"), copy("1.stl")])),
            written(&InputList::new(vec![copy("a/1.stl"), copy("a//1.stl")])),
            written(&InputList::new(vec![copy("a/1.stl"), copy("a/./1.stl")])),
            written(&InputList::new(vec![copy("a/1.stl"), copy("A/1.STL")])),
            written(&InputList::new(vec![
                copy("\u{1eef}.stl"),
                copy("u\u{31b}\u{303}.stl"),
            ])),
        ] {
            std::fs::write(dir.path().join(INPUT_LIST), &text).expect("written");
            let refused = InputList::read(dir.path()).expect_err(&text);
            assert!(
                refused.to_string().contains("make the backup again"),
                "{refused}"
            );
            let plain = InputList::read_plainly(dir.path()).expect_err(&text);
            assert!(!plain.to_string().contains("--inputs"), "{plain}");
        }
        let folder = dir.path().join("ván 4.inputs");
        std::fs::create_dir(&folder).expect("a folder");
        std::fs::write(folder.join(INPUT_LIST), "{").expect("written");
        let refused = InputList::read(&folder).expect_err("damaged").to_string();
        let option = format!("--inputs '{}'", folder.display());
        assert!(refused.ends_with(&option), "{refused}");
        assert_eq!(
            InputList::read(Path::new("/none")).expect("looked up"),
            None
        );
    }

    #[test]
    fn a_list_that_would_be_too_long_to_be_read_is_not_written() {
        let list = InputList::new(vec![copy("1.stl"), copy("2.stl")]);
        let path = Path::new("b.inputs/mocban-inputs.json");
        let bytes = list.encoded(path, 1_000).expect("short enough");
        let length = bytes.len() as u64;
        list.encoded(path, length).expect("just short enough");
        let refused = list.encoded(path, length - 1).expect_err("too long");
        let text = refused.to_string();
        assert!(
            text.contains("would name 2 files") && text.contains("divide the project"),
            "{text}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_no_list_and_is_not_waited_for() {
        use rustix::fs::{CWD, FileType, Mode, mknodat};

        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join(INPUT_LIST);
        mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
        let refused = InputList::read(dir.path()).expect_err("a pipe").to_string();
        assert!(refused.contains("is a pipe"), "{refused}");
    }
}
