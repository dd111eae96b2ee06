//! Work whose future cannot move between threads, such as opening a catalog.

use std::convert::Infallible;

use tokio::runtime::Handle;
use tokio::sync::oneshot;

use crate::local_server::{WorkFailed, WorkThread};
use mocban_project::ProjectResult;
use mocban_project::blocking::blocking;

/// Runs a future on a blocking thread and waits for its result. The futures that open a catalog are not `Send`. The work
/// goes on to its end even if nobody waits for it any more, as a change must.
pub(crate) async fn on_thread<T, F>(work: impl FnOnce() -> F + Send + 'static) -> ProjectResult<T>
where
    T: Send + 'static,
    F: Future<Output = ProjectResult<T>>,
{
    blocking(move || Handle::current().block_on(work())).await?
}

/// Like [`on_thread`], for work that changes nothing: it ends when its caller leaves, for example because the browser has
/// closed the connection. Parts that it has handed to other threads end by themselves.
pub(crate) async fn read_on_thread<T, F>(
    work: impl FnOnce() -> F + Send + 'static,
) -> ProjectResult<T>
where
    T: Send + 'static,
    F: Future<Output = ProjectResult<T>>,
{
    let (wanted, _caller) = oneshot::channel();
    let read = move || Handle::current().block_on(until_left(wanted, work));
    match blocking(read).await? {
        Some(done) => done,
        // The channel is closed only when this future is dropped.
        None => std::future::pending().await,
    }
}

/// Like [`read_on_thread`], for work that needs much memory: one call after another on the given thread.
pub(crate) async fn read_in_turn<T, F>(
    thread: &WorkThread,
    work: impl FnOnce() -> F + Send + 'static,
) -> Result<ProjectResult<T>, WorkFailed>
where
    T: Send + 'static,
    F: Future<Output = ProjectResult<T>>,
{
    let runtime = Handle::current();
    let (wanted, _caller) = oneshot::channel();
    let read = move || runtime.block_on(until_left(wanted, work));
    match thread.call(read).await? {
        Some(done) => Ok(done),
        None => std::future::pending().await,
    }
}

/// Returns what a future does, or `None` once the other end of the channel is closed.
async fn until_left<F: Future>(
    mut wanted: oneshot::Sender<Infallible>,
    work: impl FnOnce() -> F,
) -> Option<F::Output> {
    tokio::select! {
        biased;
        () = wanted.closed() => None,
        done = work() => Some(done),
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::oneshot;

    use super::{on_thread, read_in_turn, read_on_thread};
    use crate::local_server::WorkThread;
    use mocban_project::ProjectResult;

    /// Drops a request once its work has started.
    async fn leave(request: impl Future + Unpin, start: oneshot::Receiver<()>) {
        tokio::select! {
            biased;
            _ = request => unreachable!("the work waits"),
            begun = start => begun.expect("it starts"),
        }
    }

    #[tokio::test]
    async fn reading_ends_when_its_caller_leaves() {
        let (started, start) = oneshot::channel();
        let (ended, end) = oneshot::channel::<()>();
        let request = Box::pin(read_on_thread(async move || {
            let _ended = ended;
            started.send(()).expect("a receiver");
            std::future::pending::<ProjectResult<()>>().await
        }));
        leave(request, start).await;
        assert!(end.await.is_err(), "the work was dropped");
    }

    #[tokio::test]
    async fn a_change_goes_on_without_its_caller() {
        let (started, start) = oneshot::channel();
        let (proceed, go) = oneshot::channel::<()>();
        let (ended, end) = oneshot::channel();
        let request = Box::pin(on_thread(async move || {
            started.send(()).expect("a receiver");
            go.await.expect("it proceeds");
            ended.send(()).expect("a receiver");
            Ok(())
        }));
        leave(request, start).await;
        proceed.send(()).expect("a receiver");
        end.await.expect("the change was made");
    }

    #[tokio::test]
    async fn what_was_read_is_returned() {
        let read = read_on_thread(async || Ok(7)).await;
        assert_eq!(read.ok(), Some(7));
    }

    #[tokio::test]
    async fn reading_in_turn_ends_when_its_caller_leaves_and_the_next_follows() {
        let thread = WorkThread::default();
        let (started, start) = oneshot::channel();
        let request = Box::pin(read_in_turn(&thread, async move || {
            started.send(()).expect("a receiver");
            std::future::pending::<ProjectResult<()>>().await
        }));
        leave(request, start).await;
        let next = read_in_turn(&thread, async || Ok(7)).await;
        assert_eq!(next.expect("the thread is there").ok(), Some(7));
    }
}
