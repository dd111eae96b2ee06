//! The open catalog: its read connections, its channel to the writer task, and waits for a server that is unavailable.

use std::path::Path;
use std::sync::Arc;

use sqlx::{PgConnection, PgPool, SqlitePool};
use tokio::sync::{mpsc, oneshot};

use crate::db::conn::{Conn, ConnectionKind, Work};
use crate::db::error::{CatalogError, Result};
use crate::db::left_out::LeftOut;
use crate::db::open;
use crate::db::postgres_address::PostgresAddress;
use crate::db::retry_wait::RetryWait;
use crate::queue::commit::group_commit::Reply;
use crate::queue::commit::write_connection::WriteConnection;
use crate::queue::commit::writer::{self, CommitDelay, Message};

/// Capacity of the writer's channel.
const INBOX: usize = 1024;

/// Read connections.
#[derive(Debug, Clone)]
enum ReaderPool {
    Sqlite(SqlitePool),
    Postgres(PgPool),
}

/// An open catalog. Clones share the connections.
#[derive(Debug, Clone)]
pub struct Catalog {
    readers: ReaderPool,
    /// `None` for a read-only catalog.
    inbox: Option<mpsc::Sender<Message>>,
    pub(crate) delay: Arc<CommitDelay>,
    /// Waits while a server is unavailable.
    retry_wait: Arc<RetryWait>,
    /// Rows that reads leave out, because they are damaged.
    pub(crate) left_out: Arc<LeftOut>,
    /// Path of the file, or the URL of a PostgreSQL catalog without the password.
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
        let readers = ReaderPool::Sqlite(open::reader_pool(path).await?);
        Ok(Self::without_writer(readers, path))
    }

    /// Opens a backup read-only, as a file that nobody writes to. Makes no other file beside it.
    ///
    /// # Errors
    /// Returns an error if the file does not exist or is not a catalog, or if a database operation fails.
    pub async fn open_backup(path: &Path) -> Result<Self> {
        let readers = ReaderPool::Sqlite(open::immutable_pool(path).await?);
        Ok(Self::without_writer(readers, path))
    }

    /// Opens an existing file. If `allow_empty` is set, the file may have no bytes.
    pub(crate) async fn with_writer(
        path: &Path,
        allow_empty: bool,
        delay: Arc<CommitDelay>,
    ) -> Result<Self> {
        let conn = open::write_conn(path, allow_empty).await?;
        let readers = ReaderPool::Sqlite(open::reader_pool(path).await?);
        let writer = WriteConnection::new(Conn::Sqlite(ConnectionKind::Owned(conn)), path.into());
        Ok(Self::start(readers, writer, delay, Arc::default()))
    }

    /// Opens the catalog at a URL of PostgreSQL.
    ///
    /// # Errors
    /// Returns an error if the URL is invalid, the server does not answer or refuses the connection, there is no catalog, or
    /// the database fails.
    pub async fn connect(url: &str) -> Result<Self> {
        let address = PostgresAddress::parse(url)?;
        let conn = address.connect().await?;
        Self::on_server(address, conn).await
    }

    /// Opens the catalog at a URL of PostgreSQL. Creates it if it is missing.
    ///
    /// # Errors
    /// As for [`Self::connect`].
    pub async fn connect_or_create(url: &str) -> Result<Self> {
        let address = PostgresAddress::parse(url)?;
        let conn = address.connect_or_create().await?;
        Self::on_server(address, conn).await
    }

    async fn on_server(address: PostgresAddress, conn: PgConnection) -> Result<Self> {
        let readers = ReaderPool::Postgres(address.reader_pool(false).await?);
        let retry_wait: Arc<RetryWait> = Arc::default();
        let writer = WriteConnection::to_server(conn, address, Arc::clone(&retry_wait));
        Ok(Self::start(readers, writer, CommitDelay::new(), retry_wait))
    }

    /// Opens the catalog at a URL of PostgreSQL read-only.
    ///
    /// # Errors
    /// As for [`Self::connect`].
    pub async fn connect_read_only(url: &str) -> Result<Self> {
        let address = PostgresAddress::parse(url)?;
        let readers = ReaderPool::Postgres(address.reader_pool(true).await?);
        Ok(Self::without_writer(readers, Path::new(&address.text())))
    }

    fn without_writer(readers: ReaderPool, path: &Path) -> Self {
        Self {
            readers,
            inbox: None,
            delay: CommitDelay::new(),
            retry_wait: Arc::default(),
            left_out: Arc::default(),
            path: path.into(),
        }
    }

    /// Starts the writer task.
    fn start(
        readers: ReaderPool,
        writer: WriteConnection,
        delay: Arc<CommitDelay>,
        retry_wait: Arc<RetryWait>,
    ) -> Self {
        let (sender, inbox) = mpsc::channel(INBOX);
        let path = Arc::clone(&writer.path);
        tokio::spawn(writer::run(writer, inbox, Arc::clone(&delay)));
        Self {
            readers,
            inbox: Some(sender),
            delay,
            retry_wait,
            left_out: Arc::default(),
            path,
        }
    }

    /// Returns the same catalog, whose reads leave out some rows.
    pub(crate) fn leaving_out(&self, left_out: LeftOut) -> Self {
        Self {
            left_out: Arc::new(left_out),
            ..self.clone()
        }
    }

    /// Returns whether the catalog is on a database server, which several machines can share.
    pub const fn is_shared(&self) -> bool {
        matches!(self.readers, ReaderPool::Postgres(_))
    }

    /// Returns whether the catalog was opened read-only.
    pub const fn is_read_only(&self) -> bool {
        self.inbox.is_none()
    }

    /// Closes the catalog. The writer task first handles all earlier requests and checkpoints the write-ahead log.
    pub async fn close(self) {
        // ReaderPool first: an open reader prevents a complete checkpoint.
        match self.readers {
            ReaderPool::Sqlite(pool) => pool.close().await,
            ReaderPool::Postgres(pool) => {
                let closed = self.retry_wait.limit(async {
                    pool.close().await;
                    Ok(())
                });
                if let Err(error) = closed.await {
                    tracing::debug!(%error, "the connections did not close");
                }
            }
        }
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
        inbox.send(message).await.or(Err(CatalogError::Closed))
    }

    /// Sends the writer a message and waits for the reply.
    pub(crate) async fn reply_to<T>(&self, message: impl FnOnce(Reply<T>) -> Message) -> Result<T> {
        let (sender, receiver) = oneshot::channel();
        self.send(message(sender)).await?;
        receiver.await.unwrap_or(Err(CatalogError::Closed))
    }

    pub(crate) async fn read_conn(&self) -> Result<Conn> {
        Ok(match &self.readers {
            ReaderPool::Sqlite(pool) => Conn::Sqlite(ConnectionKind::Pooled(pool.acquire().await?)),
            ReaderPool::Postgres(pool) => {
                Conn::Postgres(ConnectionKind::Pooled(pool.acquire().await?))
            }
        })
    }

    /// Begins a read transaction, which sees the catalog as of one moment.
    pub(crate) async fn snapshot(&self) -> Result<Conn> {
        Ok(match &self.readers {
            ReaderPool::Sqlite(pool) => Conn::Sqlite(ConnectionKind::Snapshot(pool.begin().await?)),
            ReaderPool::Postgres(pool) => {
                let begin = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY";
                Conn::Postgres(ConnectionKind::Snapshot(pool.begin_with(begin).await?))
            }
        })
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

    /// Calls `operation` again while the database server is unavailable. The operation must be idempotent, because an
    /// earlier call may have been stored although its reply was lost.
    ///
    /// # Errors
    /// Returns the error of the operation. After [`Catalog::stop_waiting`], also returns the error of a server that is
    /// unavailable or does not reply.
    pub async fn retry_while_unavailable<T>(
        &self,
        operation: impl AsyncFn() -> Result<T>,
    ) -> Result<T> {
        let mut attempt = 0;
        loop {
            let outcome = if self.is_shared() {
                self.retry_wait.limit(operation()).await
            } else {
                operation().await
            };
            match outcome {
                Err(error)
                    if error.is_unavailable() && self.retry_wait.wait(attempt, &error).await =>
                {
                    attempt += 1;
                }
                outcome => return outcome,
            }
        }
    }

    /// Returns whether an idempotent operation is to be called again after this error: waits while the database server is
    /// unavailable. For tasks that cannot use [`Catalog::retry_while_unavailable`], because their futures must be `Send`.
    pub async fn may_retry(&self, attempt: u32, error: &CatalogError) -> bool {
        error.is_unavailable() && self.retry_wait.wait(attempt, error).await
    }

    /// Ends all waits for an unavailable database server. Operations then fail while it is unavailable, or after a few
    /// seconds without a reply.
    pub fn stop_waiting(&self) {
        self.retry_wait.stop();
    }
}
