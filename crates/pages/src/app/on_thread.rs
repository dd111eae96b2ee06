//! Work whose future cannot move between threads, such as opening a catalog.

use tokio::runtime::Handle;

use mocban_project::ProjectResult;
use mocban_project::error::TaskStopped;

/// Waits for a future on a thread of its own. The compiler cannot tell that futures which open a catalog are `Send`.
pub(super) async fn on_thread<T, F>(work: impl FnOnce() -> F + Send + 'static) -> ProjectResult<T>
where
    T: Send + 'static,
    F: Future<Output = ProjectResult<T>>,
{
    let done = tokio::task::spawn_blocking(move || Handle::current().block_on(work())).await;
    done.map_err(TaskStopped)?
}
