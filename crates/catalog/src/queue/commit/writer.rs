//! The writer task: collects the requests of callers, commits them together, and replies after the commit. Only heartbeats and
//! the requests for pairs are grouped. Everything else comes from `Catalog::in_transaction` as a transaction of its own, also
//! the jobs of blocks (`worker_requests.rs`). If no caller waits for a reply, a commit is delayed so that later requests can
//! share it.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::sync::{mpsc, oneshot};
use tokio::time::{Instant, timeout, timeout_at};

use crate::db::busy_retry::retry_while_busy;
use crate::db::conn::Work;
use crate::db::error::{CatalogError, Result};
use crate::db::error_kind::CatalogErrorKind;
use crate::queue::commit::group_commit::{Batch, BatchReply, Request, commit_on_server};
use crate::queue::commit::write_connection::{WriteConnection, rollback};

/// Number of commits, with about 4 MiB of log, after which the log is checkpointed even if requests are pending.
const COMMITS_PER_CHECKPOINT: u32 = 128;
/// Idle time after which the write-ahead log is checkpointed.
const IDLE: Duration = Duration::from_millis(250);
/// Most requests in one commit.
const BATCH: usize = 256;
/// Longest delay of a commit. A process that is killed loses the stages that it finished during the delay.
const LONGEST_DELAY: Duration = Duration::from_millis(250);

/// The delay, and how many callers currently forbid it.
#[derive(Debug)]
pub(crate) struct CommitDelay {
    longest: Duration,
    waiting: AtomicUsize,
}

impl CommitDelay {
    /// Returns the delay of a run.
    pub(crate) fn new() -> Arc<Self> {
        Self::of(LONGEST_DELAY)
    }

    /// Returns a delay of this length.
    pub(crate) fn of(longest: Duration) -> Arc<Self> {
        let waiting = AtomicUsize::new(0);
        Arc::new(Self { longest, waiting })
    }

    /// Returns when the delay of a commit ends, or `None` if a caller waits.
    pub(crate) fn until(&self) -> Option<Instant> {
        let nobody = self.waiting.load(Ordering::Relaxed) == 0;
        nobody.then(|| Instant::now() + self.longest)
    }
}

/// Turns the commit delay off while it lives.
#[derive(Debug)]
pub struct Waiting(Arc<CommitDelay>);

impl Waiting {
    /// Turns the delay off until the result is dropped.
    pub(crate) fn new(delay: &Arc<CommitDelay>) -> Self {
        delay.waiting.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(delay))
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A separate transaction, which sends its own reply.
pub(crate) type TransactionTask =
    Box<dyn for<'c> FnOnce(&'c mut WriteConnection) -> Work<'c, ()> + Send>;

