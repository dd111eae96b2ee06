//! Artifacts: files that are named by the hash of their content. A file with such a name is complete.
//!
//! A file is written under a temporary name, synced, and renamed, and then its folder is synced (`artifact_writer.rs`).
//! Only after that may a row of the catalog name the file.

use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use super::Project;
use super::artifact_error::ArtifactError;
use super::open_file::{open_regular, regular_metadata};
use mocban_core::domain::{ArtifactRef, ContentHash};

/// An artifact that is not on disk yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewArtifact {
    role: String,
    reference: ArtifactRef,
    bytes: Vec<u8>,
}

impl NewArtifact {
    /// Creates an artifact. `role` is its purpose in the stage, such as `depth.png`. `ext` is the file extension
    /// without the dot.
    pub fn new(role: &str, ext: &str, bytes: Vec<u8>) -> Self {
        let reference = ArtifactRef {
            hash: ContentHash::of(&bytes),
            ext: ext.to_owned(),
            bytes: bytes.len() as u64,
            pack: None,
        };
        Self {
            role: role.to_owned(),
            reference,
            bytes,
        }
    }

    /// Returns its role in the stage.
    pub fn role(&self) -> &str {
        &self.role
    }

    /// Returns the reference under which it will be stored.
    pub const fn reference(&self) -> &ArtifactRef {
        &self.reference
    }

    /// Returns its content.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

impl Project {
    /// Returns the path of an artifact, or in an object store the address of its pack or object.
    pub fn artifact_path(&self, artifact: &ArtifactRef) -> PathBuf {
        if let Some(location) = &artifact.pack {
            return self.pack_path(&location.name);
        }
        if let Some((_, bucket, key)) = self.artifact_object(artifact) {
            return bucket.address_of(&key).into();
        }
        self.local_path(artifact)
    }

    /// Returns the path of an artifact in the project's folder.
    pub(super) fn local_path(&self, artifact: &ArtifactRef) -> PathBuf {
        self.dir().join(artifact.path_of_file())
    }

    /// Reads an artifact and checks its hash.
    ///
    /// # Errors
    /// Returns an error if the file is missing, unreadable or changed.
    pub fn read_artifact(&self, artifact: &ArtifactRef) -> Result<Vec<u8>, ArtifactError> {
        if let Some(location) = &artifact.pack {
            return self.read_packed(artifact, location);
        }
        if let Some((_, bucket, key)) = self.artifact_object(artifact) {
            return Self::read_object(bucket, &key, artifact);
        }
        self.read_local(artifact)
    }

    /// Reads an artifact in the project's folder.
    pub(super) fn read_local(&self, artifact: &ArtifactRef) -> Result<Vec<u8>, ArtifactError> {
        let path = self.local_path(artifact);
        let (file, meta) = open_regular(&path)?;
        if meta.len() != artifact.bytes {
            return Err(ArtifactError::Changed(path));
        }
        let mut bytes = Vec::new();
        // The file may still grow.
        file.take(artifact.bytes)
            .read_to_end(&mut bytes)
            .map_err(ArtifactError::io(&path))?;
        if ContentHash::of(&bytes) == artifact.hash {
            Ok(bytes)
        } else {
            Err(ArtifactError::Changed(path))
        }
    }

    /// Checks an artifact's length and hash without loading the file into memory. If `quick` is set, skips the hash.
    ///
    /// # Errors
    /// Returns an error if the file is missing, unreadable or changed.
    pub fn check_artifact(&self, artifact: &ArtifactRef, quick: bool) -> Result<(), ArtifactError> {
        if let Some(location) = &artifact.pack {
            return self.check_packed(artifact, location, quick);
        }
        if let Some((_, bucket, key)) = self.artifact_object(artifact) {
            return Self::check_object(bucket, &key, artifact, quick);
        }
        let path = self.local_path(artifact);
        let is_complete = regular_metadata(&path)?.len() == artifact.bytes
            && (quick || has_hash(&path, &artifact.hash)?);
        if is_complete {
            Ok(())
        } else {
            Err(ArtifactError::Changed(path))
        }
    }

