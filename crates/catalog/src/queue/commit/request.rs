//! Messages to the writer task: requests that share a commit, separate transactions, and the senders for replies.

use tokio::sync::oneshot;

use crate::db::conn::Work;
use crate::db::error::Result;
use crate::queue::claim::ClaimRequest;
use crate::queue::commit::write_connection::WriteConnection;
use crate::queue::fail::LeasedFailure;
use crate::queue::lease::{Heartbeat, Lease, LeasedCheckpoints};

/// Where a reply goes.
pub(crate) type Reply<T> = oneshot::Sender<Result<T>>;

/// A request that may share a commit with others. The reply `false` means that its lease or worker was not valid.
pub(crate) enum Request {
    Heartbeat(Heartbeat, Reply<bool>),
    Checkpoint(Box<LeasedCheckpoints>, Reply<bool>),
    Fail(Box<LeasedFailure>, Reply<bool>),
    Release(Lease, Reply<bool>),
    Claim(ClaimRequest, Reply<Vec<Lease>>),
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
