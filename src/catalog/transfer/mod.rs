//! Copies a catalog to another one, between a file and PostgreSQL or the same kind. A repeated call continues an
//! interrupted copy. At the end, the rows of both catalogs are compared.

mod tables;

use std::fmt::Write as _;

use sqlx::{AssertSqlSafe, Sqlite};

use self::tables::{CopyTable, TABLES};
use crate::catalog::db::conn::Conn;
use crate::catalog::db::dialect::add_literal;
use crate::catalog::db::query::{converted, query, query_scalar};
use crate::catalog::db::row::Row;
use crate::catalog::db::value::{Argument, Value};
use crate::catalog::{Catalog, CatalogError, Result};
use crate::domain::ContentHash;

/// Rows in one statement. SQLite allows 32,766 parameters, and a table has at most 23 columns.
const PAGE: i64 = 1_000;

/// What a table of a copy contains.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct CopiedTable {
    /// The table.
    pub name: &'static str,
    /// Number of its rows.
    pub rows: u64,
    /// Hash of its rows, the same in every database.
    pub hash: ContentHash,
}

impl Catalog {
    /// Copies all rows of this catalog, as of one moment, to `target`. Continues an interrupted copy of this catalog.
    /// Passes each table and the number of its rows copied so far to `progress`. Returns the tables, with the hashes
    /// that both catalogs have.
    ///
    /// # Errors
    /// Returns an error if the target holds another catalog, if it differs afterwards because this catalog changed
    /// since the copy was begun, or if a database operation fails.
    pub async fn copy_to(
        &self,
        target: &Self,
        mut progress: impl FnMut(&'static str, u64),
    ) -> Result<Vec<CopiedTable>> {
        let mut source = self.snapshot().await?;
        self.claim_target(&mut source, target).await?;
        for table in &TABLES {
            let mut after = target.last_key(table).await?;
            let mut rows = 0;
            loop {
                let page = page(&mut source, table, &after).await?;
                let Some(last) = page.last() else { break };
                after = key(last, table.keys)?;
                rows += page.len() as u64;
                target
                    .in_transaction(move |conn| {
                        Box::pin(async move { insert(conn, table, &page).await })
                    })
                    .await?;
                progress(table.name, rows);
            }
        }
        target.finish_copy().await?;
        let mut copied = target.snapshot().await?;
        let mut compared = Vec::with_capacity(TABLES.len());
        for table in &TABLES {
            let wanted = content(&mut source, table).await?;
            if content(&mut copied, table).await? != wanted {
                return Err(CatalogError::CopyDiffers(table.name));
            }
            compared.push(wanted);
        }
        Ok(compared)
    }

    /// Gives a new catalog this catalog's key, by which a later call knows an interrupted copy of this catalog.
    async fn claim_target(&self, source: &mut Conn, target: &Self) -> Result<()> {
        const KEY: &str = "SELECT key FROM review_key";
        let wanted: ContentHash = query_scalar(KEY).fetch_one(source).await?;
        let path = target.path.to_path_buf();
        target
            .in_transaction(move |conn| {
                Box::pin(async move {
                    let found: ContentHash = query_scalar(KEY).fetch_one(conn).await?;
                    if found == wanted {
                        return Ok(());
                    }
                    let has_content =
                        "SELECT EXISTS (SELECT 1 FROM pair) OR EXISTS (SELECT 1 FROM worker) OR EXISTS (SELECT 1 FROM block)";
                    if query_scalar(has_content).fetch_one(conn).await? {
                        return Err(CatalogError::NotEmpty(path));
                    }
                    let set = query("UPDATE review_key SET key = ?1");
                    set.bind(&wanted.as_bytes()[..]).execute(conn).await
                })
            })
            .await
    }

    /// Returns the largest key of a table, or the key before all rows.
    async fn last_key(&self, table: &CopyTable) -> Result<Vec<Argument>> {
        let mut conn = self.read_conn().await?;
        match query(table.last).fetch_optional(&mut conn).await? {
            Some(row) => key(&row, table.keys),
            None => Ok(table.key_before_all()),
        }
    }

    /// Recounts the counters, and sets the numbers of new rows.
    async fn finish_copy(&self) -> Result<()> {
        self.rebuild_counters().await?;
        if !self.is_shared() {
            return Ok(());
        }
        self.in_transaction(|conn| {
            Box::pin(async move {
                for sql in TABLES.iter().filter_map(|table| table.renumber) {
                    query(sql).execute(conn).await?;
                }
                Ok(())
            })
        })
        .await
    }
}

/// Reads the rows that follow a key.
async fn page(conn: &mut Conn, table: &CopyTable, after: &[Argument]) -> Result<Vec<Row>> {
    let page = after
        .iter()
        .cloned()
        .fold(query(table.page), super::db::query::Query::bind);
    page.bind(PAGE).fetch_all(conn).await
}

/// Returns the key of a row.
fn key(row: &Row, keys: usize) -> Result<Vec<Argument>> {
    (0..keys).map(|column| argument(row, column)).collect()
}

fn argument(row: &Row, column: usize) -> Result<Argument> {
    Ok(match row.value(column)? {
        Value::Null => Argument::Null,
        Value::Integer(number) => Argument::Integer(Some(number)),
        Value::Real(number) => Argument::Real(Some(number)),
        Value::Text(text) => Argument::Text(Some(
            String::from_utf8(text.into_owned())
                .map_err(|error| CatalogError::Corrupt(format!("column {column}: {error}")))?,
        )),
        Value::Blob(bytes) => Argument::Blob(Some(bytes.into_owned())),
    })
}

/// Inserts rows in one statement. A row that is there already is kept.
async fn insert(conn: &mut Conn, table: &CopyTable, rows: &[Row]) -> Result<()> {
    let mut sql = format!("INSERT INTO {} ({}) VALUES ", table.name, table.names);
    let mut arguments = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        sql.push_str(if number == 0 { "(" } else { ", (" });
        for column in 0..table.columns {
            if column > 0 {
                sql.push_str(", ");
            }
            let argument = argument(row, column)?;
            match conn {
                Conn::Sqlite(_) => {
                    arguments.push(argument);
                    // Writing to a string does not fail.
                    let _ = write!(sql, "?{}", arguments.len());
                }
                Conn::Postgres(_) => add_literal(&mut sql, &argument)?,
            }
        }
        sql.push(')');
    }
    sql.push_str(" ON CONFLICT DO NOTHING");
    // Constants, numbers of parameters, and values that `add_literal` quotes.
    let sql = AssertSqlSafe(sql);
    match conn {
        Conn::Sqlite(conn) => {
            let query = sqlx::query_with(sql, converted::<Sqlite>(arguments)?);
            query.execute(&mut **conn).await?;
        }
        Conn::Postgres(conn) => {
            sqlx::raw_sql(sql).execute(&mut **conn).await?;
        }
    }
    Ok(())
}

/// Counts and hashes the rows of a table, in the order of their keys.
async fn content(conn: &mut Conn, table: &CopyTable) -> Result<CopiedTable> {
    let mut after = table.key_before_all();
    let (mut rows, mut hasher) = (0, blake3::Hasher::new());
    loop {
        let page = page(conn, table, &after).await?;
        let Some(last) = page.last() else { break };
        after = key(last, table.keys)?;
        rows += page.len() as u64;
        for row in &page {
            for column in 0..table.columns {
                row.value(column)?.hash_into(|part| {
                    hasher.update(part);
                });
            }
        }
    }
    Ok(CopiedTable {
        name: table.name,
        rows,
        hash: ContentHash::from_bytes(*hasher.finalize().as_bytes()),
    })
}
