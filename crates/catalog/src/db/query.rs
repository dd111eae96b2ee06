//! Statements with parameters, run on either database.

use std::io;
use std::marker::PhantomData;
use std::time::Duration;

use sqlx::postgres::PgArguments;
use sqlx::sqlite::SqliteArguments;
use sqlx::{Arguments as _, AssertSqlSafe, Database, Encode, Postgres, Sqlite, Type};

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::error::{CatalogError, Result};
use crate::db::row::{FromRow, Row};
use crate::db::value::{Argument, FromValue};
use mocban_system::failpoint;
use mocban_system::platform::timeout_active;

/// Longest time for one statement on a server. Without a limit, a statement on a connection that broke silently would
/// wait forever.
const STATEMENT_LIMIT: Duration = Duration::from_mins(1);

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

    fn sqlite(self) -> Result<sqlx::query::Query<'static, Sqlite, SqliteArguments>> {
        let arguments = converted::<Sqlite>(self.arguments)?;
        Ok(sqlx::query_with(self.sql.sqlite, arguments))
    }

    fn postgres(self) -> Result<sqlx::query::Query<'static, Postgres, PgArguments>> {
        let arguments = converted::<Postgres>(self.arguments)?;
        // A constant, in which parameters were written differently.
        let sql = AssertSqlSafe(self.sql.postgres_query());
        Ok(sqlx::query_with(sql, arguments))
    }

    /// Runs the statement and ignores its rows.
    pub(crate) async fn execute(self, conn: &mut Conn) -> Result<()> {
        match conn {
            Conn::Sqlite(conn) => {
                self.sqlite()?.execute(&mut **conn).await?;
            }
            Conn::Postgres(conn) => {
                limited(self.postgres()?.execute(&mut **conn)).await?;
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
                let rows = self.sqlite()?.fetch_all(&mut **conn).await?.into_iter();
                rows.map(|row| R::value(Row::Sqlite(row))).collect()
            }
            Conn::Postgres(conn) => limited(self.postgres()?.fetch_all(&mut **conn))
                .await?
                .into_iter()
                .map(|row| R::value(Row::Postgres(row)))
                .collect(),
        }
    }

    /// Returns the first row, if there is one.
    pub(crate) async fn fetch_optional(self, conn: &mut Conn) -> Result<Option<R::Value>> {
        match conn {
            Conn::Sqlite(conn) => {
                let row = self.sqlite()?.fetch_optional(&mut **conn).await?;
                row.map(|row| R::value(Row::Sqlite(row))).transpose()
            }
            Conn::Postgres(conn) => {
                let row = limited(self.postgres()?.fetch_optional(&mut **conn)).await?;
                row.map(|row| R::value(Row::Postgres(row))).transpose()
            }
        }
    }

    /// Returns the first row.
    pub(crate) async fn fetch_one(self, conn: &mut Conn) -> Result<R::Value> {
        let row = self.fetch_optional(conn).await?;
        row.ok_or(CatalogError::Database(sqlx::Error::RowNotFound))
    }
}

/// Converts parameters for a database.
pub(crate) fn converted<D: Database>(
    arguments: impl IntoIterator<Item = Argument>,
) -> Result<D::Arguments>
where
    i64: Encode<'static, D> + Type<D>,
    f64: Encode<'static, D> + Type<D>,
    String: Encode<'static, D> + Type<D>,
    Vec<u8>: Encode<'static, D> + Type<D>,
    Option<i64>: Encode<'static, D> + Type<D>,
    Option<f64>: Encode<'static, D> + Type<D>,
    Option<String>: Encode<'static, D> + Type<D>,
    Option<Vec<u8>>: Encode<'static, D> + Type<D>,
{
    let mut converted = D::Arguments::default();
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

/// Limits the time of a statement on a server. After an error the connection cannot be used again.
pub(crate) async fn limited<T>(
    statement: impl Future<Output = sqlx::Result<T>>,
) -> sqlx::Result<T> {
    let longest = STATEMENT_LIMIT * failpoint::time_scale("MOCBAN_LIMIT_FACTOR");
    let limited = timeout_active(longest, statement).await;
    limited.unwrap_or_else(|| Err(no_reply(longest)))
}

/// Returns the error of a server that did not reply for so long.
pub(crate) fn no_reply(time: Duration) -> sqlx::Error {
    let text = format!("no reply for {} s", time.as_secs());
    sqlx::Error::Io(io::Error::new(io::ErrorKind::TimedOut, text))
}
