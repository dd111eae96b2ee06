//! The folder of an export, which is replaced as a whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use super::manifest::{self, MANIFEST};
use mocban_core::domain::{ErrorCode, Explained};
use mocban_store::{Leftover, ReplaceError, ReplacementFolder, create_folders};

/// An export that is written next to its target and then replaces the target.
#[derive(Debug)]
pub(super) struct Folder(ReplacementFolder);

/// Why an export folder cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds something that no export writes.
    #[error(
        "{0} is not part of an export, so its folder is not replaced; choose an empty or new folder"
    )]
    NotAnExport(PathBuf),
    /// Somebody edited a file of an earlier export.
    #[error(
        "{0} was changed after it was written, so its folder is not replaced; move the file elsewhere, or choose another folder"
    )]
    Changed(PathBuf),
    /// A file is where the folder should be.
    #[error("{0} is a file; name a folder for the export")]
    IsFile(PathBuf),
    /// The folder cannot be replaced.
    #[error("{0}")]
    Replace(#[from] ReplaceError),
    /// An operation on the file system failed.
    #[error("{path}: {source}")]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Explained for FolderError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::NotAnExport(_) | Self::Changed(_) | Self::IsFile(_) => ErrorCode::Usage,
            Self::Replace(error) => error.code(),
            Self::Io { .. } => ErrorCode::Unexpected,
        }
    }
}

impl Folder {
    /// Creates an empty folder next to `target`, which must be new, empty or an earlier export.
    ///
    /// # Errors
    /// Returns an error if the target holds anything else, another process writes it, or the folder cannot be created.
    pub(super) fn begin(target: &Path) -> Result<Self, FolderError> {
        refuse_foreign(target)?;
        Ok(Self(ReplacementFolder::begin(target)?))
    }

    /// Returns the folder to write to.
    pub(super) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Returns the folder that will be replaced.
    pub(super) fn target(&self) -> &Path {
        self.0.target()
    }

    /// Returns whether finishing would replace an earlier export.
    pub(super) fn replaces(&self) -> Result<bool, FolderError> {
        let manifest = self.target().join(MANIFEST);
        manifest.try_exists().map_err(at(&manifest))
    }

    /// Syncs the folder to disk and replaces the target with it.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be synced or renamed, or the target is no longer an export. If the error
    /// occurs before the target is replaced, the target is kept.
    pub(super) fn finish(self) -> Result<Leftover, FolderError> {
        // Somebody may have put files into the target while the export was written.
        refuse_foreign(self.target())?;
        Ok(self.0.finish()?)
    }
}

/// Refuses a folder that holds anything an export does not write.
fn refuse_foreign(target: &Path) -> Result<(), FolderError> {
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        found => found.map_err(at(target))?,
    };
    if target.is_file() {
        return Err(FolderError::IsFile(target.to_owned()));
    }
    match manifest::foreign_entry(target).map_err(at(target))? {
        Some(entry) => Err(FolderError::NotAnExport(entry)),
        None => Ok(()),
    }
}

/// Returns a conversion of errors of operations on a file or folder.
pub(super) fn at(path: &Path) -> impl Fn(io::Error) -> FolderError {
    let path = path.to_owned();
    move |source| FolderError::Io {
        path: path.clone(),
        source,
    }
}

/// Writes a file below a folder, and creates its parent folders.
pub(super) fn write_below(root: &Path, below: &str, bytes: &[u8]) -> Result<(), FolderError> {
    let path = root.join(below);
    path.parent()
        .map_or(Ok(()), create_folders)
        .map_err(at(&path))?;
    fs::write(&path, bytes).map_err(at(&path))
}

/// Removes a file below a folder, and its parent folders if they are then empty.
pub(super) fn remove_below(root: &Path, below: &str) -> Result<(), FolderError> {
    let path = root.join(below);
    fs::remove_file(&path).map_err(at(&path))?;
    let parents = path
        .ancestors()
        .skip(1)
        .take_while(|parent| *parent != root);
    for parent in parents {
        if fs::remove_dir(parent).is_err() {
            break;
        }
    }
    Ok(())
}

/// A file that pairs share, written in the order of the catalog.
#[derive(Debug)]
pub(super) struct SharedFile {
    path: PathBuf,
    file: BufWriter<File>,
}

impl SharedFile {
    /// Creates an empty file below a folder.
    pub(super) fn create(root: &Path, below: &str) -> Result<Self, FolderError> {
        let path = root.join(below);
        let file = BufWriter::new(File::create(&path).map_err(at(&path))?);
        Ok(Self { path, file })
    }

    /// Appends bytes.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), FolderError> {
        self.file.write_all(bytes).map_err(at(&self.path))
    }

    /// Writes what is buffered.
    pub(super) fn flush(&mut self) -> Result<(), FolderError> {
        self.file.flush().map_err(at(&self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::{Folder, FolderError, MANIFEST};
    use std::fs;
    use std::path::Path;

    const LINES: &str = "pairs.jsonl";
    const LIST: &str = r#"{"mocban_export":1,"files":["export.json","pairs.jsonl"]}"#;

    fn write(target: &Path, text: &str) -> Folder {
        let folder = Folder::begin(target).expect("the target is free");
        fs::write(folder.path().join(LINES), text).expect("written");
        fs::write(folder.path().join(MANIFEST), LIST).expect("written");
        folder
    }

    #[test]
    fn an_earlier_export_is_replaced() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("deep/out");
        for text in ["", "one", "two"] {
            let folder = write(&target, text);
            assert_eq!(folder.replaces().expect("known"), target.exists());
            assert!(folder.finish().expect("renamed").is_none());
            assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), text);
        }
    }

    #[test]
    fn a_foreign_folder_is_refused_and_unchanged() {
        let dir = tempfile::tempdir().expect("a folder");
        fs::write(dir.path().join(LINES), "").expect("written");
        fs::write(dir.path().join("thesis.tex"), "").expect("written");
        let refused = Folder::begin(dir.path());
        assert!(matches!(refused, Err(FolderError::NotAnExport(_))));
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 2);
        let file = Folder::begin(&dir.path().join("thesis.tex"));
        assert!(matches!(file, Err(FolderError::IsFile(_))));
    }

    #[test]
    fn a_file_that_arrives_during_the_export_keeps_the_target() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        write(&target, "one").finish().expect("renamed");
        let second = write(&target, "");
        fs::write(target.join("thesis.tex"), "ten years").expect("written");
        assert!(
            matches!(second.finish(), Err(FolderError::NotAnExport(path)) if path.ends_with("thesis.tex"))
        );
        assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), "one");
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 1);
    }
}
