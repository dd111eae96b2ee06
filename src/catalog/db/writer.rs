//! The writer task, which commits pending requests together and replies after the commit.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use sqlx::{Connection as _, SqliteConnection};
use tokio::sync::mpsc;

use crate::catalog::db::batch_collector::collect;
use crate::catalog::db::busy_retry::retry_while_busy;
use crate::catalog::db::commit_delay::CommitDelay;
use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::error_kind::CatalogErrorKind;
use crate::catalog::db::group_commit::{Batch, BatchReply};
use crate::catalog::db::log_watch::LogWatch;
use crate::catalog::db::request::{Message, Work};

/// Number of commits, with about 4 MiB of log, after which the log is checkpointed even if requests are pending.
const COMMITS_PER_CHECKPOINT: u32 = 128;
/// Idle time after which the write-ahead log is checkpointed.
const IDLE: Duration = Duration::from_millis(250);

/// The write connection, and the log that its commits go to.
pub(crate) struct WriteConnection {
    conn: SqliteConnection,
    path: Arc<Path>,
    log: LogWatch,
}

impl WriteConnection {
    pub(crate) fn new(conn: SqliteConnection, path: Arc<Path>) -> Self {
        let log = LogWatch::new(&path);
        Self { conn, path, log }
    }

    /// Commits a batch and replies to its requests. If the database file causes the error, such as a lock or a full
    /// disk, all requests fail. After any other error, each request is committed on its own, so that only the invalid
    /// ones fail.
    async fn commit(&mut self, batch: Batch) {
        match self.apply(&batch).await {
            Ok(answers) => batch.answer(answers),
            Err(error) if batch.len() == 1 || self.log.is_lost() || is_of_the_file(&error) => {
                batch.refuse(&Arc::new(error));
            }
            Err(_) => {
                for single in batch.split() {
                    match self.apply(&single).await {
                        Ok(answers) => single.answer(answers),
                        Err(error) => single.refuse(&Arc::new(error)),
                    }
                }
            }
        }
    }

    async fn apply(&mut self, batch: &Batch) -> Result<BatchReply> {
        let Self { conn, path, log } = self;
        log.check(conn).await?;
        let reply = retry_while_busy!(path, {
            let outcome = batch.apply(conn).await;
            if outcome.is_err() {
                rollback(conn).await;
            }
            outcome
        });
        log.check(conn).await?;
        reply
    }

    /// Runs `work` in a separate transaction. Rolls it back if `work` or the commit fails.
    pub(crate) async fn run_transaction<T>(
        &mut self,
        work: impl for<'c> FnOnce(&'c mut SqliteConnection) -> Work<'c, Result<T>>,
    ) -> Result<T> {
        let Self { conn, path, log } = self;
        log.check(conn).await?;
        retry_while_busy!(path, execute(conn, "BEGIN IMMEDIATE").await)?;
        let mut outcome = work(&mut *conn).await;
        if outcome.is_ok()
            && let Err(error) = execute(conn, "COMMIT").await
        {
            outcome = Err(error);
        }
        if outcome.is_err() {
            rollback(conn).await;
        }
        log.check(conn).await?;
        outcome
    }

    async fn checkpoint_log(&mut self, pragma: &'static str) {
        self.log.checkpoint(&mut self.conn, pragma).await;
    }

    /// Checkpoints the log and closes the connection.
    async fn close(mut self) {
        self.checkpoint_log("PRAGMA wal_checkpoint(TRUNCATE)").await;
        if self.log.is_lost() {
            // Closing would copy pages of the damaged log to the catalog. The end of the process does not.
            std::mem::forget(self.conn);
        } else if let Err(error) = self.conn.close().await {
            tracing::warn!(%error, "the catalog did not close cleanly");
        }
    }
}

/// Runs the writer until `Close`, or until no sender is left.
pub(crate) async fn run(
    mut writer: WriteConnection,
    mut inbox: mpsc::Receiver<Message>,
    delay: Arc<CommitDelay>,
) {
    let mut commits = 0_u32;
    let closing = loop {
        let message = if commits == 0 {
            inbox.recv().await
        } else {
            let Ok(message) = tokio::time::timeout(IDLE, inbox.recv()).await else {
                writer.checkpoint_log("PRAGMA wal_checkpoint(PASSIVE)").await;
                commits = 0;
                continue;
            };
            message
        };
        match message {
            None => break None,
            Some(Message::Close(done)) => break Some(done),
            Some(Message::Transaction(work)) => work(&mut writer).await,
            // Everything sent before it is stored already.
            Some(Message::Flush) => continue,
            Some(first @ (Message::Grouped(_) | Message::Deferrable(_))) => {
                let (batch, after) = collect(first, &delay, &mut inbox).await;
                writer.commit(batch).await;
                match after {
                    Some(Message::Close(done)) => break Some(done),
                    Some(Message::Transaction(work)) => work(&mut writer).await,
                    Some(Message::Grouped(_) | Message::Deferrable(_) | Message::Flush) | None => {}
                }
            }
        }
        commits += 1;
        if commits >= COMMITS_PER_CHECKPOINT {
            writer.checkpoint_log("PRAGMA wal_checkpoint(PASSIVE)").await;
            commits = 0;
        }
    };
    writer.close().await;
    if let Some(done) = closing {
        // The caller may have stopped waiting.
        let _ = done.send(());
    }
}

/// Returns whether an error concerns the file rather than a request.
fn is_of_the_file(error: &CatalogError) -> bool {
    use CatalogErrorKind::{Contradiction, Statement};
    let kind = error.kind();
    kind.is_some_and(|kind| !matches!(kind, Contradiction | Statement))
}

/// Rolls the current transaction back.
async fn rollback(conn: &mut SqliteConnection) {
    // SQLite has already rolled back after some errors, such as a full disk.
    if let Err(error) = execute(conn, "ROLLBACK").await {
        tracing::debug!(%error, "nothing to roll back");
    }
}

async fn execute(conn: &mut SqliteConnection, sql: &'static str) -> Result<()> {
    sqlx::query(sql).execute(conn).await?;
    Ok(())
}
