//! Errors of the catalog.

use std::path::PathBuf;

use sqlx::postgres::PgDatabaseError;

use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::{PairName, ThresholdMetric, UnixMillis};

/// An error of the catalog.
#[derive(Debug, thiserror::Error)]
pub enum CatalogError {
    /// There is no catalog file.
    #[error("no catalog at {0}")]
    Missing(PathBuf),
    /// The path is a directory.
    #[error("{0} is a directory where the catalog should be a file; rename it")]
    IsDirectory(PathBuf),
    /// The file is empty.
    #[error(
        "{0} is empty (0 bytes), so it holds no pairs; replace it with a backup, or import the pairs again"
    )]
    Empty(PathBuf),
    /// The file is not a catalog.
    #[error(
        "{path} is not a catalog but {reason}; rename it, and restore a backup if there is one"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is.
        reason: String,
    },
    /// The file was written by another version of the program.
    #[error(
        "{path} was written by another version of this program (schema {found}, this one reads only {known}); open it with that version"
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// Version of its schema.
        found: i64,
        /// Version of this program's schema.
        known: i64,
    },
    /// Another program added something to the schema, or changed it.
    #[error(
        "{path} is not written to, because its schema was changed, so that a write could change other rows: {what}; if somebody sent you this file, do not use it, otherwise restore a backup"
    )]
    ForeignSchema {
        /// The file.
        path: PathBuf,
        /// What was added or changed.
        what: String,
    },
    /// The file is corrupt.
    #[error(
        "{0} is damaged: part of it was overwritten, or the disk cannot read it; `check` reports how much can be read, and a backup can replace it"
    )]
    Damaged(PathBuf),
    /// The disk failed to read part of the file.
    #[error(
        "{0}: the disk reported an error for part of it, so it cannot be checked; check the disk and try again"
    )]
    Unread(PathBuf),
    /// The file cannot be created.
    #[error(
        "{0} cannot be created: its folder is read-only, or the disk is full or reported an error"
    )]
    NotCreated(PathBuf),
    /// There is a write-ahead log or journal, but no catalog.
    #[error(
        "{0} holds changes of a catalog that is not there; put that catalog back, or move this file away if the catalog was removed on purpose"
    )]
    LogAlone(PathBuf),
    /// The file or its directory is read-only.
    #[error(
        "{0} cannot be written to; commands that only read still work, such as status, show, report, check, export -o and backup, other commands need a writable copy"
    )]
    NotWritable(PathBuf),
    /// The write-ahead log was not checkpointed, and cannot be here.
    #[error(
        "{0} holds changes that are not in the catalog yet, and the folder is read-only; copy the project to a writable folder"
    )]
    NotCheckpointed(PathBuf),
    /// Another program deleted, replaced or cut the write-ahead log while the catalog was open.
    #[error("{log} was deleted, replaced or cut short by another program")]
    LogLost {
        /// The log.
        log: PathBuf,
        /// What may be missing in the catalog.
        loss: LogLoss,
    },
    /// The directory is on a network file system.
    #[error(
        "{path} is on a network file system ({kind}), where the catalog could be damaged: its write-ahead log is shared through memory; put the project on a local disk, its meshes and prints may stay where they are"
    )]
    NetworkFileSystem {
        /// The directory.
        path: PathBuf,
        /// Name of the file system.
        kind: &'static str,
    },
    /// An address of a PostgreSQL catalog that cannot be used.
    #[error("{0}")]
    CatalogUrl(String),
    /// The PostgreSQL server cannot be reached, or refuses the connection.
    #[error("cannot connect to {address}: {reason}")]
    NotConnected {
        /// The address without the password.
        address: String,
        /// Why, with what to do.
        reason: String,
        /// Whether the server may answer later.
        is_unavailable: bool,
    },
    /// A connection pooler changes the server process between transactions.
    #[error(
        "{0} leads to a connection pooler such as PgBouncer that pools by transaction, so settings of a connection would be lost; set pool_mode = session there, or connect to PostgreSQL directly"
    )]
    TransactionPooler(String),
    /// The database has no catalog.
    #[error("there is no catalog at {0}; `mocban import` creates it")]
    NoSchema(String),
    /// The user of the database, as written in SQL, may not create the roles.
    #[error(
        "the database user {0} may not create roles; ask the administrator for `ALTER ROLE {0} CREATEROLE`, or to run the SQL that `mocban db init --roles --print-sql` prints"
    )]
    MayNotCreateRoles(String),
    /// The user of the database, as written in SQL, may not review.
    #[error(
        "the database user {0} may look at this catalog, but not judge or undo; ask the administrator for `GRANT mocban_reviewer TO {0}`"
    )]
    MayNotReview(String),
    /// The user of the database may not store verdicts under another name.
    #[error(
        "the database user {user} stores verdicts only under the name {user}, not {reviewer}; give `--reviewer {}`",
        shell_quoted(.user)
    )]
    OtherReviewer {
        /// The user of the database.
        user: String,
        /// The name under which the verdicts should be stored.
        reviewer: String,
    },
    /// The target of a copy holds another catalog.
    #[error("{0} holds another catalog, so nothing was copied; name a target without a catalog")]
    NotEmpty(PathBuf),
    /// The target of a copy is the original.
    #[error("{0} is the catalog to copy itself, so nothing was copied; name another target")]
    SameCatalog(PathBuf),
    /// The target of a copy is a finished copy, and one of both catalogs has changed.
    #[error(
        "{target} is a finished copy of this catalog, but the table {table} differs ({original_rows} rows in the original, {copy_rows} in the copy), because one of them was used since; nothing was written, so both are as they were: go on with one of them, or name a target without a catalog for another copy"
    )]
    FinishedCopy {
        /// The target.
        target: PathBuf,
        /// The first table that differs.
        table: &'static str,
        /// Number of its rows in the original.
        original_rows: u64,
        /// Number of its rows in the copy.
        copy_rows: u64,
    },
    /// A table that was copied differs from the original.
    #[error(
        "the database of the copy returned other rows of the table {0} than it was given, so the copy was given up and nothing is left of it; `check` tells whether the original is sound"
    )]
    CopyDiffers(&'static str),
    /// An error of the catalog that is copied, not of the copy.
    #[error("{0}")]
    Original(Box<CatalogError>),
    /// A path that is not UTF-8.
    #[error("path {0:?} is not UTF-8")]
    NotUtf8(PathBuf),
    /// The rows of an import ended early.
    #[error("the list was not read to its end, so nothing was imported")]
    CutShort,
    /// A new pair or block whose name differs from a known one only in upper and lower case.
    #[error(
        "{kind} {new} differs from {kind} {known} only in upper and lower case, so their files would be one on Windows and macOS; nothing was imported, rename one of them"
    )]
    SimilarName {
        /// `pair` or `block`.
        kind: &'static str,
        /// The new name.
        new: String,
        /// The known name.
        known: String,
    },
    /// Most known pairs or blocks of an import would get other files.
    #[error(
        "{changed} of the {known} {kind} in it that the project has would get another {files}, such as {example}: their ids may be those of others; nothing was imported, give other ids (of folders, import the one above, so that ids begin with the name of the folder); add --allow-changed-files if the files have moved"
    )]
    ChangedFiles {
        /// Number of pairs or blocks that would get other files.
        changed: u64,
        /// Number of pairs or blocks in the list that are known.
        known: u64,
        /// `pairs` or `blocks`.
        kind: &'static str,
        /// Which files.
        files: &'static str,
        /// Name of one of them.
        example: String,
    },
    /// A new pair with the files of a known one, whose name differs only in leading zeros.
    #[error(
        "pair {new} has the mesh and the print of pair {known}, so a spreadsheet may have dropped the zeros of its id; nothing was imported, write the id as {known}"
    )]
    SameFiles {
        /// The new name.
        new: PairName,
        /// The known name.
        known: PairName,
    },
    /// A pragma did not take effect.
    #[error("the database set {name} to {found}, not {wanted}")]
    Pragma {
        /// Which setting.
        name: &'static str,
        /// The wanted value.
        wanted: &'static str,
        /// The actual value.
        found: String,
    },
    /// An unknown pair.
    #[error("there is no pair {0}")]
    UnknownPair(PairName),
    /// A verdict on a pair that has no result yet.
    #[error("pair {0} has no result to judge yet")]
    NoResult(PairName),
    /// A verdict on a metric that has no result.
    #[error("pair {0} has no result of {1} to judge yet")]
    NoMetricResult(PairName, ThresholdMetric),
    /// No verdict is left to undo, of a reviewer or of anyone.
    #[error("there is no verdict{} to undo", .0.as_ref().map_or_else(String::new, |reviewer| format!(" by {reviewer}")))]
    NothingToUndo(Option<String>),
    /// The counters do not add up to the number of jobs.
    #[error("the counters add up to {counted} jobs, but there are {jobs}")]
    WrongCounters {
        /// Sum of the counters.
        counted: u64,
        /// Number of jobs.
        jobs: u64,
    },
    /// A stored value that is not allowed.
    #[error("invalid value in the catalog: {0}")]
    Corrupt(String),
    /// A write through a read-only catalog.
    #[error("the catalog was opened read-only")]
    ReadOnly,
    /// An error shared by the callers of one commit.
    #[error("{0}")]
    Shared(std::sync::Arc<CatalogError>),
    /// The writer task has ended.
    #[error("the catalog is closed")]
    Closed,
    /// An error of the database.
    #[error("catalog: {}", database_message(.0))]
    Database(sqlx::Error),
    /// The schema could not be created.
    #[error("catalog schema: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A stored value that is not JSON of its type.
    #[error("catalog value: {0}")]
    Json(#[from] serde_json::Error),
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// What may be missing in the catalog after its write-ahead log was deleted, replaced or cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogLoss {
    /// Nothing: all commits are in the catalog's main file.
    Nothing,
    /// Commits after this time.
    Since(UnixMillis),
}

