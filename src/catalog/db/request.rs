//! Requests that the writer commits together, and where it sends the replies.

use tokio::sync::oneshot;

use crate::catalog::db::error::Result;
use crate::catalog::queue::checkpoint::StoredStages;
use crate::catalog::queue::claim::{ClaimRequest, Heartbeat};
use crate::catalog::queue::lease::{Lease, StageFailure};

/// Where a reply goes.
pub(crate) type Reply<T> = oneshot::Sender<Result<T>>;

/// A request that may share a commit with others. A write under a lease is answered with whether the lease still held.
pub(crate) enum Request {
    Heartbeat(Heartbeat, Reply<bool>),
    Checkpoint(Box<StoredStages>, Reply<bool>),
    Fail(Box<(Lease, StageFailure)>, Reply<bool>),
    Release(Lease, Reply<bool>),
    Claim(ClaimRequest, Reply<Vec<Lease>>),
}
