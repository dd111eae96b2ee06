//! Writes artifacts: under a temporary name first, then synced, renamed, and named durably.

use std::io::ErrorKind;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use super::Project;
use super::artifact_error::ArtifactError;
use super::artifacts::NewArtifact;
use super::atomic_write::{set_modified_now, write_synced};
use super::input_error::InputError;
use super::open_file::regular_metadata;
use super::parent_folder::{parent_folder, sync_folder};
use mocban_system::platform::rename;

/// Makes the temporary names of this process unique.
static NEXT: AtomicU64 = AtomicU64::new(0);

impl Project {
    /// Writes artifacts durably. Skips artifacts that are already complete on disk. Calls `on_written` for each new
    /// file, after it is written under its temporary name and before it is renamed.
    ///
    /// # Errors
    /// Returns an error if an artifact cannot be written. Files written before the error stay on disk. No row names
    /// these files, and `check --repair` removes them.
    pub fn write_artifacts(
        &self,
        files: &[NewArtifact],
        on_written: &dyn Fn(),
    ) -> Result<(), ArtifactError> {
        self.write_all(files, on_written).map_err(|error| {
            // After a renaming, the disk reports only that a folder does not exist.
            self.check_in_place().err().unwrap_or(error)
        })
    }

    fn write_all(&self, files: &[NewArtifact], on_written: &dyn Fn()) -> Result<(), ArtifactError> {
        let mut folders = std::collections::BTreeSet::new();
        for file in files {
            let path = self.local_path(file.reference());
            let folder = parent_folder(&path);
            self.make_folder(&folder)?;
            // A file that is there already may be unreferenced, and another process may be about to remove it.
            if self.read_local(file.reference()).is_err() || !set_modified_now(&path) {
                self.write_artifact(&path, file.bytes(), on_written)?;
            }
            folders.insert(folder);
        }
        for folder in &folders {
            sync(folder)?;
        }
        if !folders.is_empty() {
            // Sync the parents too. Another process may have created these folders and died before it synced their
            // names. Syncing an unchanged folder costs nothing.
            sync(&self.artifacts_dir())?;
            sync(self.dir())?;
        }
        Ok(())
    }

    /// Creates a folder in the artifacts folder, and the artifacts folder, if they are missing. Never creates the
    /// project's directory: after a renaming, that would leave a second, incomplete project at the old path.
    pub(super) fn make_folder(&self, folder: &Path) -> Result<(), ArtifactError> {
        self.check_in_place()?;
        for folder in [&self.artifacts_dir(), folder] {
            match std::fs::create_dir(folder) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                    if let Some(error) = ArtifactError::blocked_folder(&folder.join("file")) {
                        return Err(error);
                    }
                }
                created => created.map_err(ArtifactError::io(folder))?,
            }
        }
        Ok(())
    }

    fn write_artifact(
        &self,
        path: &Path,
        bytes: &[u8],
        on_written: &dyn Fn(),
    ) -> Result<(), ArtifactError> {
        let folder = self.temporary_dir();
        self.make_folder(&folder)?;
        let (temporary, written) = loop {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let temporary = folder.join(format!("{}-{number}", std::process::id()));
            match write_synced(&temporary, bytes) {
                // A dead process, or one in another container, had the same pid and created this file.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                written => break (temporary, written),
            }
        };
        let outcome = written
            .and_then(|()| {
                on_written();
                rename(&temporary, path)
            })
            .map_err(|error| match regular_metadata(path) {
                Err(blocked @ InputError::NotAFile { .. }) => blocked.into(),
                _ => ArtifactError::io(path)(error),
            });
        if outcome.is_err() {
            // Free the space, because the disk may be full. A file that cannot be removed does no harm.
            let _ = std::fs::remove_file(&temporary);
        }
        outcome
    }
}

fn sync(folder: &Path) -> Result<(), ArtifactError> {
    sync_folder(folder).map_err(ArtifactError::io(folder))
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
    fn a_temporary_file_of_another_process_is_left_alone() {
        let (_dir, project) = project();
        write(&project, &image(b"a"));
        let next = super::NEXT.load(std::sync::atomic::Ordering::Relaxed);
        let names = (next..next + 50).map(|number| format!("{}-{number}", std::process::id()));
        let others: Vec<_> = names
            .map(|name| project.temporary_dir().join(name))
            .collect();
        for other in &others {
            std::fs::write(other, "half").expect("a file");
        }
        write(&project, &image(b"b"));
        for other in &others {
            assert_eq!(std::fs::read(other).expect("a file"), b"half");
        }
        let image = image(b"b");
        assert_eq!(
            project.read_artifact(image.reference()).expect("read"),
            b"b"
        );
    }

    #[test]
    fn a_renamed_project_is_not_created_again_at_its_old_path() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (old, new) = (dir.path().join("old"), dir.path().join("new"));
        let project = Project::create(&old).expect("a project");
        std::fs::rename(&old, &new).expect("renamed");
        let files = [image(b"a")];
        let refused = project.write_artifacts(&files, &|| {});
        assert!(matches!(refused, Err(ArtifactError::Moved(path)) if path == old));
        assert!(!old.exists());
        // Another project at the old path gets no files either.
        std::fs::create_dir(&old).expect("another project");
        let refused = project.write_artifacts(&files, &|| {});
        assert!(matches!(refused, Err(ArtifactError::Moved(_))));
        assert_eq!(std::fs::read_dir(&old).expect("a folder").count(), 0);
        std::fs::remove_dir(&old).expect("removed");
        std::fs::rename(&new, &old).expect("renamed back");
        write(&project, &image(b"a"));
    }
}
