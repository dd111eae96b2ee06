//! Several statements that the database runs in one go: each trip to its thread and back costs more than a statement.

use std::fmt::Write as _;

use sqlx::sqlite::{SqliteArguments, SqliteRow};
use sqlx::{Arguments as _, AssertSqlSafe, Encode, Sqlite, SqliteConnection, Type};

use crate::catalog::db::error::Result;

/// Statements with their parameters, run in their order until one fails.
#[derive(Debug, Default)]
pub(crate) struct Script {
    sql: String,
    parameters: SqliteArguments,
}

impl Script {
    /// Adds statements that share the parameters that are bound next; `?1` is the first of those.
    pub(crate) fn add(&mut self, statements: &[&'static str]) -> &mut Self {
        let before = self.parameters.len();
        for statement in statements {
            renumber(statement, before, &mut self.sql);
            self.sql.push_str(";\n");
        }
        self
    }

    /// Binds the next parameter.
    pub(crate) fn bind<'t, T: Encode<'t, Sqlite> + Type<Sqlite>>(
        &mut self,
        value: T,
    ) -> Result<&mut Self> {
        let bound = self.parameters.add(value);
        bound.map_err(sqlx::Error::Encode)?;
        Ok(self)
    }

    /// Runs all; gives the rows that they return, those of the first one first.
    pub(crate) async fn run(self, conn: &mut SqliteConnection) -> Result<Vec<SqliteRow>> {
        // Made of constants only.
        let query = sqlx::query_with(AssertSqlSafe(self.sql), self.parameters);
        Ok(query.fetch_all(conn).await?)
    }
}

/// Writes a statement whose `?1` is to be the parameter after so many others. `$7` is a name, where `?7` would also call
/// for six parameters that this statement does not have.
fn renumber(statement: &str, before: usize, to: &mut String) {
    let mut parts = statement.split('?');
    to.push_str(parts.next().unwrap_or_default());
    for part in parts {
        let digits = part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, rest) = part.split_at(digits);
        let number: usize = number.parse().expect("our parameters are numbered");
        write!(to, "${}{rest}", number + before).expect("a string takes all");
    }
}

#[cfg(test)]
mod tests {
    use sqlx::{Connection as _, Row as _, SqliteConnection};

    use super::Script;

    #[tokio::test]
    async fn statements_see_their_own_parameters_and_give_their_rows_in_order() {
        let conn = SqliteConnection::connect("sqlite::memory:").await;
        let mut conn = conn.expect("a database");
        let mut script = Script::default();
        script.add(&["CREATE TABLE t (a, b)"]);
        let both = [
            "INSERT INTO t VALUES (?1, ?2)",
            "INSERT INTO t VALUES (?2, ?1)",
        ];
        let bound = script
            .add(&both)
            .bind(1)
            .and_then(|script| script.bind("x"));
        bound.expect("bound");
        let last = script
            .add(&["SELECT a, b FROM t WHERE b = ?1 UNION ALL SELECT a, ?2 FROM t WHERE a = ?1"]);
        let bound = last.bind("x").and_then(|script| script.bind(12));
        bound.expect("bound");
        let rows = script.run(&mut conn).await.expect("rows");
        let of = |row: usize| (rows[row].get::<String, _>(0), rows[row].get::<i64, _>(1));
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].get::<i64, _>(0), 1);
        assert_eq!(of(1), ("x".to_owned(), 12));
    }

    #[tokio::test]
    async fn what_comes_after_a_statement_that_fails_is_not_run() {
        let conn = SqliteConnection::connect("sqlite::memory:").await;
        let mut conn = conn.expect("a database");
        let mut script = Script::default();
        script.add(&[
            "CREATE TABLE t (a UNIQUE)",
            "INSERT INTO t VALUES (1)",
            "INSERT INTO t VALUES (1)",
            "DROP TABLE t",
        ]);
        assert!(script.run(&mut conn).await.is_err());
        let left = sqlx::query_scalar::<_, i64>("SELECT count(*) FROM t");
        assert_eq!(left.fetch_one(&mut conn).await.expect("the table"), 1);
    }
}
