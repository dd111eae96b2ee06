//! Copies the catalog to a backup, even during a run, and restores a backup to a new catalog.

use std::path::Path;

use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode};
use sqlx::{ConnectOptions as _, Connection as _, SqliteConnection};

use crate::audit::integrity;
use crate::db::conn::{Conn, ConnectionKind};
use crate::db::error_kind::CatalogErrorKind;
use crate::db::open::{Identity, identity, wrong_identity};
use crate::db::schema;
use crate::{Catalog, CatalogError, Result};

/// Extended result codes of failed reads: `SQLITE_IOERR_READ`, `SQLITE_IOERR_SHORT_READ`. A copy is only written, so
/// these errors concern the original.
const READ_FAILED: [&str; 2] = ["266", "522"];

/// Length of an absolute path in bytes. If SQLite cannot open a file with a longer path, the error names the length as
/// the cause.
const MAX_PATH: usize = 500;

const HAS_SETTINGS: &str =
    "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = 'backup_settings'";

impl Catalog {
    /// Writes a backup to a new file: the catalog as of one moment, and the bytes of the project's settings file if
    /// there is one. Verifies the backup. Does not sync the file to disk.
    ///
    /// # Errors
    /// Returns an error if the path is not UTF-8, the copy fails, or the copy is damaged. May leave a partial copy.
    pub async fn back_up(&self, file: &Path, settings: Option<&[u8]>) -> Result<()> {
        // `VACUUM INTO` fails under `query_only`. The connection is taken out of the pool before this setting is turned
        // off, so that the pool keeps only read connections.
        let Conn::Sqlite(ConnectionKind::Pooled(conn)) = self.read_conn().await? else {
            return self.back_up_from_server(file, settings).await;
        };
        let mut conn = conn.detach();
        sqlx::query("PRAGMA query_only = 0")
            .execute(&mut conn)
            .await?;
        let copied = vacuum_into(&mut conn, file).await?;
        copied.map_err(|error| not_copied(file, error))?;
        conn.close().await?;
        let stored = store_settings(file, settings).await;
        stored.map_err(|error| disk_error(file, error))?;
        verify(file).await
    }

    /// Like [`Self::back_up`], for a catalog in PostgreSQL.
    async fn back_up_from_server(&self, file: &Path, settings: Option<&[u8]>) -> Result<()> {
        let copied = self.copy_to_file(file, |_, _| {}).await;
        copied.map_err(|error| match error {
            CatalogError::Original(error) => *error,
            error => error,
        })?;
        let stored = store_settings(file, settings).await;
        stored.map_err(|error| disk_error(file, error))?;
        verify(file).await
    }

    /// Writes the catalog of a backup to a new file and verifies the file. Returns the bytes of the settings file that
    /// the backup holds. Does not sync the file to disk.
    ///
    /// # Errors
    /// Returns an error if the backup is not a catalog, if another program added something to its schema, the copy fails,
    /// or the copy is damaged. May leave a partial copy.
    pub async fn restore_backup(backup: &Path, file: &Path) -> Result<Option<Vec<u8>>> {
        let options = SqliteConnectOptions::new().filename(backup);
        let unreadable = |error| disk_error(backup, error);
        let opened = options.read_only(true).immutable(true).connect().await;
        let mut conn = opened.map_err(unreadable)?;
        match identity(&mut conn).await {
            // Checked before anything is written, and in the backup itself, which the error then names.
            Ok(Identity::Current) => {
                let checked = schema::require_own(&mut conn, backup).await;
                checked.map_err(|error| in_file(backup, error))?;
            }
            Ok(Identity::Uninitialized) => return Err(CatalogError::Empty(backup.to_owned())),
            Ok(Identity::Other(number)) => return Err(wrong_identity(backup, number)),
            Err(error) => return Err(in_file(backup, error)),
        }
        let copied = vacuum_into(&mut conn, file).await?;
        copied.map_err(|error| in_file(backup, not_copied(file, error)))?;
        conn.close().await.map_err(unreadable)?;
        let renewed = make_independent(file).await;
        renewed.map_err(|error| disk_error(file, error))?;
        let taken = take_settings(file).await;
        let settings = taken.map_err(|error| disk_error(file, error))?;
        verify(file).await?;
        Ok(settings)
    }
}

/// Copies a database. The inner result is that of SQLite.
async fn vacuum_into(conn: &mut SqliteConnection, file: &Path) -> Result<sqlx::Result<()>> {
    let Some(name) = file.to_str() else {
        return Err(CatalogError::NotUtf8(file.to_owned()));
    };
    let copied = sqlx::query("VACUUM INTO ?1").bind(name).execute(conn).await;
    Ok(copied.map(|_| ()))
}

