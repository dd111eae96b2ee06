//! Blocking work of a request, which ends when nobody waits for its response any more.

use tokio::task::{JoinError, spawn_blocking};

use crate::domain::cancel::{CancelGuard, CancelToken};

/// Runs work on a thread for blocking calls. If the returned future is dropped, as when a browser closes the connection,
/// the work is cancelled.
///
/// # Errors
/// Returns an error if the work panics.
pub async fn run_for_request<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, JoinError> {
    let token = CancelToken::default();
    let cancels = CancelGuard(token.clone());
    let done = spawn_blocking(move || token.run(work)).await?;
    drop(cancels);
    match done {
        Ok(result) => Ok(result),
        // Only a dropped future cancels, and it is not polled again.
        Err(_cancelled) => std::future::pending().await,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::run_for_request;
    use crate::domain::cancel::polled;

    /// Sends a message when it is dropped.
    struct Ended(mpsc::Sender<()>);

    impl Drop for Ended {
        fn drop(&mut self) {
            let _ = self.0.send(());
        }
    }

    #[tokio::test]
    async fn work_ends_when_its_request_is_dropped() {
        let (started, mut start) = tokio::sync::oneshot::channel();
        let (ended, end) = mpsc::channel();
        let mut request = Box::pin(run_for_request(move || {
            let _ended = Ended(ended);
            started.send(()).expect("a receiver");
            polled(std::iter::repeat(())).for_each(drop);
        }));
        tokio::select! {
            biased;
            _ = &mut request => panic!("the loop has no end"),
            begun = &mut start => begun.expect("it starts"),
        }
        drop(request);
        end.recv().expect("the thread ends");
    }

    #[tokio::test]
    async fn results_and_panics_come_through() {
        assert_eq!(run_for_request(|| 7).await.expect("no panic"), 7);
        let panicked = run_for_request(|| std::panic::resume_unwind(Box::new(7))).await;
        assert!(panicked.is_err_and(|error| error.is_panic()));
    }
}
