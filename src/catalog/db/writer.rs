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
use crate::catalog::db::request::{Message, Work};

/// Number of commits, with about 4 MiB of log, after which the log is checkpointed even if requests are pending.
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

/// Commits a batch and replies to its requests. If the database file causes the error, such as a lock or a full disk,
/// all requests fail. After any other error, each request is committed on its own, so that only the invalid ones fail.
async fn commit(conn: &mut SqliteConnection, path: &Path, batch: Batch) {
    match apply(conn, path, &batch).await {
        Ok(answers) => batch.answer(answers),
        Err(error) if batch.len() == 1 || is_of_the_file(&error) => {
            batch.refuse(&Arc::new(error));
        }
        Err(_) => {
            for single in batch.split() {
                match apply(conn, path, &single).await {
                    Ok(answers) => single.answer(answers),
                    Err(error) => single.refuse(&Arc::new(error)),
                }
            }
        }
    }
}

/// Returns whether an error concerns the file rather than a request.
fn is_of_the_file(error: &CatalogError) -> bool {
    use CatalogErrorKind::{Contradiction, Statement};
    let kind = error.kind();
    kind.is_some_and(|kind| !matches!(kind, Contradiction | Statement))
}

async fn apply(conn: &mut SqliteConnection, path: &Path, batch: &Batch) -> Result<BatchReply> {
    retry_while_busy!(path, {
        let outcome = batch.apply(conn).await;
        if outcome.is_err() {
            rollback(conn).await;
        }
        outcome
    })
}

/// Rolls the current transaction back.
async fn rollback(conn: &mut SqliteConnection) {
    // SQLite has already rolled back after some errors, such as a full disk.
    if let Err(error) = execute(conn, "ROLLBACK").await {
        tracing::debug!(%error, "nothing to roll back");
    }
}

async fn wal_checkpoint(conn: &mut SqliteConnection, pragma: &'static str) {
    // A reader may block it; the next checkpoint tries again.
    if let Err(error) = execute(conn, pragma).await {
        tracing::debug!(%error, "the write-ahead log was not checkpointed");
    }
}

/// Runs `work` in a separate transaction. Rolls it back if `work` or the commit fails.
pub(crate) async fn run_transaction<T>(
    conn: &mut SqliteConnection,
    path: &Path,
    work: impl for<'c> FnOnce(&'c mut SqliteConnection) -> Work<'c, Result<T>>,
) -> Result<T> {
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
    outcome
}

async fn execute(conn: &mut SqliteConnection, sql: &'static str) -> Result<()> {
    sqlx::query(sql).execute(conn).await?;
    Ok(())
}