/// Returns the text of an error. That of PostgreSQL is without the line of its own source file.
fn database_message(error: &sqlx::Error) -> String {
    let server = error
        .as_database_error()
        .and_then(|error| error.try_downcast_ref::<PgDatabaseError>());
    server.map_or_else(|| error.to_string(), |error| error.message().to_owned())
}

impl From<sqlx::Error> for CatalogError {
    fn from(error: sqlx::Error) -> Self {
        match error {
            sqlx::Error::ColumnDecode { index, source } => {
                Self::Corrupt(format!("column {index}: {source}"))
            }
            error => Self::Database(error),
        }
    }
}

impl CatalogError {
    /// Returns what may be missing if the write-ahead log was deleted, replaced or cut. Otherwise returns `None`.
    pub fn log_loss(&self) -> Option<LogLoss> {
        match self {
            Self::LogLost { loss, .. } => Some(*loss),
            Self::Shared(error) => error.log_loss(),
            _ => None,
        }
    }

    /// Marks an error of the catalog that is copied.
    pub(crate) fn of_original(self) -> Self {
        Self::Original(Box::new(self))
    }

    /// Names the pair whose row holds an invalid value.
    pub(crate) fn in_pair(self, pair: i64) -> Self {
        match self {
            Self::Corrupt(what) => Self::Corrupt(format!("row {pair} of the pairs: {what}")),
            Self::Json(what) => Self::Corrupt(format!("row {pair} of the pairs: {what}")),
            error => error,
        }
    }
}

/// Result of a catalog call.
pub type Result<T, E = CatalogError> = std::result::Result<T, E>;

#[cfg(test)]
mod tests {
    use super::CatalogError;

    #[test]
    fn names_in_commands_are_quoted_for_a_shell() {
        let error = CatalogError::OtherReviewer {
            user: "Lê Lan".to_owned(),
            reviewer: "minh".to_owned(),
        };
        let text = error.to_string();
        assert!(text.ends_with("give `--reviewer 'Lê Lan'`"), "{text}");
    }
}
