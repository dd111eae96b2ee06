//! Requests to an object store on threads of their own, so that any thread may wait for a reply.

use std::future::Future;
use std::io;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{LazyLock, Mutex};
use std::time::{Duration, Instant};

use tokio::runtime::{Builder, Runtime};

use super::bucket_error::BucketError;
use super::client::time_scale;
use mocban_core::locked;

/// While a request lasts, a warning says so at this interval.
const NOTICE_EVERY: Duration = Duration::from_secs(20);
/// Threads that send requests.
const THREADS: usize = 2;

static RUNTIME: LazyLock<io::Result<Runtime>> = LazyLock::new(|| {
    Builder::new_multi_thread()
        .worker_threads(THREADS)
        .thread_name("object store")
        .enable_all()
        .build()
});

/// A request that was started.
#[derive(Debug)]
pub(super) struct PendingReply<T> {
    /// Address of the object or folder, for messages.
    address: String,
    receiver: mpsc::Receiver<Result<T, BucketError>>,
}

/// Starts a request for an object or folder.
pub(super) fn start<T: Send + 'static>(
    address: String,
    request: impl Future<Output = Result<T, BucketError>> + Send + 'static,
) -> Result<PendingReply<T>, BucketError> {
    let runtime = RUNTIME.as_ref().map_err(|error| BucketError::Unavailable {
        address: address.clone(),
        reason: error.to_string(),
    })?;
    let (sender, receiver) = mpsc::sync_channel(1);
    runtime.spawn(async move {
        // The caller may have been given up.
        let _ = sender.send(request.await);
    });
    Ok(PendingReply { address, receiver })
}

impl<T> PendingReply<T> {
    /// Waits for the outcome of the request. Warns while it lasts.
    pub(super) fn wait(self) -> Result<T, BucketError> {
        let begun = Instant::now();
        loop {
            match self.receiver.recv_timeout(NOTICE_EVERY / time_scale()) {
                Ok(reply) => return reply,
                Err(RecvTimeoutError::Timeout) => warn_of_wait(&self.address, begun),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(BucketError::Unavailable {
                        address: self.address,
                        reason: "the request ended without a result".to_owned(),
                    });
                }
            }
        }
    }
}

/// Warns that a request has lasted since `begun`, at most once every [`NOTICE_EVERY`] whatever the number of requests.
fn warn_of_wait(address: &str, begun: Instant) {
    static LAST: Mutex<Option<Instant>> = Mutex::new(None);
    let mut last = locked(&LAST);
    if last.is_some_and(|last| last.elapsed() < NOTICE_EVERY / time_scale()) {
        return;
    }
    *last = Some(Instant::now());
    let seconds = begun.elapsed().as_secs();
    tracing::warn!(
        "{address}: a request to the object store has been running for {seconds} s; waiting"
    );
}
