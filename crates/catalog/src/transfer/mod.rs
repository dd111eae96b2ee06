//! Copies a catalog to another one, between a file and PostgreSQL or the same kind.
//!
//! All rows are copied and compared in one transaction of the target, which also creates a missing catalog. So there is no
//! half-finished copy that another process could use: a target holds no rows, or all rows of a moment. A catalog that
//! holds rows is only compared. `backup.rs` copies a file as a whole.

pub(crate) mod backup;
pub(crate) mod rows;
mod tables;

use std::path::Path;

use self::rows::{CopiedTable, TableReader, content, insert};
use self::tables::TABLES;
use crate::audit::repair::recount;
use crate::db::conn::{Conn, ConnectionKind};
use crate::db::postgres_address::PostgresAddress;
use crate::db::query::{query, query_scalar};
use crate::{Catalog, CatalogError, NewCatalog, Result};
use mocban_core::domain::ContentHash;
use mocban_system::platform::stat;

/// The key that a copy takes over from its original.
const KEY: &str = "SELECT key FROM review_key";

/// Takes a lock with a random number until the end of the transaction, and returns the number as text.
const TAKE_MARK: &str = "
SELECT CAST(mark AS text) FROM (SELECT hashtextextended(CAST(gen_random_uuid() AS text), 0) AS mark) AS random
WHERE pg_try_advisory_xact_lock(mark)";
/// Returns whether a session holds the lock of that number in this database.
const SEES_MARK: &str = "
SELECT EXISTS (SELECT 1 FROM pg_locks
    WHERE locktype = 'advisory' AND objsubid = 1 AND granted
        AND database = (SELECT oid FROM pg_database WHERE datname = current_database())
        AND (CAST(classid AS bigint) << 32) | CAST(objid AS bigint) = CAST(?1 AS bigint))";
const SCHEMA: &str = "SELECT current_setting('search_path')";

/// Result of a copy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CatalogCopy {
    /// The tables, with the hashes that both catalogs have.
    pub tables: Vec<CopiedTable>,
    /// Whether the target was a finished copy already. Then nothing was written.
    pub existed: bool,
}

