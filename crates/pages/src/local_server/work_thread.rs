//! The thread for the long work of a server.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::thread;

use tokio::sync::oneshot;

use mocban_core::domain::cancel::{CancelGuard, CancelToken};

/// Runs long work on one thread, one call after another.
///
/// The memory of a server then is that of one picture, however many are asked for. The allocator of glibc keeps freed
/// memory for each thread that used it, so the same work on many threads also keeps many times as much.
#[derive(Debug)]
pub struct WorkThread {
    calls: mpsc::Sender<Call>,
}

type Call = Box<dyn FnOnce() + Send>;

/// The work panicked, so there is no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a fault of the program ended this work; the terminal in which it runs shows more")]
pub struct WorkFailed;

impl Default for WorkThread {
    /// Starts the thread. It ends when this value is dropped and the calls are finished.
    fn default() -> Self {
        let (calls, waiting) = mpsc::channel::<Call>();
        thread::spawn(move || {
            for call in waiting {
                // The caller learns of a panic because it gets no result. State that is shared with the work must hold
                // after a panic, as on any thread.
                drop(catch_unwind(AssertUnwindSafe(call)));
            }
        });
        Self { calls }
    }
}

impl WorkThread {
    /// Calls `work` on the thread and returns its result. If the caller no longer waits, for example because a browser has
    /// closed the connection, work that has not begun is left out, and work that has begun is cancelled.
    pub async fn call<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, WorkFailed> {
        let token = CancelToken::default();
        let cancels = CancelGuard(token.clone());
        let (result, returned) = oneshot::channel();
        let call = Box::new(move || {
            if !result.is_closed()
                && let Ok(done) = token.run(work)
            {
                // Fails if the caller has left meanwhile.
                let _ = result.send(done);
            }
        });
        self.calls.send(call).map_err(|_ended| WorkFailed)?;
        let returned = returned.await.map_err(|_dropped| WorkFailed);
        drop(cancels);
        returned
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::{WorkFailed, WorkThread};
    use mocban_core::domain::cancel::polled;

    /// Sends a message when it is dropped.
    struct Ended(mpsc::Sender<()>);

    impl Drop for Ended {
        fn drop(&mut self) {
            let _ = self.0.send(());
        }
    }

    #[tokio::test]
    async fn work_ends_when_its_caller_leaves() {
        let work = WorkThread::default();
        let (started, mut start) = tokio::sync::oneshot::channel();
        let (ended, end) = mpsc::channel();
        let mut request = Box::pin(work.call(move || {
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
        end.recv().expect("the work ends");
        assert_eq!(work.call(|| 7).await, Ok(7));
    }

    #[tokio::test]
    async fn all_calls_run_on_one_thread_also_after_a_panic() {
        let work = WorkThread::default();
        let thread = || std::thread::current().id();
        let first = work.call(thread).await.expect("an id");
        assert_ne!(first, thread());
        let failed = work.call(|| assert_eq!(1, 2, "a test of panics")).await;
        assert_eq!(failed, Err(WorkFailed));
        let (second, third) = tokio::join!(work.call(thread), work.call(thread));
        assert_eq!((second, third), (Ok(first), Ok(first)));
    }

    #[tokio::test]
    async fn work_for_a_caller_that_has_left_does_not_begin() {
        let work = WorkThread::default();
        let (release, released) = mpsc::channel::<()>();
        let (ran, runs) = mpsc::channel();
        let busy = work.call(move || released.recv());
        tokio::pin!(busy);
        {
            let left = work.call(move || ran.send(()));
            tokio::pin!(left);
            // Both calls are sent to the thread.
            assert!(futures_util::poll!(&mut busy).is_pending());
            assert!(futures_util::poll!(&mut left).is_pending());
        }
        release.send(()).expect("the thread waits");
        busy.await.expect("it ends").expect("released");
        work.call(|| ()).await.expect("it ends");
        assert!(runs.try_recv().is_err());
    }
}
