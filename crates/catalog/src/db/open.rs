//! Opens the database and verifies file, disk and settings.

use std::io::{ErrorKind, Read as _};
use std::path::Path;
use std::time::Duration;

use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{AssertSqlSafe, ConnectOptions, Connection as _, Row as _, SqliteConnection};

use crate::db::busy_retry::retry_while_busy;
use crate::db::error::{CatalogError, Result};
use crate::db::error_kind::CatalogErrorKind;
use crate::db::lock_owner::sidecar;
use crate::db::network_fs;
use crate::db::schema::{self, MIGRATOR};
use mocban_core::domain::FileKind;
use mocban_system::platform;

/// SQLite's busy timeout of a connection.
const BUSY_TIMEOUT: Duration = Duration::from_secs(10);
/// `application_id` of a catalog: "mocb".
const APPLICATION_ID: i64 = 1_836_016_482;
/// Version of the schema. Versions 1 to 11 were never released.
pub(crate) const SCHEMA_VERSION: i64 = 16;
/// Read connections per process.
const READERS: u32 = 4;

/// Returns the options of every connection.
fn options(path: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(false)
        .foreign_keys(true)
        .busy_timeout(BUSY_TIMEOUT)
        .synchronous(SqliteSynchronous::Full)
        .pragma("temp_store", "MEMORY")
}

/// Opens the write connection. If `allow_empty` is set, the file may have no bytes. Creates a missing schema. Refuses a
/// catalog to which another program added a trigger.
pub(crate) async fn write_conn(path: &Path, allow_empty: bool) -> Result<SqliteConnection> {
    network_fs::refuse(path)?;
    check_file(path, allow_empty)?;
    // SQLite would open the file for reading, and refuse only the first write.
    if !platform::may_write(path) {
        return Err(CatalogError::NotWritable(path.to_owned()));
    }
    let connected = retry_while_busy!(path, connect(path).await);
    let mut conn = connected.map_err(|error| {
        if is_read_only(&error) {
            CatalogError::NotWritable(path.to_owned())
        } else {
            unreadable(path, error)
        }
    })?;
    for (name, wanted) in [
        ("journal_mode", "wal"),
        ("synchronous", "2"),
        ("foreign_keys", "1"),
        ("busy_timeout", "10000"),
    ] {
        let query = sqlx::query(AssertSqlSafe(format!("PRAGMA {name}")));
        // SQLite converts numbers to text.
        let found: String = query.fetch_one(&mut conn).await?.try_get_unchecked(0)?;
        if found != wanted {
            return Err(CatalogError::Pragma {
                name,
                wanted,
                found,
            });
        }
    }
    Ok(conn)
}

async fn connect(path: &Path) -> Result<SqliteConnection> {
    // Automatic checkpoints would delay commits. The writer task checkpoints the write-ahead log instead.
    let mut conn = options(path)
        .journal_mode(SqliteJournalMode::Wal)
        .pragma("wal_autocheckpoint", "0")
        .pragma("journal_size_limit", "67108864")
        .connect()
        .await?;
    create_schema(&mut conn, path).await?;
    schema::require_own(&mut conn, path).await?;
    Ok(conn)
}

/// Opens read connections. In WAL mode, readers and the writer do not block each other. If the catalog's directory
/// seems to be read-only, or its disk is full, opens the catalog as an immutable file.
pub(crate) async fn reader_pool(path: &Path) -> Result<SqlitePool> {
    check_file(path, false)?;
    let (pool, found) = match shared(path).await {
        Err(error) if is_read_only(&error) || is_full(&error) => frozen(path, error).await?,
        outcome => outcome.map_err(|error| unreadable(path, error))?,
    };
    match found {
        Identity::Current => Ok(pool),
        Identity::Uninitialized => {
            pool.close().await;
            write_conn(path, false).await?.close().await?;
            Ok(shared(path).await?.0)
        }
        Identity::Other(number) => Err(wrong_identity(path, number)),
    }
}

