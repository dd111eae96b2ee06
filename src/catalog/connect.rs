//! Opening the database: the right file, the right disk, the right settings, read back.

use std::path::{Path, PathBuf};
use std::time::Duration;

use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{ConnectOptions, Connection as _, SqliteConnection};

use super::{CatalogError, Result};

/// How long a connection waits for another process's write.
const BUSY_TIMEOUT: Duration = Duration::from_secs(10);
/// Marks a database as a catalog: "mocb".
const APPLICATION_ID: i64 = 1_836_016_482;
/// Version of the schema, raised by each migration.
const SCHEMA_VERSION: i64 = 3;
/// Read connections of a process.
const READERS: u32 = 4;

pub(super) static MIGRATOR: sqlx::migrate::Migrator = sqlx::migrate!("./migrations");

/// What every connection has in common.
fn options(path: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(false)
        .foreign_keys(true)
        .busy_timeout(BUSY_TIMEOUT)
        .synchronous(SqliteSynchronous::Full)
        .pragma("temp_store", "MEMORY")
}

/// The write connection, with the schema brought up to date. Makes the file when `create` is set.
pub(super) async fn writer(path: &Path, create: bool) -> Result<SqliteConnection> {
    refuse_network(path)?;
    if !create && !path.is_file() {
        return Err(CatalogError::Missing(path.to_owned()));
    }
    // The writer runs the checkpoints itself, so that no commit is made to wait for one.
    let mut conn = options(path)
        .create_if_missing(create)
        .journal_mode(SqliteJournalMode::Wal)
        .pragma("wal_autocheckpoint", "0")
        .pragma("journal_size_limit", "67108864")
        .connect()
        .await
        .map_err(|error| foreign(path, error))?;
    migrate(&mut conn, path).await?;
    for (name, sql, wanted) in [
        (
            "journal_mode",
            "SELECT CAST(journal_mode AS TEXT) FROM pragma_journal_mode",
            "wal",
        ),
        (
            "synchronous",
            "SELECT CAST(synchronous AS TEXT) FROM pragma_synchronous",
            "2",
        ),
        (
            "foreign_keys",
            "SELECT CAST(foreign_keys AS TEXT) FROM pragma_foreign_keys",
            "1",
        ),
        (
            "busy_timeout",
            "SELECT CAST(timeout AS TEXT) FROM pragma_busy_timeout",
            "10000",
        ),
    ] {
        assert_pragma(&mut conn, name, sql, wanted).await?;
    }
    Ok(conn)
}

/// Connections that only read. They never wait for the writer, nor the writer for them. The catalog of an older
/// version of the program is brought up to date first.
pub(super) async fn readers(path: &Path) -> Result<SqlitePool> {
    if !path.is_file() {
        return Err(CatalogError::Missing(path.to_owned()));
    }
    let pool = SqlitePoolOptions::new()
        .max_connections(READERS)
        .connect_with(options(path).pragma("query_only", "1"))
        .await
        .map_err(|error| foreign(path, error))?;
    let found = identity(&mut *pool.acquire().await?).await?;
    match found {
        (APPLICATION_ID, SCHEMA_VERSION) => {}
        (APPLICATION_ID, version) if version < SCHEMA_VERSION => {
            writer(path, false).await?.close().await?;
        }
        found => return Err(wrong_identity(path, found)),
    }
    Ok(pool)
}

/// Brings the schema up to date.
async fn migrate(conn: &mut SqliteConnection, path: &Path) -> Result<()> {
    match identity(conn)
        .await
        .map_err(|error| unreadable(path, error))?
    {
        (APPLICATION_ID, SCHEMA_VERSION) => return Ok(()),
        (0, 0) if is_empty(conn).await? => {}
        (APPLICATION_ID, version) if version < SCHEMA_VERSION => {}
        found => return Err(wrong_identity(path, found)),
    }
    let outcome = MIGRATOR.run(&mut *conn).await;
    // Another process may have made the schema at the same time; then ours failed and all is well.
    if identity(conn).await? == (APPLICATION_ID, SCHEMA_VERSION) {
        return Ok(());
    }
    Ok(outcome?)
}

