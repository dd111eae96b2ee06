//! The catalog: what is known of every pair, and the queue of work. The only room with SQL.
//!
//! One writer task owns the only write connection and commits in groups; readers have their own connections and
//! work while a run goes on. All times come in as arguments.

mod alignments;
mod alike;
mod answers;
mod audit;
mod batch;
mod census;
mod checkpoint;
mod claim;
mod company;
mod connect;
mod copy;
mod counters;
mod error;
mod fail;
mod gather;
mod holder;
mod lease;
mod look;
mod mend;
mod network;
mod pages;
mod pairs;
mod patience;
mod plan;
mod query;
pub mod read;
mod recipes;
mod requeue;
mod rescue;
mod results;
mod rows;
mod script;
mod staleness;
mod status;
#[cfg(test)]
mod tests;
mod trouble;
mod truth;
mod upkeep;
mod verdicts;
mod work;
mod writer;

use std::path::Path;
use std::sync::Arc;

use sqlx::pool::PoolConnection;
use sqlx::{Sqlite, SqliteConnection, SqlitePool, Transaction};
use tokio::sync::{mpsc, oneshot};

pub use alignments::{HandAlignment, StoredAlignment};
pub use answers::{Answer, AnsweredOn, AttentionCheckAnswer, Shown};
pub use audit::{AuditedPair, AuditedResult, CounterDrift, Drift};
pub use claim::{ClaimRequest, PairSelection};
pub use company::Waiting;
pub use counters::Counts;
pub use error::{CatalogError, Result};
pub use holder::{Holder, holder};
pub use lease::{
    InputSeen, InputsSeen, Kept, Lease, MetricResult, RecipeId, Sentence, StageDone, StageFailed,
};
pub use look::Look;
pub use pages::ResultPages;
pub use pairs::{ImportChunk, ImportRow, ImportSummary, PairChange};
pub use plan::{FieldChange, Plan, PlanEntry, WorkReason};
pub use read::{
    AttemptRecord, FailedPair, MetricRecord, PairDetail, PairFacts, PairResults, ReaderVerdict,
    StageCounts, StageRecord, StatusCounts, StoredFailure,
};
pub use recipes::{Recipe, RecipeIds, Recipes};
pub use requeue::RetrySelection;
pub use rescue::{Dead, LeaseHolder, Rescued};
pub use staleness::Again;
pub use trouble::Trouble;
pub use upkeep::{Outstanding, WorkLeft, WorkerInfo};
pub use verdicts::{NewVerdict, VerdictEvent};
pub use work::{KnownInputs, PairWork};

use company::Company;
use writer::{Message, Work};

/// Requests that may wait for the writer before senders do.
const INBOX: usize = 1024;

/// A catalog, open. Clones share the connections.
#[derive(Debug, Clone)]
pub struct Catalog {
    readers: SqlitePool,
    /// `None` when opened to read only.
    inbox: Option<mpsc::Sender<Message>>,
    company: Arc<Company>,
    path: Arc<Path>,
}

impl Catalog {
    /// Opens the catalog file, making it where there is none.
    ///
    /// # Errors
    /// When it is no catalog, the disk is a network's, or the database refuses.
    pub async fn create(path: &Path) -> Result<Self> {
        Self::with_writer(path, true, Company::new()).await
    }

    /// Opens a catalog that is there, to read and write.
    ///
    /// # Errors
    /// When there is none, it is no catalog, the disk is a network's, or the database refuses.
    pub async fn open(path: &Path) -> Result<Self> {
        Self::with_writer(path, false, Company::new()).await
    }

    /// Opens a catalog to read; works while a run goes on.
    ///
    /// # Errors
    /// When there is none or it is no catalog.
    pub async fn open_read_only(path: &Path) -> Result<Self> {
        Ok(Self {
            readers: connect::readers(path).await?,
            inbox: None,
            company: Company::new(),
            path: path.into(),
        })
    }

    async fn with_writer(path: &Path, create: bool, company: Arc<Company>) -> Result<Self> {
        let conn = connect::writer(path, create).await?;
        let readers = connect::readers(path).await?;
        let (sender, inbox) = mpsc::channel(INBOX);
        let path: Arc<Path> = path.into();
        let commits_with = Arc::clone(&company);
        tokio::spawn(writer::run(conn, Arc::clone(&path), inbox, commits_with));
        Ok(Self {
            readers,
            inbox: Some(sender),
            company,
            path,
        })
    }

    /// Waits until everything sent is stored, folds the log back and closes the connections.
    pub async fn close(self) {
        // Readers first: an open reader keeps the log from being folded back whole.
        self.readers.close().await;
        if let Some(inbox) = self.inbox {
            let (sender, receiver) = oneshot::channel();
            if inbox.send(Message::Close(sender)).await.is_ok() {
                // An error means the writer has ended already, which is what we wait for.
                let _ = receiver.await;
            }
        }
    }

    fn writer(&self) -> Result<&mpsc::Sender<Message>> {
        self.inbox.as_ref().ok_or(CatalogError::ReadOnly)
    }

    async fn reader(&self) -> Result<PoolConnection<Sqlite>> {
        Ok(self.readers.acquire().await?)
    }

    /// A read transaction: everything read in it is of one moment.
    async fn snapshot(&self) -> Result<Transaction<'static, Sqlite>> {
        Ok(self.readers.begin().await?)
    }

    /// Runs `work` in its own write transaction.
    async fn alone<T: Send + 'static>(
        &self,
        work: impl for<'c> FnOnce(&'c mut SqliteConnection) -> Work<'c, Result<T>> + Send + 'static,
    ) -> Result<T> {
        writer::alone(self.writer()?, &self.path, work).await
    }
}
