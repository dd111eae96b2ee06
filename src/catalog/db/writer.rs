//! The writer task: commits waiting requests together and replies after the commit.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use sqlx::{Connection as _, SqliteConnection};
use tokio::sync::{mpsc, oneshot};

use crate::catalog::db::batch_collector::collect;
use crate::catalog::db::busy_retry::BusyRetry;
use crate::catalog::db::commit_delay::CommitDelay;
use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::error_kind::CatalogErrorKind;
use crate::catalog::db::group_commit::{Batch, BatchReply};
use crate::catalog::db::request::{Message, TransactionTask, Work};

/// Commits after which the write-ahead log is checkpointed even under load; about 4 MiB of log.
const COMMITS_PER_CHECKPOINT: u32 = 128;
/// Idle time after which the write-ahead log is checkpointed.
const IDLE: Duration = Duration::from_millis(250);

/// Runs the writer until `Close`, or until no sender is left.
pub(crate) async fn run(
    mut conn: SqliteConnection,
    path: Arc<Path>,
    mut inbox: mpsc::Receiver<Message>,
    delay: Arc<CommitDelay>,
) {
    let mut commits = 0_u32;
    let closing = loop {
        let message = if commits == 0 {
            inbox.recv().await
        } else {
            let Ok(message) = tokio::time::timeout(IDLE, inbox.recv()).await else {
                wal_checkpoint(&mut conn, "PRAGMA wal_checkpoint(PASSIVE)").await;
                commits = 0;
                continue;
            };
            message
        };
        match message {
            None => break None,
            Some(Message::Close(done)) => break Some(done),
            Some(Message::Transaction(work)) => work(&mut conn).await,
            // Everything sent before it is stored already.
            Some(Message::Flush) => continue,
            Some(first @ (Message::Grouped(_) | Message::Deferrable(_))) => {
                let (batch, after) = collect(first, &delay, &mut inbox).await;
                commit(&mut conn, &path, batch).await;
                match after {
                    Some(Message::Close(done)) => break Some(done),
                    Some(Message::Transaction(work)) => work(&mut conn).await,
                    Some(Message::Grouped(_) | Message::Deferrable(_) | Message::Flush) | None => {}
                }
            }
        }
        commits += 1;
        if commits >= COMMITS_PER_CHECKPOINT {
            wal_checkpoint(&mut conn, "PRAGMA wal_checkpoint(PASSIVE)").await;
            commits = 0;
        }
    };
    wal_checkpoint(&mut conn, "PRAGMA wal_checkpoint(TRUNCATE)").await;
    if let Err(error) = conn.close().await {
        tracing::warn!(%error, "the catalog did not close cleanly");
    }
    if let Some(done) = closing {
        // The caller may have stopped waiting.
        let _ = done.send(());
    }
}

/// Commits a batch and replies. When it fails, each request is tried alone, so that one that cannot be stored does not
/// fail the others; errors of lock or disk fail them all.
async fn commit(conn: &mut SqliteConnection, path: &Path, batch: Batch) {
    match attempt(conn, path, &batch).await {
        Ok(answers) => batch.answer(answers),
        Err(error) if batch.len() == 1 || is_of_the_file(&error) => {
            batch.refuse(&Arc::new(error));
        }
        Err(_) => {
            for single in batch.split() {
                match attempt(conn, path, &single).await {
                    Ok(answers) => single.answer(answers),
                    Err(error) => single.refuse(&Arc::new(error)),
                }
            }
        }
    }
}

/// Returns whether an error concerns the file rather than a request.
fn is_of_the_file(error: &CatalogError) -> bool {
    let trouble = error.kind();
    trouble.is_some_and(|trouble| trouble != CatalogErrorKind::Contradiction)
}

async fn attempt(conn: &mut SqliteConnection, path: &Path, batch: &Batch) -> Result<BatchReply> {
    let mut retry = BusyRetry::begin(path);
    loop {
        let outcome = batch.apply(conn).await;
        if outcome.is_err() {
            rollback(conn).await;
        }
        match retry.wait(&outcome) {
            Some(moment) => moment.await,
            None => return outcome,
        }
    }
}

/// Begins a write transaction, as soon as no other process has one.
async fn begin(conn: &mut SqliteConnection, path: &Path) -> Result<()> {
    let mut retry = BusyRetry::begin(path);
    loop {
        let begun = sqlx::query("BEGIN IMMEDIATE").execute(&mut *conn).await;
        let outcome = begun.map(|_| ()).map_err(CatalogError::from);
        match retry.wait(&outcome) {
            Some(moment) => moment.await,
            None => return outcome,
        }
    }
}

/// Commits after success and rolls back after an error.
async fn end<T>(conn: &mut SqliteConnection, outcome: Result<T>) -> Result<T> {
    let outcome = match outcome {
        Ok(value) => match sqlx::query("COMMIT").execute(&mut *conn).await {
            Ok(_) => return Ok(value),
            Err(error) => Err(error.into()),
        },
        failed => failed,
    };
    rollback(conn).await;
    outcome
}

/// Rolls the current transaction back.
async fn rollback(conn: &mut SqliteConnection) {
    // SQLite has already rolled back after some errors, such as a full disk.
    if let Err(error) = sqlx::query("ROLLBACK").execute(conn).await {
        tracing::debug!(%error, "nothing to roll back");
    }
}

async fn wal_checkpoint(conn: &mut SqliteConnection, pragma: &'static str) {
    // A reader may block it; the next checkpoint tries again.
    if let Err(error) = sqlx::query(pragma).execute(conn).await {
        tracing::debug!(%error, "the write-ahead log was not folded back");
    }
}

/// Runs `work` in its own transaction on the writer task.
pub(crate) async fn in_transaction<T: Send + 'static>(
    inbox: &mpsc::Sender<Message>,
    path: &Arc<Path>,
    work: impl for<'c> FnOnce(&'c mut SqliteConnection) -> Work<'c, Result<T>> + Send + 'static,
) -> Result<T> {
    let (sender, receiver) = oneshot::channel();
    let path = Arc::clone(path);
    let task: TransactionTask = Box::new(move |conn| {
        Box::pin(async move {
            let _ = sender.send(run_transaction(conn, &path, work).await);
        })
    });
    if inbox.send(Message::Transaction(task)).await.is_err() {
        return Err(CatalogError::Closed);
    }
    receiver.await.unwrap_or(Err(CatalogError::Closed))
}

async fn run_transaction<T>(
    conn: &mut SqliteConnection,
    path: &Path,
    work: impl for<'c> FnOnce(&'c mut SqliteConnection) -> Work<'c, Result<T>>,
) -> Result<T> {
    begin(conn, path).await?;
    let outcome = work(&mut *conn).await;
    end(conn, outcome).await
}
