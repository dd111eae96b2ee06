//! The place of a project's artifacts as a whole: whether it can be read, and whether it holds any.

use std::io::{self, ErrorKind};

use super::artifact_error::ArtifactError;
use super::owner_record::is_owner_record;
use super::{Project, ProjectStorage};

impl Project {
    /// Checks that the folder of the artifacts, and their object store if the settings name one, can be read. A folder
    /// that does not exist is no error. Sends a request that is given up soon. May block.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be listed, is not a folder or is a link to one that is missing, or if the
    /// store refuses the request or does not answer.
    pub fn check_artifacts_place(&self) -> Result<(), ArtifactError> {
        self.check_artifacts_folder()?;
        match self.storage().and_then(ProjectStorage::artifacts) {
            Some(bucket) => bucket.check().map_err(ArtifactError::Bucket),
            None => Ok(()),
        }
    }

    /// Like [`Self::check_artifacts_place`], for the folder alone.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be listed, is not a folder, or is a link to one that is missing.
    pub fn check_artifacts_folder(&self) -> Result<(), ArtifactError> {
        let folder = self.artifacts_dir();
        let first = std::fs::read_dir(&folder).map(|mut entries| entries.next().transpose());
        let Err(error) = first.and_then(|first| first) else {
            return Ok(());
        };
        match error.kind() {
            ErrorKind::NotFound if folder.symlink_metadata().is_ok() => {
                let text = "it is a link to a folder that is not there; mount its disk, or correct the link";
                Err(ArtifactError::io(&folder)(io::Error::other(text)))
            }
            ErrorKind::NotFound => Ok(()),
            ErrorKind::NotADirectory => {
                let blocked = ArtifactError::blocked_folder(&folder.join("file"));
                Err(blocked.unwrap_or_else(|| ArtifactError::io(&folder)(error)))
            }
            _ => Err(ArtifactError::io(&folder)(error)),
        }
    }

    /// Returns whether the folder of artifacts is missing or holds none. Returns `false` if artifacts are in an object
    /// store, or if the folder cannot be read.
    pub fn has_no_artifacts(&self) -> bool {
        if self.has_packs() {
            return false;
        }
        let temporary = self.temporary_dir();
        match std::fs::read_dir(self.artifacts_dir()) {
            Ok(entries) => entries.into_iter().all(|entry| {
                entry.is_ok_and(|entry| {
                    entry.path() == temporary || is_owner_record(&entry.file_name())
                })
            }),
            Err(error) => error.kind() == ErrorKind::NotFound,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{ArtifactError, NewArtifact, Project};

    #[cfg(unix)]
    #[test]
    fn a_folder_that_cannot_be_read_is_not_an_empty_one() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        assert!(project.check_artifacts_place().is_ok() && project.has_no_artifacts());
        let artifacts = project.artifacts_dir();
        std::os::unix::fs::symlink(dir.path().join("unmounted"), &artifacts).expect("a link");
        let refused = project
            .check_artifacts_place()
            .expect_err("a dangling link");
        assert!(refused.to_string().contains("mount its disk"), "{refused}");
        std::fs::remove_file(&artifacts).expect("removed");
        std::fs::write(&artifacts, "").expect("a file");
        let refused = project.check_artifacts_place();
        assert!(matches!(refused, Err(ArtifactError::Blocked { .. })));
        let file = NewArtifact::new("a", "png", b"a".to_vec());
        let missing = project.check_artifact(file.reference(), true);
        assert!(matches!(missing, Err(ArtifactError::Blocked { .. })));
        assert!(!project.has_no_artifacts());
        let unwritten = project.write_artifacts(&[file], &|| {});
        assert!(matches!(unwritten, Err(ArtifactError::Blocked { .. })));
    }
}
