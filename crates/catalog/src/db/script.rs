//! Runs several statements in one round trip. A round trip to SQLite's thread takes about 30 us, longer than most
//! statements; a round trip to PostgreSQL takes as long as the network.

use std::fmt;
use std::marker::PhantomData;

use futures_util::{Stream, TryStreamExt as _};
use serde::Serialize;
use sqlx::{AssertSqlSafe, Either, Executor as _, Sqlite};

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::error::Result;
use crate::db::query::{converted, limited};
use crate::db::row::{FromRow, Row};
use crate::db::value::Argument;

/// SQL statements with their parameters. They run in order until one of them fails.
///
/// Parameters are written as plain `?`. sqlx binds them in order across all statements.
#[derive(Debug, Default)]
pub(crate) struct Script {
    statements: Vec<(Sql, Vec<Argument>)>,
}

/// A statement of a [`Script`] whose rows are of type `T`.
pub(crate) struct Statement<T> {
    index: usize,
    row: PhantomData<fn() -> T>,
}

/// The rows of each statement of a script.
#[derive(Debug)]
pub(crate) struct ScriptRows(Vec<Vec<Row>>);

impl Script {
    /// Adds a statement; its parameters are bound next.
    pub(crate) fn add<T>(&mut self, sql: impl Into<Sql>) -> Statement<T> {
        self.statements.push((sql.into(), Vec::new()));
        Statement {
            index: self.statements.len() - 1,
            row: PhantomData,
        }
    }

    /// Adds a statement that returns no rows.
    pub(crate) fn execute(&mut self, sql: impl Into<Sql>) {
        self.add::<()>(sql);
    }

    /// Binds the next parameter.
    pub(crate) fn bind(&mut self, value: impl Into<Argument>) {
        if let Some((_, arguments)) = self.statements.last_mut() {
            arguments.push(value.into());
        }
    }

    /// Adds a statement whose parameter is a JSON array of the items. Returns `None`, and adds nothing, if there are no
    /// items.
    pub(crate) fn add_over<T>(
        &mut self,
        sql: impl Into<Sql>,
        items: impl Iterator<Item = impl Serialize>,
    ) -> Result<Option<Statement<T>>> {
        let mut array = String::new();
        for item in items {
            array.push(if array.is_empty() { '[' } else { ',' });
            array.push_str(&serde_json::to_string(&item)?);
        }
        if array.is_empty() {
            return Ok(None);
        }
        array.push(']');
        let statement = self.add(sql);
        self.bind(array);
        Ok(Some(statement))
    }

    /// Like [`Script::add_over`], for a statement that returns no rows.
    pub(crate) fn execute_over(
        &mut self,
        sql: impl Into<Sql>,
        items: impl Iterator<Item = impl Serialize>,
    ) -> Result<()> {
        self.add_over::<()>(sql, items).map(drop)
    }

    /// Runs all statements.
    pub(crate) async fn run(self, conn: &mut Conn) -> Result<ScriptRows> {
        match conn {
            Conn::Sqlite(conn) => {
                let mut sql = String::new();
                for (statement, _) in &self.statements {
                    sql.push_str(statement.sqlite);
                    sql.push_str(";\n");
                }
                let arguments = self.statements.into_iter();
                let arguments = arguments.flat_map(|(_, arguments)| arguments);
                let arguments = converted::<Sqlite>(arguments)?;
                // Concatenated constants only.
                let query = sqlx::query_with(AssertSqlSafe(sql), arguments);
                let results = conn.fetch_many(query);
                Ok(rows_of(results.map_ok(|one| one.map_right(Row::Sqlite))).await?)
            }
            Conn::Postgres(conn) => {
                let mut sql = String::new();
                for (statement, arguments) in &self.statements {
                    statement.add_postgres(&mut sql, arguments)?;
                }
                // Constants, and values that `add_postgres` quotes.
                let query = sqlx::raw_sql(AssertSqlSafe(sql));
                let results = conn.fetch_many(query);
                let rows = rows_of(results.map_ok(|one| one.map_right(Row::Postgres)));
                Ok(limited(rows).await?)
            }
        }
    }
}

/// Collects the rows of each statement of a stream. The left value marks the end of a statement.
async fn rows_of<E>(
    mut results: impl Stream<Item = sqlx::Result<Either<E, Row>>> + Unpin,
) -> sqlx::Result<ScriptRows> {
    let mut rows = vec![Vec::new()];
    while let Some(result) = results.try_next().await? {
        match result {
            Either::Right(row) => {
                if let Some(rows) = rows.last_mut() {
                    rows.push(row);
                }
            }
            Either::Left(_) => rows.push(Vec::new()),
        }
    }
    Ok(ScriptRows(rows))
}

impl ScriptRows {
    /// Reads the rows of a statement.
    pub(crate) fn read<T: FromRow>(&self, statement: &Statement<T>) -> Result<Vec<T>> {
        let rows = self.0.get(statement.index).into_iter().flatten();
        rows.map(T::from_row).collect()
    }

    /// Reads the rows of a statement that may have been left out.
    pub(crate) fn read_if_any<T: FromRow>(
        &self,
        statement: Option<&Statement<T>>,
    ) -> Result<Vec<T>> {
        statement.map_or_else(|| Ok(Vec::new()), |statement| self.read(statement))
    }
}

impl<T> fmt::Debug for Statement<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Statement").field(&self.index).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::{Script, Statement};
    use crate::db::conn::Conn;
    use crate::db::query::query_scalar;

    #[tokio::test]
    async fn each_statement_has_its_own_parameters_and_rows() {
        let mut conn = Conn::in_memory().await;
        let mut script = Script::default();
        script.execute("CREATE TABLE t (a, b)");
        script.execute("INSERT INTO t VALUES (?, ?)");
        script.bind(1_i64);
        script.bind("x");
        let items: Statement<(i64,)> = script
            .add_over(
                "INSERT INTO t SELECT value, 'y' FROM json_each(?) WHERE true RETURNING a",
                [7, 8].iter(),
            )
            .expect("bound")
            .expect("a statement");
        let none = script.add_over::<(i64,)>("SELECT ?", [0; 0].iter());
        assert!(none.expect("bound").is_none());
        let last: Statement<(String, i64)> =
            script.add("SELECT b, a FROM t WHERE a = ? UNION ALL SELECT b, ? FROM t WHERE a = 1");
        script.bind(7_i64);
        script.bind(12_i64);
        let rows = script.run(&mut conn).await.expect("rows");
        assert_eq!(rows.read(&items).expect("numbers"), [(7,), (8,)]);
        let wanted = [("y".to_owned(), 7), ("x".to_owned(), 12)];
        assert_eq!(rows.read(&last).expect("rows"), wanted);
    }

    #[tokio::test]
    async fn statements_after_one_that_fails_do_not_run() {
        let mut conn = Conn::in_memory().await;
        let mut script = Script::default();
        for sql in [
            "CREATE TABLE t (a UNIQUE)",
            "INSERT INTO t VALUES (1)",
            "INSERT INTO t VALUES (1)",
            "DROP TABLE t",
        ] {
            script.execute(sql);
        }
        assert!(script.run(&mut conn).await.is_err());
        let left = query_scalar::<i64>("SELECT count(*) FROM t");
        assert_eq!(left.fetch_one(&mut conn).await.expect("the table"), 1);
    }
}
