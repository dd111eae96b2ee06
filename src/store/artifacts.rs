//! Artifacts: files named by their content, either whole or not there.
//!
//! Temporary name, write, fsync, rename, fsync of the directory: only then may a row of the catalog name it.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::Project;
use super::atomic_write::{parent_folder, sync_folder, write_synced};
use crate::domain::{ArtifactRef, ArtifactSet, ContentHash};

/// An artifact that is not on disk yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewArtifact {
    role: String,
    reference: ArtifactRef,
    bytes: Vec<u8>,
}

impl NewArtifact {
    /// Bytes with what they are for their stage, such as `depth.png`, and the ending of the file name without the dot.
    pub fn new(role: &str, ext: &str, bytes: Vec<u8>) -> Self {
        let reference = ArtifactRef {
            hash: ContentHash::of(&bytes),
            ext: ext.to_owned(),
            bytes: bytes.len() as u64,
        };
        Self {
            role: role.to_owned(),
            reference,
            bytes,
        }
    }

    /// What it is for its stage.
    pub fn role(&self) -> &str {
        &self.role
    }

    /// How it will be named.
    pub const fn reference(&self) -> &ArtifactRef {
        &self.reference
    }
}

/// Why an artifact could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArtifactError {
    /// A row names it, but it is gone.
    #[error("artifact {0} is missing")]
    Missing(PathBuf),
    /// It is not what it was when it was written.
    #[error("artifact {0} was changed: its bytes do not match its name")]
    Changed(PathBuf),
    /// A file operation failed.
    #[error("artifact {path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl ArtifactError {
    fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

/// Makes temporary names of one process unlike each other.
static NEXT: AtomicU64 = AtomicU64::new(0);

impl Project {
    /// Where an artifact lies.
    pub fn artifact_path(&self, artifact: &ArtifactRef) -> PathBuf {
        let hex = artifact.hash.to_hex();
        let name = format!("{hex}.{}", artifact.ext);
        self.artifacts_dir().join(&hex[..2]).join(name)
    }

    /// The bytes of an artifact, checked against its hash.
    ///
    /// # Errors
    /// When the file is missing, unreadable or not what it was.
    pub fn read_artifact(&self, artifact: &ArtifactRef) -> Result<Vec<u8>, ArtifactError> {
        let path = self.artifact_path(artifact);
        match std::fs::read(&path) {
            Ok(bytes) if ContentHash::of(&bytes) == artifact.hash => Ok(bytes),
            Ok(_) => Err(ArtifactError::Changed(path)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                Err(ArtifactError::Missing(path))
            }
            Err(source) => Err(ArtifactError::Io { path, source }),
        }
    }

    /// Whether an artifact is there and whole, without holding it in memory; `quick` compares its length only.
    ///
    /// # Errors
    /// When the file is missing, unreadable or not what it was.
    pub fn check_artifact(&self, artifact: &ArtifactRef, quick: bool) -> Result<(), ArtifactError> {
        let path = self.artifact_path(artifact);
        let found = match std::fs::metadata(&path) {
            Ok(meta) if meta.len() != artifact.bytes => Ok(false),
            Ok(_) if quick => Ok(true),
            Ok(_) => is_of(&path, &artifact.hash),
            Err(error) => Err(error),
        };
        match found {
            Ok(true) => Ok(()),
            Ok(false) => Err(ArtifactError::Changed(path)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                Err(ArtifactError::Missing(path))
            }
            Err(source) => Err(ArtifactError::Io { path, source }),
        }
    }

    /// Writes artifacts so that all are on disk for good when this returns. One that is there already is left.
    ///
    /// # Errors
    /// When the disk refuses; what was written stays, and harms nobody.
    pub fn write_artifacts(&self, files: &[NewArtifact]) -> Result<ArtifactSet, ArtifactError> {
        self.write_artifacts_with(files, &|| {})
    }

