//! What can go wrong with the catalog.

use std::path::PathBuf;

use crate::domain::{PairName, ThresholdMetric};

/// An error of the catalog.
#[derive(Debug, thiserror::Error)]
pub enum CatalogError {
    /// There is no catalog file.
    #[error("no catalog at {0}")]
    Missing(PathBuf),
    /// The file is not a catalog, or of another version of the program.
    #[error("{path} is not a catalog this program can read: {reason}")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it holds instead.
        reason: String,
    },
    /// The directory is on a network file system.
    #[error(
        "{path} is on a network file system ({kind}); the catalog needs a local disk, because its write-ahead log is shared through memory"
    )]
    NetworkFileSystem {
        /// The directory.
        path: PathBuf,
        /// Name of the file system.
        kind: &'static str,
    },
    /// A setting of the database did not take.
    #[error("the database set {name} to {found}, not {wanted}")]
    Pragma {
        /// Which setting.
        name: &'static str,
        /// What was asked for.
        wanted: &'static str,
        /// What it is.
        found: String,
    },
    /// A pair nobody imported.
    #[error("there is no pair {0}")]
    UnknownPair(PairName),
    /// A verdict on a pair that has no result yet.
    #[error("pair {0} has no result to judge yet")]
    NoResult(PairName),
    /// A verdict on a metric that has no result.
    #[error("pair {0} has no result of {1} to judge yet")]
    NoMetricResult(PairName, ThresholdMetric),
    /// Nothing of this reader is left to take back.
    #[error("there is no verdict of {0} to take back")]
    NothingToUndo(String),
    /// A row that breaks the rules of the schema.
    #[error("the catalog holds a row it must not: {0}")]
    Corrupt(String),
    /// A write through a catalog that was opened to read.
    #[error("the catalog was opened to read only")]
    ReadOnly,
    /// An error that several callers of one commit share.
    #[error("{0}")]
    Shared(std::sync::Arc<CatalogError>),
    /// The writer task has ended.
    #[error("the catalog is closed")]
    Closed,
    /// From the database.
    #[error("catalog: {0}")]
    Database(#[from] sqlx::Error),
    /// The schema could not be brought up to date.
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
