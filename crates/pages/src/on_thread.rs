//! Work whose future cannot move between threads, such as opening a catalog.

use tokio::runtime::Handle;

use mocban_project::ProjectResult;
use mocban_project::error::TaskStopped;

/// Runs a future on a blocking thread and waits for its result. The futures that open a catalog are not `Send`.
pub(crate) async fn on_thread<T, F>(work: impl FnOnce() -> F + Send + 'static) -> ProjectResult<T>
where
    T: Send + 'static,
    F: Future<Output = ProjectResult<T>>,
{
    let done = tokio::task::spawn_blocking(move || Handle::current().block_on(work())).await;
    done.map_err(TaskStopped)?
}
