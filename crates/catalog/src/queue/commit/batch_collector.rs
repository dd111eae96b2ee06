//! Messages to the writer task, and the collector of the requests of the next group commit.

use tokio::sync::{mpsc, oneshot};
use tokio::time::{Instant, timeout_at};

use crate::db::conn::Work;
use crate::queue::commit::commit_delay::CommitDelay;
use crate::queue::commit::group_commit::{Batch, Request};
use crate::queue::commit::write_connection::WriteConnection;

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

/// Most requests in one commit.
const BATCH: usize = 256;

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
pub(crate) async fn collect(
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use tokio::sync::{mpsc, oneshot};
    use tokio::time::timeout;

    use super::{BATCH, Message, collect};
    use crate::Catalog;
    use crate::queue::commit::commit_delay::CommitDelay;
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
