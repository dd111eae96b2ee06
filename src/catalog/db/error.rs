//! Errors of the catalog.

use std::path::PathBuf;

use crate::domain::{PairName, ThresholdMetric};

/// An error of the catalog.
#[derive(Debug, thiserror::Error)]
pub enum CatalogError {
    /// There is no catalog file.
    #[error("no catalog at {0}")]
    Missing(PathBuf),
    /// The path is a directory.
    #[error("{0} is a directory where the catalog should be a file; move it away")]
    IsDirectory(PathBuf),
    /// The file is empty.
    #[error(
        "{0} is empty (0 bytes), so nothing is known of this project; put a backup in its place, or import its pairs again"
    )]
    Empty(PathBuf),
    /// The file is not a catalog.
    #[error(
        "{path} is not a catalog but {reason}; move it away, and put a backup in its place if there is one"
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
    /// The file is corrupt.
    #[error(
        "{0} is damaged: some of it is not what the database wrote, or the disk cannot read it; `check` tells how far it can be read, and a backup can take its place"
    )]
    Damaged(PathBuf),
    /// The disk failed to read part of the file.
    #[error(
        "{0}: the disk refused to read some of it, so it is not known whether it is whole; look after the disk and call again"
    )]
    Unread(PathBuf),
    /// The file cannot be created.
    #[error("{0} cannot be made: its folder takes no new file, or the disk refuses")]
    NotMade(PathBuf),
    /// The file or its directory is read-only.
    #[error(
        "{0} cannot be written to; status, show, report and export work here, all else needs a copy that can be written"
    )]
    NotWritable(PathBuf),
    /// The write-ahead log was not checkpointed, and cannot be here.
    #[error(
        "{0} holds changes that are not in the catalog yet, and nothing can be written here; copy the project to where it can be written"
    )]
    UnfoldedLog(PathBuf),
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
    /// A path that is not UTF-8.
    #[error("path {0:?} is not UTF-8")]
    NotUtf8(PathBuf),
    /// The rows of an import ended early.
    #[error("the list was not read to its end, nothing was imported")]
    CutShort,
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
    /// The reviewer has no verdict left to undo.
    #[error("there is no verdict of {0} to take back")]
    NothingToUndo(String),
    /// The counters do not add up to the number of jobs.
    #[error("the counters add up to {counted} jobs, but there are {jobs}")]
    WrongCounters {
        /// Sum of the counters.
        counted: u64,
        /// Number of jobs.
        jobs: u64,
    },
    /// A row that violates the schema's rules.
    #[error("the catalog holds a row it must not: {0}")]
    Corrupt(String),
    /// A write through a read-only catalog.
    #[error("the catalog was opened to read only")]
    ReadOnly,
    /// An error shared by the callers of one commit.
    #[error("{0}")]
    Shared(std::sync::Arc<CatalogError>),
    /// The writer task has ended.
    #[error("the catalog is closed")]
    Closed,
    /// An error of SQLite.
    #[error("catalog: {0}")]
    Database(#[from] sqlx::Error),
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

/// Result of a catalog call.
pub type Result<T, E = CatalogError> = std::result::Result<T, E>;
