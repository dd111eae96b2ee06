//! Copies the catalog while a run may be writing.

use std::path::Path;

use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions as _, Connection as _};

use crate::catalog::audit::integrity;
use crate::catalog::db::error_kind::CatalogErrorKind;
use crate::catalog::db::open::{Identity, identity};
use crate::catalog::{Catalog, CatalogError, Result};

impl Catalog {
    /// Copies the catalog, as of one moment, to a new file and verifies the copy. Does not sync the copy to disk.
    ///
    /// # Errors
    /// Returns an error if the path is not UTF-8, the copy fails, or the copy is damaged. May leave a partial copy.
    pub async fn copy_to(&self, file: &Path) -> Result<()> {
        let Some(name) = file.to_str() else {
            return Err(CatalogError::NotUtf8(file.to_owned()));
        };
        // `VACUUM INTO` fails under `query_only`. The connection leaves the pool, because it turns this setting off.
        let mut conn = self.read_conn().await?.detach();
        sqlx::query("PRAGMA query_only = 0")
            .execute(&mut conn)
            .await?;
        sqlx::query("VACUUM INTO ?1")
            .bind(name)
            .execute(&mut conn)
            .await
            .map_err(|error| not_copied(file, error))?;
        conn.close().await?;
        let options = SqliteConnectOptions::new()
            .filename(file)
            .read_only(true)
            .immutable(true);
        let mut copy = options.connect().await?;
        let found = identity(&mut copy).await?;
        let faults = integrity::integrity(&mut copy, true).await?;
        copy.close().await?;
        if found == Identity::Current && faults.is_empty() {
            Ok(())
        } else {
            Err(CatalogError::Damaged(file.to_owned()))
        }
    }
}

/// Attributes a disk error to the copy: the catalog itself is only read.
fn not_copied(file: &Path, error: sqlx::Error) -> CatalogError {
    let reason = match CatalogErrorKind::of(&error) {
        Some(CatalogErrorKind::Full) => "the disk is full",
        Some(CatalogErrorKind::ReadOnly | CatalogErrorKind::CannotOpen) => "it cannot be written",
        Some(CatalogErrorKind::Disk) => "the disk refused",
        _ => return error.into(),
    };
    CatalogError::Io {
        path: file.to_owned(),
        source: std::io::Error::other(reason),
    }
}
