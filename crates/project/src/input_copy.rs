//! Copies one input to a folder: the copy gets its name when it is whole, and an equal one stays.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use crate::error::{ProjectError, ProjectResult, WithContext as _};
use mocban_core::domain::ContentHash;
use mocban_store::{
    Input, InputError, StagingFolder, create_folders, hash_input, open_input, rename_into_place,
};

/// Number of bytes that are read at a time.
const CHUNK: usize = 1 << 17;
/// Name of the unfinished copy.
const NEW: &str = "new";

/// Copies inputs to a folder.
#[derive(Debug)]
pub(crate) struct InputCopier {
    folder: PathBuf,
    /// A hidden folder on the same disk.
    staging: StagingFolder,
}

/// What became of an input.
#[derive(Debug)]
pub(crate) enum CopyOutcome {
    /// A whole copy is in the folder.
    There {
        /// Its length.
        bytes: u64,
        /// Hash of its content.
        hash: ContentHash,
        /// Whether it was there before.
        was_there: bool,
    },
    /// The input has another content than it may have.
    Other,
    /// The input cannot be read.
    Unread(InputError),
    /// The folder can have no file of this name or length. Other inputs may be copied.
    Unwritable,
}

/// Why no copy was written.
enum CopyFailure {
    Source(InputError),
    Target(std::io::Error),
}

impl InputCopier {
    /// Starts to copy to a folder, with a staging folder in it. `beside` names the file of the folder that the staging
    /// folder belongs to.
    pub(crate) fn begin(folder: &Path, beside: &str) -> std::io::Result<Self> {
        create_folders(folder)?;
        Ok(Self {
            staging: StagingFolder::beside(&folder.join(beside))?,
            folder: folder.to_owned(),
        })
    }

    /// Copies an input whose content `may_be` allows, under a name below the folder. `there` is the hash of the file that
    /// has this name already.
    ///
    /// # Errors
    /// Returns an error if the disk is full or fails, so that no other copy can be written either.
    pub(crate) fn copy(
        &self,
        input: &Input,
        name: &str,
        there: Option<ContentHash>,
        may_be: impl Fn(ContentHash) -> bool,
    ) -> ProjectResult<CopyOutcome> {
        let target = self.folder.join(name);
        if let Some(there) = there {
            match hash_input(input) {
                Err(error) => return Ok(CopyOutcome::Unread(error)),
                Ok(read) if !may_be(read.hash) => return Ok(CopyOutcome::Other),
                Ok(read) if read.hash == there => {
                    return Ok(CopyOutcome::There {
                        bytes: self.len_of(name)?,
                        hash: there,
                        was_there: true,
                    });
                }
                Ok(_) => {}
            }
        }
        if link_below(&self.folder, name).is_some() {
            return Ok(CopyOutcome::Unwritable);
        }
        let staged = self.staging.path().join(NEW);
        // What an earlier input has left.
        let _ = std::fs::remove_file(&staged);
        let failed = || {
            format!(
                "cannot copy {} to {}",
                input.path().display(),
                target.display()
            )
        };
        let (hash, bytes) = match copied(input, &staged) {
            Err(CopyFailure::Source(error)) => return Ok(CopyOutcome::Unread(error)),
            Err(CopyFailure::Target(error)) if is_of_one_file(&error) => {
                return Ok(CopyOutcome::Unwritable);
            }
            Err(CopyFailure::Target(error)) => {
                return Err(ProjectError::from(error).context(failed()));
            }
            Ok(copied) => copied,
        };
        if !may_be(hash) {
            return Ok(CopyOutcome::Other);
        }
        let placed = target.parent().map_or(Ok(()), create_folders);
        match placed.and_then(|()| rename_into_place(&staged, &target)) {
            Err(error) if is_of_one_file(&error) => return Ok(CopyOutcome::Unwritable),
            placed => placed.with_context(failed)?,
        }
        Ok(CopyOutcome::There {
            bytes,
            hash,
            was_there: false,
        })
    }

    /// Returns the length of the copy that is there already.
    pub(crate) fn len_of(&self, name: &str) -> ProjectResult<u64> {
        let path = self.folder.join(name);
        let failed = || format!("cannot read {}", path.display());
        Ok(std::fs::metadata(&path).with_context(failed)?.len())
    }

    /// Returns the hash of the copy that is there already. A link is no copy.
    pub(crate) fn hash_of(&self, name: &str) -> Option<ContentHash> {
        match link_below(&self.folder, name) {
            None => file_hash(&self.folder.join(name)),
            Some(_) => None,
        }
    }
}

/// Returns the first link on the way from a folder to a path below it.
pub(crate) fn link_below(folder: &Path, name: &str) -> Option<PathBuf> {
    let mut path = folder.to_owned();
    Path::new(name).components().find_map(|part| {
        path.push(part);
        let meta = std::fs::symlink_metadata(&path).ok()?;
        meta.is_symlink().then(|| path.clone())
    })
}

/// Returns whether an error is about the name, the place or the length of one file, and not about the disk.
fn is_of_one_file(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::AlreadyExists
            | ErrorKind::DirectoryNotEmpty
            | ErrorKind::FileTooLarge
            | ErrorKind::InvalidFilename
            | ErrorKind::InvalidInput
            | ErrorKind::IsADirectory
            | ErrorKind::NotADirectory
            | ErrorKind::PermissionDenied
    )
}

