//! What projects hold, without times and chance, to compare a run that was killed with one that was not.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, ConnectOptions as _, Connection as _};

use crate::report::contents;

/// Columns with times, the number of a worker, and the size and time of a file.
const TIMES: [&str; 8] = [
    "at",
    "imported",
    "labels_stat",
    "mesh_stat",
    "ms",
    "page_stat",
    "print_stat",
    "worker",
];
/// A column with numbers in the order in which workers claim pairs.
const CLAIMS: (&str, &str) = ("attempt", "id");
/// Tables with nothing but times and random numbers, and the checksums of rows with times.
const CHANCE: [&str; 5] = [
    "_sqlx_migrations",
    "catalog_identity",
    "checksum",
    "review_key",
    "worker",
];
/// Files with times and processes.
const NOTES: [&str; 4] = ["empty-import.txt", "owner.json", "run.lock", "run.members"];
/// Names and types of the columns of all tables.
const COLUMNS: &str = "SELECT m.name, c.name FROM sqlite_master m JOIN pragma_table_info(m.name) c WHERE m.type = 'table' \
    AND m.name NOT LIKE 'sqlite_%' ORDER BY m.name, c.cid";

/// The files below a folder by their path, a catalog as the lines of its rows.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct ProjectDump(BTreeMap<PathBuf, Vec<u8>>);

impl ProjectDump {
    /// Reads all projects of a folder.
    pub(crate) fn of(root: &Path) -> Self {
        let all = contents(root).into_iter();
        let counted = all.filter(|(path, _)| is_counted(path));
        let dumped = counted.map(|(path, bytes)| {
            let bytes = if is_catalog(&path) {
                rows(root, &path).into_bytes()
            } else {
                bytes
            };
            (path, bytes)
        });
        Self(dumped.collect())
    }

    /// Fails with the names of the files, and the first rows, that are not those of another dump.
    #[track_caller]
    pub(crate) fn must_equal(&self, other: &Self, what: &str) {
        let paths = self.0.keys().chain(other.0.keys());
        let differ = paths.filter(|path| self.0.get(*path) != other.0.get(*path));
        let differ: BTreeSet<&PathBuf> = differ.collect();
        let rows = [(self, other), (other, self)].map(|(of, without)| {
            let known: BTreeSet<String> = without.lines(&differ).into_iter().collect();
            let lines = of.lines(&differ).into_iter();
            let new = lines.filter(|line| !known.contains(line));
            new.take(3).collect::<Vec<_>>()
        });
        assert!(differ.is_empty(), "{what}: {differ:?} differ: {rows:#?}");
    }

    /// Returns the rows of some of the catalogs.
    fn lines(&self, paths: &BTreeSet<&PathBuf>) -> Vec<String> {
        let catalogs = paths.iter().filter(|path| is_catalog(path));
        let found = catalogs.filter_map(|path| self.0.get(*path));
        let texts = found.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        let lines = texts.map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>());
        lines.flatten().collect()
    }
}

fn is_catalog(path: &Path) -> bool {
    path.extension() == Some(OsStr::new("sqlite"))
}

/// Returns whether a file must be the same after a kill. A killed process leaves hidden files.
fn is_counted(path: &Path) -> bool {
    let mut names = path.iter().map(OsStr::to_string_lossy);
    let is_hidden = names.any(|name| name.starts_with('.'));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let is_log = name.ends_with("-wal") || name.ends_with("-shm");
    !is_hidden && !is_log && !NOTES.contains(&&*name)
}

/// Returns the rows of a catalog below a folder as sorted lines, without the path of the folder.
fn rows(root: &Path, catalog: &Path) -> String {
    let options = SqliteConnectOptions::new().filename(root.join(catalog));
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let mut lines = runtime.block_on(async {
        let mut conn = options.connect().await.expect("a connection");
        let columns = sqlx::query_as::<_, (String, String)>(COLUMNS);
        let columns = columns.fetch_all(&mut conn).await.expect("columns");
        let mut tables: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut lines = Vec::new();
        for (table, column) in columns {
            let is_order = (table.as_str(), column.as_str()) == CLAIMS;
            if !is_order && !CHANCE.contains(&table.as_str()) && !TIMES.contains(&column.as_str()) {
                let values = tables.entry(table).or_default();
                values.push(format!("quote(\"{column}\")"));
            }
        }
        for (table, values) in tables {
            let values = values.join(" || ', ' || ");
            let select = AssertSqlSafe(format!("SELECT {values} FROM \"{table}\""));
            let found = sqlx::query_scalar::<_, String>(select);
            let found = found.fetch_all(&mut conn).await.expect("rows");
            lines.extend(found.iter().map(|row| format!("{table}: {row}")));
        }
        conn.close().await.expect("closed");
        lines
    });
    lines.sort();
    let root = root.to_string_lossy();
    lines.join("\n").replace(&*root, "")
}
