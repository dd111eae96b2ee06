//! Statements with parameters, run on either database.

use std::io;
use std::marker::PhantomData;
use std::time::Duration;

use sqlx::postgres::PgArguments;
use sqlx::sqlite::SqliteArguments;
use sqlx::{Arguments as _, AssertSqlSafe};

use crate::catalog::db::conn::Conn;
use crate::catalog::db::dialect::Sql;
use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::row::{FromRow, Row};
use crate::catalog::db::value::{Argument, FromValue};

/// A statement with its parameters `?1`, `?2` and so on. `R` says what each row becomes.
#[derive(Debug)]
pub(crate) struct Query<R> {
    sql: Sql,
    arguments: Vec<Argument>,
    rows: PhantomData<fn() -> R>,
}

/// What rows become.
pub(crate) trait Rows {
    /// The value of one row.
    type Value;
    fn value(row: Row) -> Result<Self::Value>;
}

/// Rows as they are.
#[derive(Debug)]
pub(crate) struct Raw;

/// Rows read as a `T`.
#[derive(Debug)]
pub(crate) struct As<T>(PhantomData<T>);

/// Rows with one column, which is read as a `T`.
#[derive(Debug)]
pub(crate) struct Scalar<T>(PhantomData<T>);

impl Rows for Raw {
    type Value = Row;
    fn value(row: Row) -> Result<Row> {
        Ok(row)
    }
}

impl<T: FromRow> Rows for As<T> {
    type Value = T;
    fn value(row: Row) -> Result<T> {
        T::from_row(&row)
    }
}

impl<T: FromValue> Rows for Scalar<T> {
    type Value = T;
    fn value(row: Row) -> Result<T> {
        row.get(0)
    }
}

/// Makes a statement whose rows are read by column, or that returns none.
pub(crate) fn query(sql: impl Into<Sql>) -> Query<Raw> {
    Query::new(sql.into())
}

/// Makes a statement whose rows become values of a type.
pub(crate) fn query_as<T: FromRow>(sql: impl Into<Sql>) -> Query<As<T>> {
    Query::new(sql.into())
}

/// Makes a statement whose rows have one column.
pub(crate) fn query_scalar<T: FromValue>(sql: impl Into<Sql>) -> Query<Scalar<T>> {
    Query::new(sql.into())
}

impl<R> Query<R> {
    const fn new(sql: Sql) -> Self {
        Self {
            sql,
            arguments: Vec::new(),
            rows: PhantomData,
        }
    }

    /// Binds the next parameter.
    pub(crate) fn bind(mut self, argument: impl Into<Argument>) -> Self {
        self.arguments.push(argument.into());
        self
    }

    /// Runs the statement and ignores its rows.
    pub(crate) async fn execute(self, conn: &mut Conn) -> Result<()> {
        match conn {
            Conn::Sqlite(conn) => {
                let arguments = sqlite_arguments(self.arguments)?;
                let query = sqlx::query_with(self.sql.sqlite, arguments);
                query.execute(&mut **conn).await?;
            }
            Conn::Postgres(conn) => {
                let arguments = postgres_arguments(self.arguments)?;
                let sql = AssertSqlSafe(self.sql.postgres_query());
                let query = sqlx::query_with(sql, arguments);
                limited(query.execute(&mut **conn)).await?;
            }
        }
        Ok(())
    }
}

impl<R: Rows> Query<R> {
    /// Returns all rows.
    pub(crate) async fn fetch_all(self, conn: &mut Conn) -> Result<Vec<R::Value>> {
        match conn {
            Conn::Sqlite(conn) => {
                let arguments = sqlite_arguments(self.arguments)?;
                let rows = sqlx::query_with(self.sql.sqlite, arguments).fetch_all(&mut **conn);
                let rows = rows.await?.into_iter();
                rows.map(|row| R::value(Row::Sqlite(row))).collect()
            }
            Conn::Postgres(conn) => {
                let arguments = postgres_arguments(self.arguments)?;
                let sql = AssertSqlSafe(self.sql.postgres_query());
                let rows = sqlx::query_with(sql, arguments).fetch_all(&mut **conn);
                let rows = limited(rows).await?.into_iter();
                rows.map(|row| R::value(Row::Postgres(row))).collect()
            }
        }
    }

    /// Returns the first row, if there is one.
    pub(crate) async fn fetch_optional(self, conn: &mut Conn) -> Result<Option<R::Value>> {
        match conn {
            Conn::Sqlite(conn) => {
                let arguments = sqlite_arguments(self.arguments)?;
                let row = sqlx::query_with(self.sql.sqlite, arguments).fetch_optional(&mut **conn);
                row.await?.map(|row| R::value(Row::Sqlite(row))).transpose()
            }
            Conn::Postgres(conn) => {
                let arguments = postgres_arguments(self.arguments)?;
                let sql = AssertSqlSafe(self.sql.postgres_query());
                let row = sqlx::query_with(sql, arguments).fetch_optional(&mut **conn);
                let row = limited(row).await?.map(Row::Postgres);
                row.map(R::value).transpose()
            }
        }
    }

    /// Returns the first row.
    ///
    /// # Errors
    /// Returns an error if there is none.
    pub(crate) async fn fetch_one(self, conn: &mut Conn) -> Result<R::Value> {
        let row = self.fetch_optional(conn).await?;
        row.ok_or(CatalogError::Database(sqlx::Error::RowNotFound))
    }
}

/// Converts parameters for SQLite.
pub(crate) fn sqlite_arguments(
    arguments: impl IntoIterator<Item = Argument>,
) -> Result<SqliteArguments> {
    let mut converted = SqliteArguments::default();
    for argument in arguments {
        let added = match argument {
            Argument::Null => converted.add(None::<i64>),
            Argument::Integer(value) => converted.add(value),
            Argument::Real(value) => converted.add(value),
            Argument::Text(value) => converted.add(value),
            Argument::Blob(value) => converted.add(value),
        };
        added.map_err(sqlx::Error::Encode)?;
    }
    Ok(converted)
}

/// Converts parameters for PostgreSQL.
fn postgres_arguments(arguments: Vec<Argument>) -> Result<PgArguments> {
    let mut converted = PgArguments::default();
    for argument in arguments {
        let added = match argument {
            Argument::Null => converted.add(None::<i64>),
            Argument::Integer(value) => converted.add(value),
            Argument::Real(value) => converted.add(value),
            Argument::Text(value) => converted.add(value),
            Argument::Blob(value) => converted.add(value),
        };
        added.map_err(sqlx::Error::Encode)?;
    }
    Ok(converted)
}

/// Longest time for one statement on a server. A connection that broke without a message would otherwise be waited for
/// without end.
const STATEMENT_LIMIT: Duration = Duration::from_mins(1);

/// Limits the time of a statement on a server. After an error the connection cannot be used again.
pub(crate) async fn limited<T>(
    statement: impl Future<Output = sqlx::Result<T>>,
) -> sqlx::Result<T> {
    let limited = tokio::time::timeout(STATEMENT_LIMIT, statement).await;
    limited.unwrap_or_else(|_| {
        let text = format!("no answer for {} s", STATEMENT_LIMIT.as_secs());
        Err(sqlx::Error::Io(io::Error::new(
            io::ErrorKind::TimedOut,
            text,
        )))
    })
}
