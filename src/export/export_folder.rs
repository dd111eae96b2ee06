//! The folder of an export, which is replaced as a whole.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::earlier_export;
use super::file_names::LINES;
use crate::store::{Leftover, ReplaceError, ReplacementFolder};

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

    /// Returns whether finishing would replace an earlier export.
    ///
    /// # Errors
    /// Returns an error if the disk fails.
    pub(super) fn replaces(&self) -> Result<bool, FolderError> {
        let lines = self.0.target().join(LINES);
        lines.try_exists().map_err(at(&lines))
    }

    /// Syncs the folder to disk and replaces the target with it.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be synced or renamed, or the target is no longer an export. If the error
    /// occurs before the target is replaced, the target is kept.
    pub(super) fn finish(self) -> Result<Leftover, FolderError> {
        // Somebody may have put files into the target while the export was written.
        refuse_foreign(self.0.target())?;
        Ok(self.0.finish()?)
    }
}

/// Refuses a folder that holds anything an export does not write.
fn refuse_foreign(target: &Path) -> Result<(), FolderError> {
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        found => found.map_err(at(target))?,
    };
    match earlier_export::foreign_entry(target).map_err(at(target))? {
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

#[cfg(test)]
mod tests {
    use super::{Folder, FolderError, LINES};
    use crate::export::file_names::VERDICTS;
    use std::fs;
    use std::path::Path;

    const LINE: &str = r#"{"id":"a","metric":"nl_ssim","status":"done","result_hash":null}"#;

    fn write(target: &Path, text: &str) -> Folder {
        let folder = Folder::begin(target).expect("the target is free");
        fs::write(folder.path().join(LINES), text).expect("written");
        folder
    }

    #[test]
    fn an_earlier_export_is_replaced() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("deep/out");
        for text in ["", LINE, &format!("{LINE}\n{LINE}\n")] {
            let folder = write(&target, text);
            assert_eq!(folder.replaces().expect("known"), target.exists());
            assert!(folder.finish().expect("renamed").is_none());
            assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), text);
        }
    }

    #[test]
    fn a_foreign_folder_is_refused_and_unchanged() {
        let dir = tempfile::tempdir().expect("a folder");
        fs::write(dir.path().join(VERDICTS), "").expect("written");
        fs::write(dir.path().join("thesis.tex"), "").expect("written");
        let refused = Folder::begin(dir.path());
        assert!(matches!(refused, Err(FolderError::NotAnExport(_))));
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 2);
        let file = Folder::begin(&dir.path().join("thesis.tex"));
        assert!(matches!(file, Err(FolderError::Io { .. })));
    }

    #[test]
    fn a_file_that_arrives_during_the_export_keeps_the_target() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        write(&target, LINE).finish().expect("renamed");
        let second = write(&target, "");
        fs::write(target.join("thesis.tex"), "ten years").expect("written");
        assert!(
            matches!(second.finish(), Err(FolderError::NotAnExport(path)) if path.ends_with("thesis.tex"))
        );
        assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), LINE);
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 1);
    }
}