async fn identity(conn: &mut SqliteConnection) -> Result<(i64, i64)> {
    let id = sqlx::query_scalar("PRAGMA application_id")
        .fetch_one(&mut *conn)
        .await?;
    let version = sqlx::query_scalar("PRAGMA user_version")
        .fetch_one(conn)
        .await?;
    Ok((id, version))
}

async fn is_empty(conn: &mut SqliteConnection) -> Result<bool> {
    let tables: i64 =
        sqlx::query_scalar("SELECT count(*) FROM sqlite_schema WHERE name <> '_sqlx_migrations'")
            .fetch_one(conn)
            .await?;
    Ok(tables == 0)
}

fn wrong_identity(path: &Path, (id, version): (i64, i64)) -> CatalogError {
    let reason = if id == APPLICATION_ID {
        format!("its schema is version {version}, this program's is {SCHEMA_VERSION}")
    } else {
        "it is another program's database".to_owned()
    };
    CatalogError::Foreign {
        path: path.to_owned(),
        reason,
    }
}

fn foreign(path: &Path, error: sqlx::Error) -> CatalogError {
    unreadable(path, error.into())
}

/// Says plainly when the file is no database at all.
fn unreadable(path: &Path, error: CatalogError) -> CatalogError {
    match error {
        CatalogError::Database(sqlx::Error::Database(inner))
            if inner.message().contains("not a database") =>
        {
            CatalogError::Foreign {
                path: path.to_owned(),
                reason: inner.message().to_owned(),
            }
        }
        other => other,
    }
}

async fn assert_pragma(
    conn: &mut SqliteConnection,
    name: &'static str,
    sql: &'static str,
    wanted: &'static str,
) -> Result<()> {
    let found: String = sqlx::query_scalar(sql).fetch_one(conn).await?;
    if found == wanted {
        return Ok(());
    }
    Err(CatalogError::Pragma {
        name,
        wanted,
        found,
    })
}

/// Refuses a directory on a network file system, where the write-ahead log's shared memory does not work.
fn refuse_network(path: &Path) -> Result<()> {
    let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    let dir = dir.unwrap_or(Path::new("."));
    match network_kind(dir) {
        Some(kind) => Err(CatalogError::NetworkFileSystem {
            path: PathBuf::from(dir),
            kind,
        }),
        None => Ok(()),
    }
}

/// Name of the network file system a directory is on; `None` on a local one, or where it cannot be told.
#[cfg(target_os = "linux")]
fn network_kind(dir: &Path) -> Option<&'static str> {
    let magic = rustix::fs::statfs(dir).ok()?.f_type;
    network_magic(u64::try_from(magic).ok()? & 0xffff_ffff)
}

#[cfg(not(target_os = "linux"))]
fn network_kind(_dir: &Path) -> Option<&'static str> {
    None
}

/// File systems by the number that `statfs` gives (statfs(2) and the kernels' `magic.h`).
#[cfg(target_os = "linux")]
const fn network_magic(magic: u64) -> Option<&'static str> {
    match magic {
        0x6969 => Some("nfs"),
        0x517b => Some("smb"),
        0xff53_4d42 => Some("cifs"),
        0xfe53_4d42 => Some("smb2"),
        0x0bd0_0bd0 => Some("lustre"),
        0x4750_4653 => Some("gpfs"),
        0x5346_414f | 0x6b41_4653 => Some("afs"),
        0x00c3_6400 => Some("ceph"),
        0x2003_0528 => Some("orangefs"),
        0xaad7_aaea => Some("panfs"),
        0x7461_636f => Some("ocfs2"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{network_magic, readers, writer};
    use crate::catalog::CatalogError;

    #[test]
    fn nfs_is_a_network_and_ext4_is_not() {
        assert_eq!(network_magic(0x6969), Some("nfs"));
        assert_eq!(network_magic(0xef53), None);
    }

    #[tokio::test]
    async fn a_text_file_is_no_catalog() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("catalog.sqlite");
        std::fs::write(&path, "id,mesh,print\n".repeat(100)).expect("a file");
        let outcome = writer(&path, true).await;
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
            writer(&path, true).await,
            Err(CatalogError::Foreign { .. })
        ));
        assert!(matches!(
            readers(&path).await,
            Err(CatalogError::Foreign { .. })
        ));
    }
}
