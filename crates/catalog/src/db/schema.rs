//! The schema of a catalog in a file, and what differs from it.
//!
//! A trigger that another program added would change rows whenever this program writes, so a catalog with one is not
//! written to. A missing index or trigger does no harm; a repair creates it again.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::{LazyLock, OnceLock};

use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions as _, SqlSafeStr as _, SqliteConnection};

use crate::db::error::{CatalogError, Result};

/// Number of objects that the error of a foreign schema names.
const NAMED: usize = 3;

/// The migrations of SQLite. The macro of sqlx that reads the folder would compile sqlx a second time.
pub(crate) static MIGRATOR: LazyLock<Migrator> = LazyLock::new(|| {
    let sql = include_str!("../../../../migrations/sqlite/0001_initial.sql").into_sql_str();
    let kind = MigrationType::Simple;
    Migrator::with_migrations(vec![Migration::new(1, "initial".into(), kind, sql, false)])
});

/// Selects what a schema consists of. Tables of SQLite and sqlx are left out by their statement, not by their name, which
/// a trigger may have too; so is the table that a backup adds.
const OBJECTS: &str = r"
SELECT type || ' ' || name, sql FROM sqlite_schema
WHERE sql IS NOT NULL AND sql NOT LIKE 'CREATE TABLE sqlite\_%' ESCAPE '\'
    AND sql NOT LIKE 'CREATE TABLE \_sqlx\_migrations (%' ESCAPE '\'
    AND sql <> 'CREATE TABLE backup_settings (text BLOB NOT NULL) STRICT'
ORDER BY 1";

/// A table, index or trigger that differs from the schema of this program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SchemaDifference {
    /// It is missing.
    Missing(String),
    /// This program does not create it.
    Foreign(String),
    /// Its statement is another one.
    Changed(String),
}

impl SchemaDifference {
    /// Returns whether a write could have another effect than this program means.
    const fn changes_writes(&self) -> bool {
        matches!(self, Self::Foreign(_) | Self::Changed(_))
    }
}

impl fmt::Display for SchemaDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(name) => write!(f, "{name} is missing"),
            Self::Foreign(name) => write!(f, "{name} does not belong to this program"),
            Self::Changed(name) => write!(f, "{name} differs from its definition"),
        }
    }
}

/// Compares a catalog with the schema of this program, which [`wanted_objects`] returns.
pub(crate) async fn differences(
    conn: &mut SqliteConnection,
    wanted: &BTreeMap<String, String>,
) -> Result<Vec<SchemaDifference>> {
    let found = objects(conn).await?;
    let is_there = |name: &String| found.iter().any(|(found, _)| found == name);
    let missing = wanted.keys().filter(|name| !is_there(name)).cloned();
    let mut differences: Vec<_> = missing.map(SchemaDifference::Missing).collect();
    for (number, (name, sql)) in found.iter().enumerate() {
        // Sorted by name. A file that was not written by SQLite may hold two objects of one name.
        let is_second = number > 0 && found[number - 1].0 == *name;
        match wanted.get(name) {
            None => differences.push(SchemaDifference::Foreign(name.clone())),
            Some(wanted) if wanted != sql || is_second => {
                differences.push(SchemaDifference::Changed(name.clone()));
            }
            Some(_) => {}
        }
    }
    Ok(differences)
}

/// Refuses a catalog to which another program added something, or whose schema it changed.
///
/// # Errors
/// Returns an error that names the first objects, or an error if a database operation fails.
pub(crate) async fn require_own(conn: &mut SqliteConnection, path: &Path) -> Result<()> {
    let found = differences(conn, wanted_objects().await?).await?;
    let mut found = found.iter().filter(|found| found.changes_writes());
    let named: Vec<_> = found
        .by_ref()
        .take(NAMED)
        .map(ToString::to_string)
        .collect();
    if named.is_empty() {
        return Ok(());
    }
    let more = match found.count() {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    Err(CatalogError::ForeignSchema {
        path: path.to_owned(),
        what: named.join(", ") + &more,
    })
}

/// Returns tables, indexes and triggers by kind and name, with their SQL, sorted.
async fn objects(conn: &mut SqliteConnection) -> Result<Vec<(String, String)>> {
    Ok(sqlx::query_as(OBJECTS).fetch_all(conn).await?)
}

/// Returns the objects of a new catalog by kind and name, with their SQL.
pub(crate) async fn wanted_objects() -> Result<&'static BTreeMap<String, String>> {
    static WANTED: OnceLock<BTreeMap<String, String>> = OnceLock::new();
    if let Some(wanted) = WANTED.get() {
        return Ok(wanted);
    }
    let options = SqliteConnectOptions::new().in_memory(true);
    let mut conn = options.connect().await?;
    MIGRATOR.run(&mut conn).await?;
    let created = objects(&mut conn).await?;
    Ok(WANTED.get_or_init(|| created.into_iter().collect()))
}

#[cfg(test)]
mod tests {
    use sqlx::{Connection as _, SqliteConnection};

    use super::{MIGRATOR, SchemaDifference, differences, wanted_objects};

    /// Returns what differs after statements on a new catalog.
    async fn after(sql: &'static str) -> Vec<SchemaDifference> {
        let mut conn = SqliteConnection::connect(":memory:")
            .await
            .expect("a database");
        MIGRATOR.run(&mut conn).await.expect("the schema");
        sqlx::raw_sql(sql).execute(&mut conn).await.expect("run");
        let wanted = wanted_objects().await.expect("the schema");
        differences(&mut conn, wanted).await.expect("a read")
    }

    #[tokio::test]
    async fn what_other_programs_add_or_change_is_named_whatever_its_name() {
        use SchemaDifference::{Changed, Foreign, Missing};
        let backup = "CREATE TABLE backup_settings (text BLOB NOT NULL) STRICT; ANALYZE";
        assert_eq!(after(backup).await, []);
        for (sql, wanted) in [
            (
                "CREATE TRIGGER evil AFTER INSERT ON worker BEGIN DELETE FROM pair; END",
                Foreign("trigger evil".to_owned()),
            ),
            (
                "CREATE TRIGGER _sqlx_migrations AFTER INSERT ON worker BEGIN DELETE FROM pair; END",
                Foreign("trigger _sqlx_migrations".to_owned()),
            ),
            (
                "CREATE TRIGGER sqlitex AFTER INSERT ON worker BEGIN DELETE FROM pair; END",
                Foreign("trigger sqlitex".to_owned()),
            ),
            (
                "CREATE TRIGGER backup_settings AFTER INSERT ON worker BEGIN DELETE FROM pair; END",
                Foreign("trigger backup_settings".to_owned()),
            ),
            ("CREATE VIEW v AS SELECT 1", Foreign("view v".to_owned())),
            (
                "CREATE TABLE backup_settings (text BLOB NOT NULL CHECK (abs(1) = 1)) STRICT",
                Foreign("table backup_settings".to_owned()),
            ),
            (
                "ALTER TABLE truth ADD COLUMN more TEXT DEFAULT 'x'",
                Changed("table truth".to_owned()),
            ),
            (
                "DROP INDEX verdict_act",
                Missing("index verdict_act".to_owned()),
            ),
        ] {
            assert_eq!(after(sql).await, [wanted], "{sql}");
        }
    }
}
