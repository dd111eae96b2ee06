//! Work whose future cannot move between threads, such as opening a catalog.

use std::convert::Infallible;

use tokio::runtime::Handle;
use tokio::sync::oneshot;
use tokio::task::spawn_blocking;

use mocban_project::ProjectResult;
use mocban_project::error::TaskStopped;

/// Runs a future on a blocking thread and waits for its result. The futures that open a catalog are not `Send`. The work
/// goes on to its end even if nobody waits for it any more, as a change must.
pub(crate) async fn on_thread<T, F>(work: impl FnOnce() -> F + Send + 'static) -> ProjectResult<T>
where
    T: Send + 'static,
    F: Future<Output = ProjectResult<T>>,
{
    let done = spawn_blocking(move || Handle::current().block_on(work())).await;
    done.map_err(TaskStopped)?
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
    let (mut wanted, _caller) = oneshot::channel::<Infallible>();
    let read = async move || {
        tokio::select! {
            biased;
            () = wanted.closed() => None,
            done = work() => Some(done),
        }
    };
    let done = spawn_blocking(move || Handle::current().block_on(read())).await;
    match done.map_err(TaskStopped)? {
        Some(done) => done,
        // The channel is closed only when this future is dropped.
        None => std::future::pending().await,
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::oneshot;

    use super::{on_thread, read_on_thread};
    use mocban_project::ProjectResult;

    #[tokio::test]
    async fn reading_ends_when_its_caller_leaves() {
        let (started, start) = oneshot::channel();
        let (ended, end) = oneshot::channel::<()>();
        let mut request = Box::pin(read_on_thread(async move || {
            let _ended = ended;
            started.send(()).expect("a receiver");
            std::future::pending::<ProjectResult<()>>().await
        }));
        tokio::select! {
            biased;
            _ = &mut request => unreachable!("the work has no end"),
            begun = start => begun.expect("it starts"),
        }
        drop(request);
        assert!(end.await.is_err(), "the work was dropped");
    }

    #[tokio::test]
    async fn a_change_goes_on_without_its_caller() {
        let (started, start) = oneshot::channel();
        let (proceed, go) = oneshot::channel::<()>();
        let (ended, end) = oneshot::channel();
        let mut request = Box::pin(on_thread(async move || {
            started.send(()).expect("a receiver");
            go.await.expect("it proceeds");
            ended.send(()).expect("a receiver");
            Ok(())
        }));
        tokio::select! {
            biased;
            _ = &mut request => unreachable!("it waits"),
            begun = start => begun.expect("it starts"),
        }
        drop(request);
        proceed.send(()).expect("a receiver");
        end.await.expect("the change was made");
    }

    #[tokio::test]
    async fn what_was_read_is_returned() {
        let read = read_on_thread(async || Ok(7)).await;
        assert_eq!(read.ok(), Some(7));
    }
}