/// Receives a table and the number of its rows copied so far.
pub type CopyProgress = fn(&'static str, u64);

impl Catalog {
    /// Copies all rows of this catalog, as of one moment, to a file that is created. If the file is a catalog, as for
    /// [`Self::copy_to`].
    ///
    /// # Errors
    /// As for [`Self::copy_to`]. Leaves no new file in case of an error.
    pub async fn copy_to_file(&self, path: &Path, progress: CopyProgress) -> Result<CatalogCopy> {
        if let Some(new) = NewCatalog::begin(path).await? {
            let copied = self.copy_to(new.catalog(), progress).await;
            if copied.is_err() {
                new.discard().await;
                return copied;
            }
            if new.place().await? {
                return copied;
            }
        }
        if let (Ok(mine), Ok(found)) = (stat(&self.path), stat(path))
            && !self.is_shared()
            && mine.id == found.id
        {
            return Err(CatalogError::SameCatalog(path.to_owned()));
        }
        let existing = Self::open_read_only(path).await?;
        let compared = self.compare_with(&existing).await;
        existing.close().await;
        if let Some(found) = compared? {
            return Ok(found);
        }
        let empty = Self::open(path).await?;
        let copied = self.copy_to(&empty, progress).await;
        empty.close().await;
        copied
    }

    /// Copies all rows of this catalog, as of one moment, to an address of PostgreSQL. Creates the catalog there if it is
    /// missing. If it exists, as for [`Self::copy_to`].
    ///
    /// # Errors
    /// As for [`Self::copy_to`], and if the server does not answer or refuses. Leaves no new catalog in case of an error.
    pub async fn copy_to_server(&self, url: &str, progress: CopyProgress) -> Result<CatalogCopy> {
        let address = PostgresAddress::parse(url)?;
        loop {
            match Self::connect_read_only(url).await {
                Ok(existing) => {
                    let compared = self.compare_with(&existing).await;
                    existing.close().await;
                    if let Some(found) = compared? {
                        return Ok(found);
                    }
                }
                Err(CatalogError::NoSchema(_)) => {}
                Err(error) => return Err(error),
            }
            let mut source = self.original_snapshot().await?;
            // Dropping the connection after an error ends its transaction.
            let mut conn = address.connect_to_database().await?;
            sqlx::query("BEGIN").execute(&mut conn).await?;
            address.create_schema_in(&mut conn).await?;
            address.require_current(&mut conn).await?;
            let mut target = Conn::Postgres(ConnectionKind::Owned(conn));
            if let Some(tables) = copy_rows(&mut source, &mut target, progress).await? {
                query("COMMIT").execute(&mut target).await?;
                return Ok(CatalogCopy {
                    tables,
                    existed: false,
                });
            }
        }
    }

    /// Copies all rows of this catalog, as of one moment, to a catalog without rows. If the target is a finished copy that
    /// equals this catalog, writes nothing.
    ///
    /// # Errors
    /// Returns an error, and writes nothing, if the target holds another catalog or a copy that differs, if the databases
    /// store other values than they were given, or if a database operation fails.
    pub async fn copy_to(&self, target: &Self, progress: CopyProgress) -> Result<CatalogCopy> {
        loop {
            if let Some(found) = self.compare_with(target).await? {
                return Ok(found);
            }
            let mut source = self.original_snapshot().await?;
            let copied = target.in_transaction(move |conn| {
                Box::pin(async move { copy_rows(&mut source, conn, progress).await })
            });
            // Another process may have filled the target in the meantime.
            if let Some(tables) = copied.await? {
                return Ok(CatalogCopy {
                    tables,
                    existed: false,
                });
            }
        }
    }

    async fn original_snapshot(&self) -> Result<Conn> {
        self.snapshot().await.map_err(CatalogError::of_original)
    }

    /// Compares the rows of both catalogs. Returns `None` if the target has no rows.
    async fn compare_with(&self, target: &Self) -> Result<Option<CatalogCopy>> {
        let mut mine = self.original_snapshot().await?;
        let mut other = target.snapshot().await?;
        if is_same_on_server(&mut mine, &mut other).await? {
            return Err(CatalogError::SameCatalog(target.path.to_path_buf()));
        }
        if !has_rows(&mut other).await? {
            return Ok(None);
        }
        let wanted = query_scalar(KEY).fetch_one(&mut mine).await;
        let wanted: ContentHash = wanted.map_err(CatalogError::of_original)?;
        let found: ContentHash = query_scalar(KEY).fetch_one(&mut other).await?;
        if found != wanted {
            return Err(CatalogError::NotEmpty(target.path.to_path_buf()));
        }
        let mut tables = Vec::with_capacity(TABLES.len());
        for table in &TABLES {
            let wanted = content(&mut mine, table).await;
            let wanted = wanted.map_err(CatalogError::of_original)?;
            let found = content(&mut other, table).await?;
            if found != wanted {
                return Err(CatalogError::FinishedCopy {
                    target: target.path.to_path_buf(),
                    table: table.name,
                    original_rows: wanted.rows,
                    copy_rows: found.rows,
                });
            }
            tables.push(found);
        }
        Ok(Some(CatalogCopy {
            tables,
            existed: true,
        }))
    }
}

/// Returns whether two connections lead to the same catalog on a server, whatever their addresses are.
async fn is_same_on_server(mine: &mut Conn, other: &mut Conn) -> Result<bool> {
    let (Conn::Postgres(_), Conn::Postgres(_)) = (&*mine, &*other) else {
        return Ok(false);
    };
    let schema: String = query_scalar(SCHEMA).fetch_one(&mut *mine).await?;
    let other_schema: String = query_scalar(SCHEMA).fetch_one(&mut *other).await?;
    if schema != other_schema {
        return Ok(false);
    }
    let mark: String = query_scalar(TAKE_MARK).fetch_one(other).await?;
    query_scalar(SEES_MARK).bind(mark).fetch_one(mine).await
}

/// Returns whether a catalog holds anything besides its key.
async fn has_rows(conn: &mut Conn) -> Result<bool> {
    for table in TABLES.iter().filter(|table| table.name != "review_key") {
        if query(table.last).fetch_optional(conn).await?.is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Copies all rows in the open transaction of `target`, recounts the counters, sets the numbers of new rows, and compares
/// the copy with what was read. Returns `None` if the target has rows.
async fn copy_rows(
    source: &mut Conn,
    target: &mut Conn,
    progress: CopyProgress,
) -> Result<Option<Vec<CopiedTable>>> {
    if has_rows(target).await? {
        return Ok(None);
    }
    query("DELETE FROM review_key").execute(target).await?;
    let mut wanted = Vec::with_capacity(TABLES.len());
    for table in &TABLES {
        let mut reader = TableReader::new(table);
        loop {
            let page = reader.next_page(source).await;
            let page = page.map_err(CatalogError::of_original)?;
            if page.is_empty() {
                break;
            }
            insert(target, table, &page).await?;
            progress(table.name, reader.rows());
        }
        wanted.push(reader.content());
    }
    recount(target).await?;
    if let Conn::Postgres(_) = target {
        for sql in TABLES.iter().filter_map(|table| table.renumber) {
            query(sql).execute(target).await?;
        }
    }
    for (table, wanted) in TABLES.iter().zip(&wanted) {
        if content(target, table).await? != *wanted {
            return Err(CatalogError::CopyDiffers(table.name));
        }
    }
    Ok(Some(wanted))
}