/// Opens read connections to a catalog that may be written to.
async fn shared(path: &Path) -> Result<(SqlitePool, Identity)> {
    retry_while_busy!(path, pool(options(path).pragma("query_only", "1")).await)
}

/// Opens the catalog as an immutable file. SQLite then ignores the write-ahead log, so this fails if the log has
/// content.
async fn frozen(path: &Path, error: CatalogError) -> Result<(SqlitePool, Identity)> {
    let log = sidecar(path, "-wal");
    match std::fs::metadata(&log) {
        Ok(meta) if meta.len() > 0 && is_full(&error) => Err(error),
        Ok(meta) if meta.len() > 0 => Err(CatalogError::NotCheckpointed(log)),
        // Results that are only in a log that cannot be looked at would be missing.
        Err(source) if source.kind() != ErrorKind::NotFound => {
            Err(CatalogError::Io { path: log, source })
        }
        Ok(_) | Err(_) if std::fs::File::open(path).is_err() => Err(error),
        Ok(_) | Err(_) => pool(options(path).read_only(true).immutable(true))
            .await
            .map_err(|error| unreadable(path, error)),
    }
}

/// Opens read connections to a file that nobody writes to, such as a backup.
pub(crate) async fn immutable_pool(path: &Path) -> Result<SqlitePool> {
    check_file(path, false)?;
    let opened = pool(options(path).read_only(true).immutable(true)).await;
    let (pool, found) = opened.map_err(|error| unreadable(path, error))?;
    match found {
        Identity::Current => Ok(pool),
        Identity::Uninitialized => Err(CatalogError::Empty(path.to_owned())),
        Identity::Other(number) => Err(wrong_identity(path, number)),
    }
}

async fn pool(options: SqliteConnectOptions) -> Result<(SqlitePool, Identity)> {
    let pool = SqlitePoolOptions::new()
        .max_connections(READERS)
        // A connection to a file does not break, so it is not tested before use.
        .test_before_acquire(false)
        .connect_with(options)
        .await?;
    let found = identity(&mut *pool.acquire().await?).await?;
    Ok((pool, found))
}

/// Checks the file, because SQLite would treat an empty file as a new database. Does not open the file: closing it
/// again would drop the locks of this process's connections.
fn check_file(path: &Path, allow_empty: bool) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(meta) if meta.is_dir() => Err(CatalogError::IsDirectory(path.to_owned())),
        Ok(meta) if meta.len() == 0 && !allow_empty => Err(CatalogError::Empty(path.to_owned())),
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            Err(CatalogError::Missing(path.to_owned()))
        }
        Err(source) => Err(CatalogError::Io {
            path: path.to_owned(),
            source,
        }),
    }
}

/// Creates the schema in a database without tables. Other processes see the whole schema or none of it.
async fn create_schema(conn: &mut SqliteConnection, path: &Path) -> Result<()> {
    let found = identity(conn).await?;
    if found != Identity::Uninitialized {
        return require_current(path, found);
    }
    let mut transaction = conn.begin_with("BEGIN IMMEDIATE").await?;
    // Another process may have created the schema before this transaction began.
    match read_identity(&mut transaction).await? {
        Identity::Uninitialized => MIGRATOR.run(&mut *transaction).await?,
        found => return require_current(path, found),
    }
    Ok(transaction.commit().await?)
}

fn require_current(path: &Path, found: Identity) -> Result<()> {
    match found {
        Identity::Other(number) => Err(wrong_identity(path, number)),
        Identity::Current | Identity::Uninitialized => Ok(()),
    }
}

/// What kind of database a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Identity {
    /// A catalog with the schema of this program.
    Current,
    /// A database without tables. It is new, or its creation was interrupted.
    Uninitialized,
    /// Anything else, by application id and version.
    Other((i64, i64)),
}

/// Reads application id, version and whether there are tables, all as of one moment.
pub(crate) async fn identity(conn: &mut SqliteConnection) -> Result<Identity> {
    let mut transaction = conn.begin().await?;
    let found = read_identity(&mut transaction).await?;
    transaction.commit().await?;
    Ok(found)
}

