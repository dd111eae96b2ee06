//! The writer task, which commits pending requests together and replies after the commit. Only heartbeats and the requests
//! for pairs are grouped. Everything else comes from `Catalog::in_transaction` as a transaction of its own, also the jobs of
//! blocks (`worker_requests.rs`).

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;

use crate::db::busy_retry::retry_while_busy;
use crate::db::error::{CatalogError, Result};
use crate::db::error_kind::CatalogErrorKind;
use crate::queue::commit::batch_collector::{Message, collect};
use crate::queue::commit::commit_delay::CommitDelay;
use crate::queue::commit::group_commit::{Batch, BatchReply};
use crate::queue::commit::server_commit;
use crate::queue::commit::write_connection::{WriteConnection, rollback};

/// Number of commits, with about 4 MiB of log, after which the log is checkpointed even if requests are pending.
const COMMITS_PER_CHECKPOINT: u32 = 128;
/// Idle time after which the write-ahead log is checkpointed.
const IDLE: Duration = Duration::from_millis(250);

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
                writer
                    .checkpoint_log("PRAGMA wal_checkpoint(PASSIVE)")
                    .await;
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
                let parts = if writer.is_on_server() {
                    batch.split_for_server()
                } else {
                    vec![batch]
                };
                for part in parts {
                    commit(&mut writer, part).await;
                }
                match after {
                    Some(Message::Close(done)) => break Some(done),
                    Some(Message::Transaction(work)) => work(&mut writer).await,
                    Some(Message::Grouped(_) | Message::Deferrable(_) | Message::Flush) | None => {}
                }
            }
        }
        commits += 1;
        if commits >= COMMITS_PER_CHECKPOINT {
            writer
                .checkpoint_log("PRAGMA wal_checkpoint(PASSIVE)")
                .await;
            commits = 0;
        }
    };
    writer.close().await;
    if let Some(done) = closing {
        // The caller may have stopped waiting.
        let _ = done.send(());
    }
}

/// Commits a batch and replies to its requests. If the database file causes the error, such as a lock or a full disk,
/// all requests fail. After any other error, each request is committed on its own, so that only the invalid ones fail.
async fn commit(writer: &mut WriteConnection, batch: Batch) {
    match apply(writer, &batch).await {
        Ok(answers) => batch.answer(answers),
        Err(error) if batch.len() == 1 || is_of_the_file(&error) => {
            batch.refuse(&Arc::new(error));
        }
        Err(_) => {
            for single in batch.split() {
                match apply(writer, &single).await {
                    Ok(answers) => single.answer(answers),
                    Err(error) => single.refuse(&Arc::new(error)),
                }
            }
        }
    }
}

async fn apply(writer: &mut WriteConnection, batch: &Batch) -> Result<BatchReply> {
    writer.check_log().await?;
    writer.reconnect_if_broken().await?;
    let mut repeats = 0;
    let reply = loop {
        let (conn, path, mut server) = writer.parts();
        let reply = retry_while_busy!(path, {
            let outcome = match server.as_deref_mut() {
                Some(state) => {
                    let retry_wait = Arc::clone(&state.retry_wait);
                    let commit = server_commit::commit(batch, conn, state);
                    retry_wait.limit(commit).await
                }
                None => batch.apply(conn, false).await,
            };
            if outcome.as_ref().is_err_and(|error| !error.is_unavailable()) {
                rollback(conn).await;
            }
            outcome
        });
        match reply {
            // What was stored before the connection broke is found when the batch is applied again.
            Err(error) if error.is_unavailable() && writer.may_repeat(repeats, &error).await => {
                writer.reconnect().await?;
                repeats += 1;
                tracing::debug!(%error, "the commit is tried again");
            }
            reply => {
                writer.note_outcome(&reply);
                break reply;
            }
        }
    };
    writer.check_log().await?;
    reply
}

/// Returns whether an error concerns the file rather than a request.
fn is_of_the_file(error: &CatalogError) -> bool {
    use CatalogErrorKind::{Contradiction, Statement};
    let kind = error.kind();
    matches!(error, CatalogError::NotConnected { .. })
        || error.log_loss().is_some()
        || kind.is_some_and(|kind| !matches!(kind, Contradiction | Statement))
}