    /// Removes the temporary files of killed processes. No process may write artifacts during this call.
    ///
    /// # Errors
    /// Returns an error if their folder exists and cannot be removed.
    pub fn clear_temporary(&self) -> Result<(), ArtifactError> {
        let folder = self.temporary_dir();
        match std::fs::remove_dir_all(&folder) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(ArtifactError::io(&folder)(error))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn temporary_dir(&self) -> PathBuf {
        self.artifacts_dir().join("tmp")
    }

    /// Checks that the project's directory was not renamed or removed since it was opened.
    ///
    /// # Errors
    /// Returns an error if the directory was renamed or removed, or if the disk fails.
    pub fn check_in_place(&self) -> Result<(), ArtifactError> {
        if self.is_in_place().map_err(ArtifactError::io(self.dir()))? {
            Ok(())
        } else {
            Err(ArtifactError::Moved(self.dir().to_owned()))
        }
    }
}

/// Returns whether the bytes of a file have this hash.
fn has_hash(path: &Path, hash: &ContentHash) -> Result<bool, ArtifactError> {
    let (file, _) = open_regular(path)?;
    let mut hasher = blake3::Hasher::new();
    hasher
        .update_reader(file)
        .map_err(ArtifactError::io(path))?;
    Ok(hasher.finalize().as_bytes() == hash.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::{ArtifactError, NewArtifact};
    use crate::Project;

    fn project() -> (tempfile::TempDir, Project) {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        (dir, project)
    }

    fn image(bytes: &[u8]) -> NewArtifact {
        NewArtifact::new("depth.png", "png", bytes.to_owned())
    }

    fn write(project: &Project, artifact: &NewArtifact) {
        let files = std::slice::from_ref(artifact);
        project.write_artifacts(files, &|| {}).expect("written");
    }

    #[test]
    fn an_artifact_is_read_back_and_the_same_bytes_are_one_file() {
        let (_dir, project) = project();
        let image = image(b"a");
        for _ in 0..2 {
            write(&project, &image);
        }
        let read = project.read_artifact(image.reference());
        assert_eq!(read.expect("read"), b"a");
        let folder = project.artifact_path(image.reference());
        let folder = folder.parent().expect("a folder");
        assert_eq!(std::fs::read_dir(folder).expect("a folder").count(), 1);
        let left = std::fs::read_dir(project.artifacts_dir().join("tmp")).expect("a folder");
        assert_eq!(left.count(), 0);
    }

    #[test]
    fn a_changed_artifact_is_found_and_written_again() {
        let (_dir, project) = project();
        let image = image(b"a");
        write(&project, &image);
        let artifact = image.reference();
        assert!(project.check_artifact(artifact, false).is_ok());
        std::fs::write(project.artifact_path(artifact), b"b").expect("a file");
        let outcome = project.read_artifact(artifact);
        assert!(matches!(outcome, Err(ArtifactError::Changed(_))));
        let outcome = project.check_artifact(artifact, false);
        assert!(matches!(outcome, Err(ArtifactError::Changed(_))));
        // The length is the same, so only the bytes show it.
        assert!(project.check_artifact(artifact, true).is_ok());
        write(&project, &image);
        assert_eq!(project.read_artifact(artifact).expect("read"), b"a");
    }

    #[test]
    fn a_folder_with_the_name_of_an_artifact_is_named_and_left_alone() {
        let (_dir, project) = project();
        let image = image(b"a");
        let path = project.artifact_path(image.reference());
        std::fs::create_dir_all(path.join("mine")).expect("a folder");
        let text = format!("{} is a directory, where", path.display());
        let files = std::slice::from_ref(&image);
        for outcome in [
            project.write_artifacts(files, &|| {}),
            project.check_artifact(image.reference(), true),
            project.read_artifact(image.reference()).map(drop),
        ] {
            let error = outcome.expect_err("no file can be there");
            assert!(matches!(error, ArtifactError::Blocked { .. }), "{error}");
            assert!(error.to_string().starts_with(&text), "{error}");
        }
        assert!(path.join("mine").exists());
        write(
            &project,
            &NewArtifact::new("depth.png", "png", b"b".to_vec()),
        );
    }

    #[test]
    fn a_missing_artifact_is_found() {
        let (_dir, project) = project();
        let outcome = project.read_artifact(image(b"a").reference());
        assert!(matches!(outcome, Err(ArtifactError::Missing(_))));
        let outcome = project.check_artifact(image(b"a").reference(), true);
        assert!(matches!(outcome, Err(ArtifactError::Missing(_))));
    }
}