/// Reads the identity in an open transaction.
async fn read_identity(conn: &mut SqliteConnection) -> Result<Identity> {
    let id = sqlx::query_scalar("PRAGMA application_id")
        .fetch_one(&mut *conn)
        .await?;
    let version = sqlx::query_scalar("PRAGMA user_version")
        .fetch_one(&mut *conn)
        .await?;
    Ok(match (id, version) {
        (APPLICATION_ID, SCHEMA_VERSION) => Identity::Current,
        (0, 0) if is_empty(conn).await? => Identity::Uninitialized,
        number => Identity::Other(number),
    })
}

async fn is_empty(conn: &mut SqliteConnection) -> Result<bool> {
    let tables: i64 = sqlx::query_scalar(
        "SELECT count(*) FROM sqlite_schema WHERE type <> 'table' OR name <> '_sqlx_migrations'",
    )
    .fetch_one(conn)
    .await?;
    Ok(tables == 0)
}

pub(crate) fn wrong_identity(path: &Path, (id, version): (i64, i64)) -> CatalogError {
    let path = path.to_owned();
    if id == APPLICATION_ID {
        return CatalogError::OtherVersion {
            path,
            found: version,
            known: SCHEMA_VERSION,
        };
    }
    CatalogError::Foreign {
        path,
        reason: "another program's database".to_owned(),
    }
}

/// Returns whether the file or its directory seems to be read-only.
fn is_read_only(error: &CatalogError) -> bool {
    matches!(
        error.kind(),
        Some(CatalogErrorKind::ReadOnly | CatalogErrorKind::CannotOpen)
    )
}

/// Returns whether the disk has no room for the file that processes share beside the catalog.
fn is_full(error: &CatalogError) -> bool {
    error.kind() == Some(CatalogErrorKind::Full)
}

/// Replaces the error if the file is not a database or is corrupt.
fn unreadable(path: &Path, error: CatalogError) -> CatalogError {
    match error.kind() {
        // `kind` opens and closes the file, which drops all locks of this process on the file (POSIX). That is harmless
        // here, because this process has no connection to the file.
        Some(CatalogErrorKind::NotADatabase) => CatalogError::Foreign {
            path: path.to_owned(),
            reason: kind(path).to_owned(),
        },
        Some(CatalogErrorKind::Damaged) => CatalogError::Damaged(path.to_owned()),
        _ => error,
    }
}

/// Describes a file that is not a database.
fn kind(path: &Path) -> &'static str {
    let mut head = [0; 512];
    let read = std::fs::File::open(path).and_then(|mut file| file.read(&mut head));
    let read = read.unwrap_or(0);
    match FileKind::of(&head[..read]) {
        FileKind::Other("an SQLite database") => "a database cut short or encrypted",
        kind => kind.description(),
    }
}

#[cfg(test)]
mod tests {
    use super::{reader_pool, write_conn};
    use crate::CatalogError;

    #[tokio::test]
    async fn a_text_file_is_no_catalog() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("catalog.sqlite");
        std::fs::write(&path, "id,mesh,print\n".repeat(100)).expect("a file");
        let outcome = write_conn(&path, true).await;
        assert!(
            matches!(outcome, Err(CatalogError::Foreign { .. })),
            "{outcome:?}"
        );
    }

    #[tokio::test]
    async fn another_programs_database_is_refused_and_left_alone() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("catalog.sqlite");
        let mut conn = sqlx::ConnectOptions::connect(
            &sqlx::sqlite::SqliteConnectOptions::new()
                .filename(&path)
                .create_if_missing(true),
        )
        .await
        .expect("a database");
        sqlx::query("CREATE TABLE note (text TEXT)")
            .execute(&mut conn)
            .await
            .expect("a table");
        assert!(matches!(
            write_conn(&path, true).await,
            Err(CatalogError::Foreign { .. })
        ));
        assert!(matches!(
            reader_pool(&path).await,
            Err(CatalogError::Foreign { .. })
        ));
    }
}