/// Returns the hash of a file, or `None` if it cannot be read.
pub(crate) fn file_hash(path: &Path) -> Option<ContentHash> {
    let read = hash_input(&Input::file(path)).ok()?;
    Some(read.hash)
}

/// Writes the content of an input to a new file. Returns its hash and length.
fn copied(input: &Input, to: &Path) -> Result<(ContentHash, u64), CopyFailure> {
    let mut reader = open_input(input, u64::MAX, "no limit").map_err(CopyFailure::Source)?;
    let mut file = File::create_new(to).map_err(CopyFailure::Target)?;
    let mut buffer = vec![0; CHUNK];
    let mut bytes = 0;
    loop {
        let count = match reader.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(CopyFailure::Source(reader.error(error))),
        };
        let written = file.write_all(&buffer[..count]);
        written.map_err(CopyFailure::Target)?;
        bytes += count as u64;
    }
    let version = reader.finish().map_err(CopyFailure::Source)?;
    Ok((version.hash, bytes))
}

#[cfg(test)]
mod tests {
    #[cfg(unix)]
    use super::link_below;
    use super::{CopyOutcome, InputCopier};
    use mocban_core::domain::ContentHash;
    use mocban_store::Input;

    #[test]
    fn a_copy_is_whole_and_an_equal_one_stays() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let scan = dir.path().join("chữ.stl");
        std::fs::write(&scan, "scan").expect("written");
        let folder = dir.path().join("copies");
        let copier = InputCopier::begin(&folder, "list").expect("a folder");
        let copy = |may_be: &dyn Fn(ContentHash) -> bool| {
            let name = "a/chữ.stl";
            let copied = copier.copy(&Input::file(&scan), name, copier.hash_of(name), may_be);
            copied.expect("the disk works")
        };
        let hash = ContentHash::of(b"scan");
        for is_there in [false, true] {
            assert!(
                matches!(copy(&|_| true), CopyOutcome::There { bytes: 4, hash: found, was_there }
                    if found == hash && was_there == is_there)
            );
        }
        let target = folder.join("a/chữ.stl");
        std::fs::write(&target, "half").expect("written");
        assert!(matches!(
            copy(&|_| true),
            CopyOutcome::There {
                was_there: false,
                ..
            }
        ));
        assert_eq!(std::fs::read(&target).expect("read"), b"scan");
        std::fs::write(&scan, "another").expect("written");
        assert!(matches!(copy(&|found| found == hash), CopyOutcome::Other));
        assert_eq!(std::fs::read(&target).expect("read"), b"scan", "it is kept");
        std::fs::remove_file(&scan).expect("removed");
        assert!(matches!(copy(&|_| true), CopyOutcome::Unread(_)));
        drop(copier);
        assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 1);
    }

    #[test]
    fn a_folder_in_the_way_of_a_copy_stays_and_other_copies_are_written() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let scan = dir.path().join("1.stl");
        std::fs::write(&scan, "scan").expect("written");
        std::fs::create_dir_all(dir.path().join("copies/1.stl/mine")).expect("a folder");
        let copier = InputCopier::begin(&dir.path().join("copies"), "list").expect("a folder");
        let copy = |name: &str| {
            let copied = copier.copy(&Input::file(&scan), name, None, |_| true);
            copied.expect("the disk works")
        };
        let long = "x".repeat(300);
        let below = format!("{long}/1.stl");
        for name in ["1.stl", long.as_str(), below.as_str()] {
            assert!(matches!(copy(name), CopyOutcome::Unwritable), "{name}");
        }
        assert!(dir.path().join("copies/1.stl/mine").is_dir());
        assert!(matches!(copy("2.stl"), CopyOutcome::There { .. }));
        assert!(matches!(copy("2.stl/3.stl"), CopyOutcome::Unwritable));
    }

    #[cfg(unix)]
    #[test]
    fn nothing_is_read_or_written_through_a_link() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let scan = dir.path().join("1.stl");
        std::fs::write(&scan, "scan").expect("written");
        let (elsewhere, folder) = (dir.path().join("elsewhere"), dir.path().join("copies"));
        std::fs::create_dir(&elsewhere).expect("a folder");
        let copier = InputCopier::begin(&folder, "list").expect("a folder");
        for (to, link) in [(&scan, "1.stl"), (&elsewhere, "a")] {
            std::os::unix::fs::symlink(to, folder.join(link)).expect("a link");
        }
        for name in ["1.stl", "a/1.stl"] {
            assert_eq!(copier.hash_of(name), None, "{name}");
            let copied = copier.copy(&Input::file(&scan), name, None, |_| true);
            let copied = copied.expect("the disk works");
            assert!(matches!(copied, CopyOutcome::Unwritable), "{name}");
        }
        assert_eq!(link_below(&folder, "a/1.stl"), Some(folder.join("a")));
        let written = std::fs::read_dir(&elsewhere).expect("a folder").count();
        assert_eq!(written, 0, "nothing is written elsewhere");
    }
}
