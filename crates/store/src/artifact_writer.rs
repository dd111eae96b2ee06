//! Writes artifacts: under a temporary name first, then synced, renamed, and named durably.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use super::Project;
use super::artifact_error::ArtifactError;
use super::artifacts::NewArtifact;
use super::atomic_write::set_modified_now;
use super::input_error::InputError;
use super::open_file::regular_metadata;
use super::parent_folder::{parent_folder, sync_folder};
use mocban_system::platform::rename;

/// Maximum number of files that are written, and open, before they are synced.
const MAX_OPEN: usize = 64;
/// Number of threads that sync files.
const SYNCING_THREADS: usize = 8;
/// Fewer files are synced one after the other.
const MIN_AT_ONCE: usize = 8;

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
        let mut folders = BTreeSet::new();
        for files in files.chunks(MAX_OPEN) {
            let mut partial = Vec::new();
            for file in files {
                let path = self.local_path(file.reference());
                let folder = parent_folder(&path);
                self.make_folder(&folder)?;
                folders.insert(folder);
                // A file that is there already may be unreferenced, and another process may be about to remove it.
                if self.read_local(file.reference()).is_err() || !set_modified_now(&path) {
                    partial.push(self.write_partial(path, file.bytes())?);
                }
            }
            sync_each(&partial, PartialArtifact::sync)?;
            for artifact in partial {
                on_written();
                artifact.place()?;
            }
        }
        sync_each(&Vec::from_iter(&folders), |folder| sync(folder))?;
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

    /// Writes an artifact under a temporary name.
    fn write_partial(&self, path: PathBuf, bytes: &[u8]) -> Result<PartialArtifact, ArtifactError> {
        let folder = self.temporary_dir();
        self.make_folder(&folder)?;
        let (temporary, created) = loop {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let temporary = folder.join(format!("{}-{number}", std::process::id()));
            match File::create_new(&temporary) {
                // A dead process, or one in another container, had the same pid and created this file.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                created => break (temporary, created),
            }
        };
        let file = created.map_err(ArtifactError::io(&path))?;
        let mut partial = PartialArtifact {
            file: Some(file),
            temporary,
            path,
        };
        let written = (partial.file.iter_mut()).try_for_each(|file| file.write_all(bytes));
        written.map_err(ArtifactError::io(&partial.path))?;
        Ok(partial)
    }
}

/// A written file under a temporary name. If it is dropped, it is removed: the disk may be full.
struct PartialArtifact {
    /// Open until the file is renamed.
    file: Option<File>,
    temporary: PathBuf,
    path: PathBuf,
}

impl PartialArtifact {
    fn sync(&self) -> Result<(), ArtifactError> {
        let synced = self.file.as_ref().map_or(Ok(()), File::sync_all);
        synced.map_err(ArtifactError::io(&self.path))
    }

    /// Gives the file its name.
    fn place(mut self) -> Result<(), ArtifactError> {
        // Some file systems rename no open file.
        self.file = None;
        rename(&self.temporary, &self.path).map_err(|error| {
            match regular_metadata(&self.path) {
                Err(blocked @ InputError::NotAFile { .. }) => blocked.into(),
                _ => ArtifactError::io(&self.path)(error),
            }
        })?;
        self.temporary = PathBuf::new();
        Ok(())
    }
}

impl Drop for PartialArtifact {
    fn drop(&mut self) {
        self.file = None;
        if !self.temporary.as_os_str().is_empty() {
            // A file that cannot be removed does no harm.
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// Syncs files or folders, several at once. A file system with a journal then writes one transaction for all of them,
/// instead of one for each.
///
/// # Errors
/// Returns the error of one of them.
fn sync_each<T: Sync>(
    items: &[T],
    sync: impl Fn(&T) -> Result<(), ArtifactError> + Sync,
) -> Result<(), ArtifactError> {
    let next = AtomicUsize::new(0);
    let sync_rest = || {
        while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
            sync(item)?;
        }
        Ok(())
    };
    // Starting threads takes longer than is gained with the few files of a pair.
    let others = match items.len() {
        ..MIN_AT_ONCE => 0,
        many => many.min(SYNCING_THREADS) - 1,
    };
    std::thread::scope(|scope| {
        let start = |_| std::thread::Builder::new().spawn_scoped(scope, sync_rest);
        // Without a thread, this one does the work.
        let threads: Vec<_> = (0..others).map_while(|k| start(k).ok()).collect();
        let outcome = sync_rest();
        threads.into_iter().fold(outcome, |outcome, thread| {
            let joined = thread
                .join()
                .unwrap_or_else(|payload| resume_unwind(payload));
            outcome.and(joined)
        })
    })
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
    #[test]
    fn many_artifacts_are_written_together_or_fail_with_the_name_of_one() {
        let (_dir, project) = project();
        let files: Vec<NewArtifact> = (0..150_u32).map(|k| image(&k.to_le_bytes())).collect();
        let written = std::cell::Cell::new(0);
        let count = || written.set(written.get() + 1);
        project.write_artifacts(&files, &count).expect("written");
        assert_eq!(written.take(), 150);
        for (k, file) in (0_u32..).zip(&files) {
            let read = project.read_artifact(file.reference());
            assert_eq!(read.expect("read"), k.to_le_bytes());
        }
        project.write_artifacts(&files, &count).expect("written");
        assert_eq!(written.get(), 0);
        let others: Vec<NewArtifact> = (150..250_u32).map(|k| image(&k.to_le_bytes())).collect();
        let blocked = project.artifact_path(others[30].reference());
        std::fs::create_dir_all(blocked.join("mine")).expect("a folder");
        let refused = project.write_artifacts(&others, &count);
        let error = refused.expect_err("a folder has the name of a file");
        assert!(matches!(error, ArtifactError::Blocked { .. }), "{error}");
        let left = std::fs::read_dir(project.temporary_dir()).expect("a folder");
        assert_eq!(left.count(), 0, "no file without a name is left");
    }

    #[test]
    fn an_error_of_any_thread_is_returned() {
        let items: Vec<usize> = (0..100).collect();
        for failing in [None, Some(0), Some(57), Some(99)] {
            let synced = std::sync::Mutex::new(Vec::new());
            let outcome = super::sync_each(&items, |item| {
                synced.lock().expect("no panic").push(*item);
                if failing == Some(*item) {
                    return Err(ArtifactError::Moved(item.to_string().into()));
                }
                Ok(())
            });
            assert_eq!(outcome.is_err(), failing.is_some());
            let mut synced = synced.into_inner().expect("no panic");
            synced.sort_unstable();
            synced.dedup();
            assert!(failing.is_some() || synced == items);
        }
        assert!(super::sync_each(&[0_u8; 0], |_| Ok(())).is_ok());
    }
}