/// A message to the writer task.
pub(crate) enum Message {
    /// Joins the next group commit.
    Grouped(Request),
    /// Joins the next group commit, which may be delayed so that later requests share it.
    Deferrable(Request),
    /// Ends the delay of the next commit, because somebody waits for it.
    Flush,
    /// Runs in its own transaction.
    Transaction(TransactionTask),
    /// Ends the writer after everything sent before.
    Close(oneshot::Sender<()>),
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
            let Ok(message) = timeout(IDLE, inbox.recv()).await else {
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

/// The requests collected so far.
struct BatchCollector {
    batch: Batch,
    /// End of the wait for more requests. `None` if the batch must be committed without delay.
    until: Option<Instant>,
    /// Message that ended the batch, unless it was a request.
    other: Option<Message>,
}

impl BatchCollector {
    fn take(&mut self, message: Message) {
        match message {
            Message::Deferrable(request) => self.batch.push(request),
            Message::Grouped(request) => {
                self.batch.push(request);
                self.until = None;
            }
            Message::Flush => self.until = None,
            other @ (Message::Transaction(_) | Message::Close(_)) => self.other = Some(other),
        }
    }

    fn is_full(&self) -> bool {
        self.other.is_some() || self.batch.len() >= BATCH
    }
}

/// Collects the batch that begins with `first`. Also returns the message that ended the batch, unless it was a request.
/// Yields to other tasks before it reads the inbox, because callers that just received a reply often send their next
/// request at once.
async fn collect(
    first: Message,
    delay: &CommitDelay,
    inbox: &mut mpsc::Receiver<Message>,
) -> (Batch, Option<Message>) {
    let mut collector = BatchCollector {
        batch: Batch::default(),
        until: delay.until(),
        other: None,
    };
    collector.take(first);
    loop {
        tokio::task::yield_now().await;
        let before = collector.batch.len();
        while !collector.is_full()
            && let Ok(message) = inbox.try_recv()
        {
            collector.take(message);
        }
        if collector.is_full() {
            break;
        }
        match collector.until {
            Some(until) => match timeout_at(until, inbox.recv()).await {
                Ok(Some(message)) => collector.take(message),
                Ok(None) | Err(_) => break,
            },
            None if collector.batch.len() == before => break,
            None => {}
        }
    }
    (collector.batch, collector.other)
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
                    let commit = commit_on_server(batch, conn, state);
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use tokio::sync::{mpsc, oneshot};
    use tokio::time::timeout;

    use super::{BATCH, CommitDelay, Message, collect};
    use crate::Catalog;
    use crate::queue::commit::group_commit::Request;
    use crate::queue::lease::Heartbeat;
    use mocban_core::domain::WorkerId;

    fn request() -> Request {
        let heartbeat = Heartbeat {
            worker: WorkerId(1),
            now: 1,
            alive_since: 1,
            metrics: None,
        };
        Request::Heartbeat(heartbeat, oneshot::channel().0)
    }

    /// Returns the size of the first batch if only `messages` arrive.
    async fn gathered(messages: Vec<Message>) -> usize {
        gathered_later(messages, Vec::new()).await
    }

    /// Like `gathered`, but the messages in `later` arrive while the collector waits.
    async fn gathered_later(messages: Vec<Message>, later: Vec<Message>) -> usize {
        let delay = CommitDelay::of(Duration::from_hours(1));
        let (sender, mut inbox) = mpsc::channel(messages.len());
        for message in messages {
            sender.send(message).await.expect("room");
        }
        let after = sender.clone();
        tokio::spawn(async move {
            for message in later {
                tokio::task::yield_now().await;
                after.send(message).await.expect("room");
            }
        });
        let first = inbox.recv().await.expect("a message");
        let batch = collect(first, &delay, &mut inbox);
        let batch = timeout(Duration::from_mins(10), batch).await;
        batch.expect("it does not wait").0.len()
    }

    #[tokio::test]
    async fn what_can_wait_goes_with_what_cannot() {
        let waits = Message::Deferrable;
        assert_eq!(
            gathered(vec![
                waits(request()),
                waits(request()),
                Message::Grouped(request())
            ])
            .await,
            3
        );
        assert_eq!(
            gathered(vec![Message::Grouped(request()), waits(request())]).await,
            2
        );
    }

    #[tokio::test]
    async fn what_comes_while_something_waits_goes_with_it() {
        let later = vec![
            Message::Deferrable(request()),
            Message::Deferrable(request()),
            Message::Flush,
        ];
        assert_eq!(
            gathered_later(vec![Message::Deferrable(request())], later).await,
            3
        );
    }

    #[tokio::test]
    async fn nothing_is_waited_for_when_somebody_is_in_a_hurry_or_closes() {
        let waits = Message::Deferrable;
        assert_eq!(gathered(vec![waits(request()), Message::Flush]).await, 1);
        let close = Message::Close(oneshot::channel().0);
        assert_eq!(gathered(vec![waits(request()), close]).await, 1);
    }

    #[tokio::test]
    async fn nothing_is_waited_for_while_somebody_waits() {
        let catalog = tempfile::tempdir().expect("a temporary directory");
        let path = catalog.path().join("catalog.sqlite");
        let catalog = Catalog::create_patient(&path).await.expect("a catalog");
        let until = || catalog.delay.until();
        assert!(until().is_some());
        let waiting = [catalog.waiting().await, catalog.waiting().await];
        let [one, other] = waiting.map(|waiting| waiting.expect("it is open"));
        drop(one);
        assert_eq!(until(), None);
        drop(other);
        assert!(until().is_some());
    }

    #[tokio::test]
    async fn a_full_commit_waits_for_no_more_and_leaves_the_rest() {
        let messages = (0..=BATCH).map(|_| Message::Deferrable(request()));
        assert_eq!(gathered(messages.collect()).await, BATCH);
    }
}
