//! The catalog: what is known of every pair, and the queue of work. The only room with SQL.
//!
//! One writer task owns the only write connection and commits in groups; readers have their own connections and
//! work while a run goes on. All times come in as arguments.

mod error;
mod pairs;
pub mod read;
mod recipes;
mod staleness;
mod verdicts;

use std::path::Path;

pub use error::{CatalogError, Result};
pub use pairs::{ImportRow, ImportSummary, PairChange};
pub use read::{
    AttemptRecord, FailedPair, MetricRecord, PairDetail, PairFacts, PairResults, ReaderVerdict,
    StageCounts, StageRecord, StatusCounts, StoredFailure,
};
pub use recipes::{Recipe, Recipes};
pub use staleness::{FieldChange, Plan, PlanEntry, WorkReason};
pub use verdicts::{NewVerdict, VerdictEvent};

use crate::domain::{Failure, FailureClass, PairName, UnixMillis};

/// A catalog, open.
#[derive(Debug, Clone)]
pub struct Catalog {}

/// Which failed pairs to take up again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RetrySelection {
    /// These pairs, whatever keeps them.
    Names(Vec<PairName>),
    /// All that failed with this class.
    Class(FailureClass),
    /// All that failed.
    All,
}

impl Catalog {
    /// Opens the catalog file, making it where there is none.
    ///
    /// # Errors
    /// When it is no catalog, the disk is a network's, or the database refuses.
    pub async fn create(path: &Path) -> Result<Self> {
        let _ = path;
        todo!()
    }

    /// Opens a catalog that is there, to read and write.
    ///
    /// # Errors
    /// When there is none, it is no catalog, the disk is a network's, or the database refuses.
    pub async fn open(path: &Path) -> Result<Self> {
        let _ = path;
        todo!()
    }

    /// Opens a catalog to read; works while a run goes on.
    ///
    /// # Errors
    /// When there is none or it is no catalog.
    pub async fn open_read_only(path: &Path) -> Result<Self> {
        let _ = path;
        todo!()
    }

    /// Ends the writer and closes the connections.
    pub async fn close(self) {}

    /// Counts for `status`; `recipes` are the current ones, to tell what is stale.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn status(&self, recipes: &Recipes) -> Result<StatusCounts> {
        let _ = recipes;
        todo!()
    }

    /// Everything about one pair; `None` when there is no such pair.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn pair(&self, name: &PairName) -> Result<Option<PairDetail>> {
        let _ = name;
        todo!()
    }

    /// The next pairs after a name, in the order of names, at most `limit`; empty at the end.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn results_page(
        &self,
        after: Option<&PairName>,
        limit: usize,
    ) -> Result<Vec<PairResults>> {
        let _ = (after, limit);
        todo!()
    }

    /// Failed pairs in the order of names, at most `limit`.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn failures(&self, limit: usize) -> Result<Vec<FailedPair>> {
        let _ = limit;
        todo!()
    }

    /// Failed pairs by class, every class with at least one.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn failure_counts(&self) -> Result<Vec<(FailureClass, u64)>> {
        todo!()
    }

    /// Takes failed pairs up again; says how many.
    ///
    /// # Errors
    /// When a named pair is not there.
    pub async fn retry(&self, selection: &RetrySelection, now: UnixMillis) -> Result<u64> {
        let _ = (selection, now);
        todo!()
    }

    /// Stores true alignments as given, replacing earlier ones; says how many.
    ///
    /// # Errors
    /// When a pair is not there; then nothing is stored.
    pub async fn set_truth(&self, rows: Vec<(PairName, serde_json::Value)>) -> Result<u64> {
        let _ = rows;
        todo!()
    }

    /// Whether any pair has a true alignment.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn has_truth(&self) -> Result<bool> {
        let _: Option<Failure> = None;
        todo!()
    }
}
