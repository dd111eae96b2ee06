//! The open catalog: its read connections and its channel to the writer task.

use std::path::Path;
use std::sync::Arc;

use sqlx::SqlitePool;
use tokio::sync::{mpsc, oneshot};

use crate::catalog::db::commit_delay::CommitDelay;
use crate::catalog::db::conn::{Conn, Held};
use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::open;
use crate::catalog::db::request::{Message, Reply};
use crate::catalog::db::write_connection::{Work, WriteConnection};
use crate::catalog::db::writer;

/// Capacity of the writer's channel.
const INBOX: usize = 1024;

/// An open catalog. Clones share the connections.
#[derive(Debug, Clone)]
pub struct Catalog {
    reader_pool: SqlitePool,
    /// `None` for a read-only catalog.
    inbox: Option<mpsc::Sender<Message>>,
    pub(crate) delay: Arc<CommitDelay>,
    pub(crate) path: Arc<Path>,
}

impl Catalog {
    /// Opens an existing catalog for reading and writing.
    ///
    /// # Errors
    /// Returns an error if the file is missing, is not a catalog, is on a network file system, or the database fails.
    pub async fn open(path: &Path) -> Result<Self> {
        Self::with_writer(path, false, CommitDelay::new()).await
    }

    /// Opens an existing catalog read-only. This works even while a run is active.
    ///
    /// # Errors
    /// Returns an error if the file does not exist or is not a catalog, or if a database operation fails.
    pub async fn open_read_only(path: &Path) -> Result<Self> {
        Ok(Self {
            reader_pool: open::reader_pool(path).await?,
            inbox: None,
            delay: CommitDelay::new(),
            path: path.into(),
        })
    }

    /// Opens an existing file. If `allow_empty` is set, the file may have no bytes.
    pub(crate) async fn with_writer(
        path: &Path,
        allow_empty: bool,
        delay: Arc<CommitDelay>,
    ) -> Result<Self> {
        let conn = open::write_conn(path, allow_empty).await?;
        let reader_pool = open::reader_pool(path).await?;
        let (sender, inbox) = mpsc::channel(INBOX);
        let path: Arc<Path> = path.into();
        let writer = WriteConnection::new(Conn::Sqlite(Held::Owned(conn)), Arc::clone(&path));
        let writer = writer::run(writer, inbox, Arc::clone(&delay));
        tokio::spawn(writer);
        Ok(Self {
            reader_pool,
            inbox: Some(sender),
            delay,
            path,
        })
    }

    /// Closes the catalog. The writer task first handles all earlier requests and checkpoints the write-ahead log.
    pub async fn close(self) {
        // Readers first: an open reader prevents a complete checkpoint.
        self.reader_pool.close().await;
        if let Some(inbox) = self.inbox {
            let (sender, receiver) = oneshot::channel();
            if inbox.send(Message::Close(sender)).await.is_ok() {
                // An error means that the writer has already ended.
                let _ = receiver.await;
            }
        }
    }

    /// Sends the writer a message.
    pub(crate) async fn send(&self, message: Message) -> Result<()> {
        let inbox = self.inbox.as_ref().ok_or(CatalogError::ReadOnly)?;
        let sent = inbox.send(message).await;
        sent.or(Err(CatalogError::Closed))
    }

    /// Sends the writer a message and waits for the reply.
    pub(crate) async fn reply_to<T>(&self, message: impl FnOnce(Reply<T>) -> Message) -> Result<T> {
        let (sender, receiver) = oneshot::channel();
        self.send(message(sender)).await?;
        receiver.await.unwrap_or(Err(CatalogError::Closed))
    }

    pub(crate) async fn read_conn(&self) -> Result<Conn> {
        Ok(Conn::Sqlite(Held::Pooled(
            self.reader_pool.acquire().await?,
        )))
    }

    /// Begins a read transaction, which sees the catalog as of one moment.
    pub(crate) async fn snapshot(&self) -> Result<Conn> {
        Ok(Conn::Sqlite(Held::Snapshot(
            self.reader_pool.begin().await?,
        )))
    }

    /// Runs `work` in a separate write transaction on the writer task.
    pub(crate) async fn in_transaction<T: Send + 'static>(
        &self,
        work: impl for<'c> FnOnce(&'c mut Conn) -> Work<'c, Result<T>> + Send + 'static,
    ) -> Result<T> {
        self.reply_to(|reply| {
            Message::Transaction(Box::new(move |writer| {
                Box::pin(async move {
                    let _ = reply.send(writer.run_transaction(work).await);
                })
            }))
        })
        .await
    }
}
