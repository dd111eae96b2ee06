//! Work that waits for files or computes, on tokio's blocking threads.

use std::time::Duration;

use tokio::task::{JoinError, spawn_blocking};
use tokio::time::timeout;

use crate::error::ProjectResult;
use mocban_core::domain::Explained;

/// A task panicked or was cancelled.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct TaskStopped(JoinError);

impl Explained for TaskStopped {}

/// Starts a function on a blocking thread. The future returns what the function returns; the function goes on if nobody
/// waits for it any more.
pub fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> impl Future<Output = ProjectResult<T>> {
    let task = spawn_blocking(work);
    async move { Ok(task.await.map_err(TaskStopped)?) }
}

/// Calls a function on a blocking thread and returns its result. Returns `None` if it panics or takes longer than `limit`, as on
/// a disk that hangs; the function itself is not stopped.
pub(crate) async fn blocking_within<T: Send + 'static>(
    limit: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    timeout(limit, spawn_blocking(work)).await.ok()?.ok()
}
