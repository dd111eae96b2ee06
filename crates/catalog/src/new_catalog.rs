//! Creation of a catalog: other processes see no catalog or a whole one.

use std::path::Path;

use crate::db::error::{CatalogError, Result};
use crate::db::network_fs;
use crate::db::pending_catalog::{self, PendingCatalog};
use crate::handle::Catalog;
use crate::queue::commit::writer::CommitDelay;

/// A new catalog that no other process sees yet. It disappears if this value is dropped.
#[derive(Debug)]
pub struct NewCatalog {
    catalog: Catalog,
    file: PendingCatalog,
}

impl NewCatalog {
    /// Begins a catalog at `path`, whose folder must exist. Returns `None` if the path is taken.
    ///
    /// # Errors
    /// Returns an error if the folder is not writable, is on a network file system or holds the log of a removed
    /// catalog, or if the database fails.
    pub async fn begin(path: &Path) -> Result<Option<Self>> {
        network_fs::refuse(path)?;
        if path.symlink_metadata().is_ok() {
            return Ok(None);
        }
        let file = PendingCatalog::create(path)?;
        let catalog = Catalog::with_writer(file.path(), true, CommitDelay::new()).await;
        let catalog = catalog.map_err(|error| match error {
            CatalogError::NotWritable(_) => CatalogError::NotCreated(path.to_owned()),
            error => error,
        })?;
        Ok(Some(Self { catalog, file }))
    }

    /// Returns the catalog, for its first content.
    pub const fn catalog(&self) -> &Catalog {
        &self.catalog
    }

    /// Closes the catalog and durably renames its file to the final path. Returns `false`, and drops the new catalog,
    /// if another process created a catalog there first.
    pub async fn place(self) -> Result<bool> {
        self.catalog.close().await;
        self.file.place()
    }

    /// Closes and removes the new catalog.
    pub async fn discard(self) {
        self.catalog.close().await;
    }
}

impl Catalog {
    /// Opens the catalog, or creates it.
    ///
    /// # Errors
    /// Returns an error if the file is not a catalog or is on a network file system, or if the database fails.
    pub async fn create(path: &Path) -> Result<Self> {
        if let Some(new) = NewCatalog::begin(path).await? {
            new.place().await?;
        }
        Self::with_writer(path, true, CommitDelay::new()).await
    }

    /// Removes the hidden files of creators that were killed, if no process is creating a catalog in this folder.
    pub fn remove_stale_files(&self) {
        pending_catalog::remove_stale(&self.path);
    }
}
