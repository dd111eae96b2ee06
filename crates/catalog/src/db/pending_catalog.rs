//! The file of a catalog that is being created. It has a hidden name until the catalog is complete.
//!
//! Every creator holds a shared lock on the folder. A process that gets the exclusive lock knows that no creator works
//! there, so all hidden files are left from creators that were killed. Where folders cannot be locked, as on Windows,
//! these files stay.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempPath;

use crate::db::error::{CatalogError, Result};
use crate::db::lock_owner::sidecar;
use mocban_system::platform::{let_all_read, open_folder, sync_file, sync_names};

/// A catalog file under a hidden name. The file is removed when this value is dropped.
#[derive(Debug)]
pub(crate) struct PendingCatalog {
    file: TempPath,
    sidecars: HiddenSidecars,
    target: PathBuf,
    /// The folder, with the shared lock.
    folder: File,
}

/// When dropped, removes the files that SQLite keeps beside a hidden file.
#[derive(Debug)]
struct HiddenSidecars(PathBuf);

impl Drop for HiddenSidecars {
    fn drop(&mut self) {
        for ending in ["-wal", "-shm", "-journal"] {
            // SQLite has usually removed the file already. If it remains, the next creator removes it.
            let _ = std::fs::remove_file(sidecar(&self.0, ending));
        }
    }
}

impl PendingCatalog {
    /// Creates an empty file beside `target`, and removes the files of creators that were killed.
    ///
    /// # Errors
    /// Returns an error if the folder is not writable, or if it holds a WAL but no catalog. SQLite would apply that WAL
    /// to the new catalog.
    pub(crate) fn create(target: &Path) -> Result<Self> {
        for ending in ["-wal", "-journal"] {
            let log = sidecar(target, ending);
            let has_content = std::fs::metadata(&log).is_ok_and(|meta| meta.len() > 0);
            // Looks for the log before the catalog, because another process may create both meanwhile.
            if has_content && !target.exists() {
                return Err(CatalogError::LogAlone(log));
            }
        }
        let not_created = || CatalogError::NotCreated(target.to_owned());
        let folder = open_folder(folder_of(target)).or(Err(not_created()))?;
        remove_if_stale(target, &folder);
        // A file system without locks also refuses the exclusive lock, so no process removes files there.
        let _ = folder.lock_shared();
        let prefix = hidden_prefix(target);
        let mut builder = tempfile::Builder::new();
        let_all_read(builder.prefix(&prefix));
        let file = builder
            .tempfile_in(folder_of(target))
            .or(Err(not_created()))?
            .into_temp_path();
        Ok(Self {
            sidecars: HiddenSidecars(file.to_path_buf()),
            file,
            target: target.to_owned(),
            folder,
        })
    }

    /// Returns the hidden path.
    pub(crate) fn path(&self) -> &Path {
        &self.file
    }

    /// Syncs the file and renames it to the target, unless the target exists. Returns whether the file was renamed. All
    /// connections to the file must be closed.
    ///
    /// # Errors
    /// Returns an error if the write-ahead log of the file is not empty, or the disk returns an error.
    pub(crate) fn place(self) -> Result<bool> {
        let Self { file, target, .. } = &self;
        let io_error = |source| CatalogError::Io {
            path: target.clone(),
            source,
        };
        let log = std::fs::metadata(sidecar(file, "-wal"));
        if log.is_ok_and(|log| log.len() > 0) {
            return Err(CatalogError::NotCreated(target.clone()));
        }
        sync_file(file).map_err(io_error)?;
        let Self {
            file,
            sidecars: _sidecars,
            target,
            folder,
        } = self;
        let io_error = |source| CatalogError::Io {
            path: target.clone(),
            source,
        };
        match file.persist_noclobber(&target) {
            Ok(()) => {
                sync_names(&folder).map_err(|error| {
                    let text = format!(
                        "the catalog is complete, but the disk did not confirm its name: {error}"
                    );
                    io_error(io::Error::new(error.kind(), text))
                })?;
                Ok(true)
            }
            Err(refused) if refused.error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
            Err(refused) => Err(io_error(refused.error)),
        }
    }
}

/// Removes the hidden files beside a catalog, if no process is creating a catalog there.
pub(crate) fn remove_stale(catalog: &Path) {
    if let Ok(folder) = open_folder(folder_of(catalog)) {
        remove_if_stale(catalog, &folder);
    }
}

fn remove_if_stale(catalog: &Path, folder: &File) {
    if folder.try_lock().is_err() {
        return;
    }
    let prefix = hidden_prefix(catalog);
    let entries = std::fs::read_dir(folder_of(catalog)).into_iter().flatten();
    for entry in entries.flatten() {
        let name = entry.file_name();
        if name.to_string_lossy().starts_with(&prefix) {
            // A file that cannot be removed does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
    // Dropping the file unlocks it too.
    let _ = folder.unlock();
}

/// Returns the start of the hidden names for a catalog.
fn hidden_prefix(catalog: &Path) -> String {
    let name = catalog.file_name().unwrap_or_default();
    format!(".{}.mocban-new-", name.to_string_lossy())
}

fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}
