//! Reads, inserts and compares the rows of a table of a catalog, page by page.

use sqlx::{AssertSqlSafe, Sqlite};

use super::tables::CopyTable;
use crate::db::conn::Conn;
use crate::db::dialect::add_literal;
use crate::db::query::{Query, converted, limited, query};
use crate::db::row::Row;
use crate::db::value::{Argument, Value};
use crate::{CatalogError, Result};
use mocban_core::domain::ContentHash;

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

/// Reads a table in the order of its keys, and counts and hashes its rows.
pub(super) struct TableReader {
    table: &'static CopyTable,
    /// Key of the last row that was read.
    after: Vec<Argument>,
    rows: u64,
    hasher: blake3::Hasher,
}

impl TableReader {
    pub(super) fn new(table: &'static CopyTable) -> Self {
        Self {
            table,
            after: table.key_before_all(),
            rows: 0,
            hasher: blake3::Hasher::new(),
        }
    }

    /// Returns the number of rows read so far.
    pub(super) const fn rows(&self) -> u64 {
        self.rows
    }

    /// Returns the next rows, or none at the end.
    pub(super) async fn next_page(&mut self, conn: &mut Conn) -> Result<Vec<Row>> {
        let after = self.after.iter().cloned();
        let query = after.fold(query(self.table.page), Query::bind);
        let page = query.bind(PAGE).fetch_all(conn).await?;
        if let Some(last) = page.last() {
            let key = (0..self.table.keys).map(|column| argument(last, column));
            self.after = key.collect::<Result<_>>()?;
        }
        self.rows += page.len() as u64;
        for row in &page {
            for column in 0..self.table.columns {
                row.value(column)?.hash_into(|part| {
                    self.hasher.update(part);
                });
            }
        }
        Ok(page)
    }

    /// Returns what was read.
    pub(super) fn content(&self) -> CopiedTable {
        CopiedTable {
            name: self.table.name,
            rows: self.rows,
            hash: ContentHash::from_bytes(*self.hasher.finalize().as_bytes()),
        }
    }
}

/// Counts and hashes the rows of a table.
pub(super) async fn content(conn: &mut Conn, table: &'static CopyTable) -> Result<CopiedTable> {
    let mut reader = TableReader::new(table);
    while !reader.next_page(conn).await?.is_empty() {}
    Ok(reader.content())
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

/// Inserts rows in one statement.
pub(super) async fn insert(conn: &mut Conn, table: &CopyTable, rows: &[Row]) -> Result<()> {
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
                    // With a number, SQLite would search all earlier parameters for it.
                    sql.push('?');
                }
                Conn::Postgres(_) => add_literal(&mut sql, &argument)?,
            }
        }
        sql.push(')');
    }
    // Constants, parameters, and values that `add_literal` quotes.
    let sql = AssertSqlSafe(sql);
    match conn {
        Conn::Sqlite(conn) => {
            let query = sqlx::query_with(sql, converted::<Sqlite>(arguments)?);
            query.execute(&mut **conn).await?;
        }
        Conn::Postgres(conn) => {
            limited(sqlx::raw_sql(sql).execute(&mut **conn)).await?;
        }
    }
    Ok(())
}
