//! The open catalog: its connections and the way to the writer task.

use std::path::Path;
use std::sync::Arc;

use sqlx::pool::PoolConnection;
use sqlx::{Sqlite, SqliteConnection, SqlitePool, Transaction};
use tokio::sync::{mpsc, oneshot};

use crate::catalog::db::commit_delay::CommitDelay;
use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::open;
use crate::catalog::db::writer::{self, Message, Work};

/// Requests that may wait for the writer before senders do.
const INBOX: usize = 1024;

/// A catalog, open. Clones share the connections.
#[derive(Debug, Clone)]
pub struct Catalog {
    reader_pool: SqlitePool,
    /// `None` when opened to read only.
    inbox: Option<mpsc::Sender<Message>>,
    pub(crate) delay: Arc<CommitDelay>,
    pub(crate) path: Arc<Path>,
}

impl Catalog {
    /// Opens the catalog file, making it where there is none.
    ///
    /// # Errors
    /// When it is no catalog, the disk is a network's, or the database refuses.
    pub async fn create(path: &Path) -> Result<Self> {
        Self::with_writer(path, true, CommitDelay::new()).await
    }

    /// Opens a catalog that is there, to read and write.
    ///
    /// # Errors
    /// When there is none, it is no catalog, the disk is a network's, or the database refuses.
    pub async fn open(path: &Path) -> Result<Self> {
        Self::with_writer(path, false, CommitDelay::new()).await
    }

    /// Opens a catalog to read; works while a run goes on.
    ///
    /// # Errors
    /// When there is none or it is no catalog.
    pub async fn open_read_only(path: &Path) -> Result<Self> {
        Ok(Self {
            reader_pool: open::reader_pool(path).await?,
            inbox: None,
            delay: CommitDelay::new(),
            path: path.into(),
        })
    }

    pub(crate) async fn with_writer(
        path: &Path,
        create: bool,
        delay: Arc<CommitDelay>,
    ) -> Result<Self> {
        let conn = open::write_conn(path, create).await?;
        let reader_pool = open::reader_pool(path).await?;
        let (sender, inbox) = mpsc::channel(INBOX);
        let path: Arc<Path> = path.into();
        let commits_with = Arc::clone(&delay);
        tokio::spawn(writer::run(conn, Arc::clone(&path), inbox, commits_with));
        Ok(Self {
            reader_pool,
            inbox: Some(sender),
            delay,
            path,
        })
    }

    /// Waits until everything sent is stored, folds the log back and closes the connections.
    pub async fn close(self) {
        // Readers first: an open reader keeps the log from being folded back whole.
        self.reader_pool.close().await;
        if let Some(inbox) = self.inbox {
            let (sender, receiver) = oneshot::channel();
            if inbox.send(Message::Close(sender)).await.is_ok() {
                // An error means the writer has ended already, which is what we wait for.
                let _ = receiver.await;
            }
        }
    }

    pub(crate) fn writer(&self) -> Result<&mpsc::Sender<Message>> {
        self.inbox.as_ref().ok_or(CatalogError::ReadOnly)
    }

    /// Sends the writer a message.
    pub(crate) async fn send(&self, message: Message) -> Result<()> {
        let sent = self.writer()?.send(message).await;
        sent.or(Err(CatalogError::Closed))
    }

    pub(crate) async fn read_conn(&self) -> Result<PoolConnection<Sqlite>> {
        Ok(self.reader_pool.acquire().await?)
    }

    /// A read transaction: everything read in it is of one moment.
    pub(crate) async fn snapshot(&self) -> Result<Transaction<'static, Sqlite>> {
        Ok(self.reader_pool.begin().await?)
    }

    /// Runs `work` in its own write transaction.
    pub(crate) async fn in_transaction<T: Send + 'static>(
        &self,
        work: impl for<'c> FnOnce(&'c mut SqliteConnection) -> Work<'c, Result<T>> + Send + 'static,
    ) -> Result<T> {
        writer::in_transaction(self.writer()?, &self.path, work).await
    }
}