    /// [`Project::write_artifacts`] that calls `tell` for each file that is on disk under a temporary name and is
    /// about to get its own.
    ///
    /// # Errors
    /// When the disk refuses; what was written stays, and harms nobody.
    pub fn write_artifacts_with(
        &self,
        files: &[NewArtifact],
        tell: &dyn Fn(),
    ) -> Result<ArtifactSet, ArtifactError> {
        let mut written = ArtifactSet::new();
        let mut folders = std::collections::BTreeSet::new();
        for file in files {
            let path = self.artifact_path(&file.reference);
            let folder = parent_folder(&path);
            make_folder(&folder)?;
            if self.read_artifact(&file.reference).is_err() {
                self.place(&path, &file.bytes, tell)?;
            }
            folders.insert(folder);
            written.insert(file.role.clone(), file.reference.clone());
        }
        for folder in &folders {
            sync(folder)?;
        }
        if !folders.is_empty() {
            // These folders may be new, whoever made them: it may have died, or not have come to syncing, before it
            // had their names on disk. Where nothing is new this takes no time.
            sync(&self.artifacts_dir())?;
            sync(self.dir())?;
        }
        Ok(written)
    }

    /// Removes what an earlier process left half-written. Only while no other process writes.
    ///
    /// # Errors
    /// When the folder cannot be read or a file not removed.
    pub fn clear_temporary(&self) -> Result<(), ArtifactError> {
        let folder = self.temporary_dir();
        match std::fs::remove_dir_all(&folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(ArtifactError::io(&folder)(error))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn temporary_dir(&self) -> PathBuf {
        self.artifacts_dir().join("tmp")
    }

    fn place(&self, path: &Path, bytes: &[u8], tell: &dyn Fn()) -> Result<(), ArtifactError> {
        let folder = self.temporary_dir();
        make_folder(&folder)?;
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let temporary = folder.join(format!("{}-{number}", std::process::id()));
        let outcome = write_synced(&temporary, bytes)
            .and_then(|()| {
                tell();
                std::fs::rename(&temporary, path)
            })
            .map_err(ArtifactError::io(path));
        if outcome.is_err() {
            // A full disk is better without it; that it cannot be removed changes nothing.
            let _ = std::fs::remove_file(&temporary);
        }
        outcome
    }
}

/// Whether the bytes of a file have this hash.
fn is_of(path: &Path, hash: &ContentHash) -> std::io::Result<bool> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path)?)?;
    Ok(hasher.finalize().as_bytes() == hash.as_bytes())
}

fn sync(folder: &Path) -> Result<(), ArtifactError> {
    sync_folder(folder).map_err(ArtifactError::io(folder))
}

fn make_folder(folder: &Path) -> Result<(), ArtifactError> {
    std::fs::create_dir_all(folder).map_err(ArtifactError::io(folder))
}

#[cfg(test)]
mod tests {
    use super::{ArtifactError, NewArtifact};
    use crate::store::Project;

    fn project() -> (tempfile::TempDir, Project) {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        (dir, project)
    }

    fn picture(bytes: &[u8]) -> NewArtifact {
        NewArtifact::new("depth.png", "png", bytes.to_owned())
    }

    #[test]
    fn what_was_written_is_read_back_and_the_same_bytes_are_one_file() {
        let (_dir, project) = project();
        let first = project.write_artifacts(&[picture(b"a")]).expect("written");
        let second = project.write_artifacts(&[picture(b"a")]).expect("written");
        assert_eq!(first, second);
        let artifact = &first["depth.png"];
        assert_eq!(project.read_artifact(artifact).expect("read"), b"a");
        let left = std::fs::read_dir(project.artifacts_dir().join("tmp")).expect("a folder");
        assert_eq!(left.count(), 0);
    }

    #[test]
    fn a_changed_artifact_is_told_and_written_anew() {
        let (_dir, project) = project();
        let written = project.write_artifacts(&[picture(b"a")]).expect("written");
        let artifact = &written["depth.png"];
        assert!(project.check_artifact(artifact, false).is_ok());
        std::fs::write(project.artifact_path(artifact), b"b").expect("a file");
        let outcome = project.read_artifact(artifact);
        assert!(matches!(outcome, Err(ArtifactError::Changed(_))));
        let outcome = project.check_artifact(artifact, false);
        assert!(matches!(outcome, Err(ArtifactError::Changed(_))));
        // Of the same length: only its bytes tell.
        assert!(project.check_artifact(artifact, true).is_ok());
        project.write_artifacts(&[picture(b"a")]).expect("written");
        assert_eq!(project.read_artifact(artifact).expect("read"), b"a");
    }

    #[test]
    fn a_missing_artifact_is_told() {
        let (_dir, project) = project();
        let outcome = project.read_artifact(picture(b"a").reference());
        assert!(matches!(outcome, Err(ArtifactError::Missing(_))));
        let outcome = project.check_artifact(picture(b"a").reference(), true);
        assert!(matches!(outcome, Err(ArtifactError::Missing(_))));
    }
}