/// Opens a copy for writing. The journal is kept in memory, because an incomplete copy is discarded anyway.
async fn open_copy(file: &Path) -> sqlx::Result<SqliteConnection> {
    let options = SqliteConnectOptions::new().filename(file);
    let options = options.create_if_missing(false);
    options
        .journal_mode(SqliteJournalMode::Memory)
        .connect()
        .await
}

/// Replaces the settings in a backup. A catalog that was copied from a backup by hand may hold earlier settings.
async fn store_settings(file: &Path, settings: Option<&[u8]>) -> sqlx::Result<()> {
    let mut copy = open_copy(file).await?;
    sqlx::query("DROP TABLE IF EXISTS backup_settings")
        .execute(&mut copy)
        .await?;
    if let Some(bytes) = settings {
        sqlx::query("CREATE TABLE backup_settings (text BLOB NOT NULL) STRICT")
            .execute(&mut copy)
            .await?;
        sqlx::query("INSERT INTO backup_settings (text) VALUES (?1)")
            .bind(bytes)
            .execute(&mut copy)
            .await?;
    }
    copy.close().await
}

/// Gives a restored catalog an identity of its own, so that it does not own the artifacts of the original, and ends the workers
/// of the original, which a backup during a run has: they do not work on the copy, and were not killed.
async fn make_independent(file: &Path) -> sqlx::Result<()> {
    let mut copy = open_copy(file).await?;
    for change in [
        "UPDATE catalog_identity SET id = randomblob(16)",
        "UPDATE worker SET ended = heartbeat WHERE ended IS NULL",
    ] {
        sqlx::query(change).execute(&mut copy).await?;
    }
    copy.close().await
}

/// Removes the settings from a copy of a backup and returns them.
async fn take_settings(file: &Path) -> sqlx::Result<Option<Vec<u8>>> {
    let mut copy = open_copy(file).await?;
    let tables: i64 = sqlx::query_scalar(HAS_SETTINGS)
        .fetch_one(&mut copy)
        .await?;
    let mut settings = None;
    if tables > 0 {
        settings = sqlx::query_scalar("SELECT text FROM backup_settings LIMIT 1")
            .fetch_optional(&mut copy)
            .await?;
        sqlx::query("DROP TABLE backup_settings")
            .execute(&mut copy)
            .await?;
    }
    copy.close().await?;
    Ok(settings)
}

/// Verifies a complete copy.
async fn verify(file: &Path) -> Result<()> {
    let options = SqliteConnectOptions::new().filename(file);
    let unreadable = |error| disk_error(file, error);
    let opened = options.read_only(true).immutable(true).connect().await;
    let mut copy = opened.map_err(unreadable)?;
    let in_copy = |error| in_file(file, error);
    let found = identity(&mut copy).await.map_err(in_copy)?;
    let faults = integrity::integrity(&mut copy, true)
        .await
        .map_err(in_copy)?;
    copy.close().await.map_err(unreadable)?;
    if found == Identity::Current && faults.is_empty() {
        Ok(())
    } else {
        Err(CatalogError::Damaged(file.to_owned()))
    }
}

/// Attributes an error to the copy, or to the original if a read failed or the original may be damaged.
fn not_copied(file: &Path, error: sqlx::Error) -> CatalogError {
    let code = (error.as_database_error()).and_then(sqlx::error::DatabaseError::code);
    if code.is_some_and(|code| READ_FAILED.contains(&&*code)) {
        return error.into();
    }
    match CatalogErrorKind::of(&error) {
        // The original may be damaged. The copy is verified later.
        Some(CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase) => error.into(),
        _ => disk_error(file, error),
    }
}

/// Names the file of an error of the database.
fn in_file(file: &Path, error: CatalogError) -> CatalogError {
    match error {
        CatalogError::Database(error) => disk_error(file, error),
        error => error,
    }
}

/// Names the file of an error. The messages of other errors name the catalog of the project.
fn disk_error(file: &Path, error: sqlx::Error) -> CatalogError {
    let length = std::path::absolute(file).map_or(0, |path| path.as_os_str().len());
    let reason = match CatalogErrorKind::of(&error) {
        Some(CatalogErrorKind::CannotOpen) if length > MAX_PATH => {
            "the path is too long for SQLite; choose a shorter one"
        }
        Some(CatalogErrorKind::Full) => "the disk is full",
        Some(CatalogErrorKind::ReadOnly | CatalogErrorKind::CannotOpen) => {
            "it cannot be written to: the folder is read-only, or the disk is full or reported an error"
        }
        Some(CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase) => {
            return CatalogError::Damaged(file.to_owned());
        }
        Some(CatalogErrorKind::Disk) => "the disk refused",
        // SQLite also reports this error if the disk does not report the length of a new file.
        _ if error.to_string().contains("output file already exists") => "the disk refused",
        _ => return error.into(),
    };
    CatalogError::Io {
        path: file.to_owned(),
        source: std::io::Error::other(reason),
    }
}
