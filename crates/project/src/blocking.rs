//! Work that waits for files or computes, on tokio's blocking threads.

use tokio::task::{JoinError, spawn_blocking};

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
