//! Serves one connection within time limits.

use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, HttpBody};
use axum::extract::Request;
use axum::response::Response;
use hyper::body::{Frame, Incoming, SizeHint};
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpStream;
use tokio::sync::{Notify, watch};
use tokio::time::Instant;

use mocban_core::locked;
use mocban_system::failpoint::time_scale;
use mocban_system::platform;

/// Maximum number of bytes of a request header, and of a response that waits for a slow client.
const BUFFER_BYTES: usize = 64 * 1024;

/// Limits on the connections of a server.
#[derive(Debug, Clone, Copy)]
pub struct ConnectionLimits {
    /// Maximum number of open connections.
    pub(super) connections: usize,
    /// Maximum time to receive a complete request header. It also applies if the client sends nothing.
    pub(super) header: Duration,
    /// Maximum time from the creation of a response, or from its last part that was sent, to the next request. A client that
    /// does not read is cut off.
    pub(super) response: Duration,
    /// Maximum time that the shutdown waits for a response.
    pub(super) shutdown: Duration,
    /// Maximum time that the shutdown waits for the rest of a request's header.
    pub(super) shutdown_header: Duration,
    /// Whether a connection may have several requests.
    pub(super) keep_alive: bool,
}

impl ConnectionLimits {
    /// Returns the limits for this process. At most a quarter of its file descriptors are used for connections.
    pub fn system() -> Self {
        let factor = time_scale("MOCBAN_LIMIT_FACTOR");
        Self {
            connections: (platform::max_open_files() / 4).clamp(4, 128) as usize,
            header: Duration::from_secs(15) * factor,
            response: Duration::from_mins(1) * factor,
            shutdown: Duration::from_secs(2) * time_scale("MOCBAN_SHUTDOWN_FACTOR"),
            shutdown_header: Duration::from_millis(300),
            keep_alive: true,
        }
    }

    /// Returns the limits of a second server in a process.
    pub(super) fn of_guests() -> Self {
        let system = Self::system();
        Self {
            connections: (system.connections / 2).max(4),
            ..system
        }
    }

    /// Returns the limits of a server beside other work, which few clients ask once in some seconds. A connection has one
    /// request, because a client may send many without waiting for the responses.
    pub fn of_rare_requests() -> Self {
        let system = Self::system();
        Self {
            connections: system.connections.min(16),
            keep_alive: false,
            ..system
        }
    }
}

/// How a connection ended.
#[derive(Debug, Clone, Copy)]
pub(super) enum ConnectionEnd {
    /// No request was in progress.
    Closed,
    /// The shutdown ended a request that took too long.
    CutOff,
}

/// What a connection is doing.
#[derive(Debug)]
pub(super) struct Activity {
    /// Start of the idle time, or `None` while a request is served or the next part of a response is created.
    idle_since: Mutex<Option<Instant>>,
    /// Notified if the connection must close once it is idle.
    pub(super) close: Notify,
    /// Notified if this connection becomes idle.
    idle: Arc<Notify>,
}

impl Activity {
    pub(super) fn new(idle: Arc<Notify>) -> Self {
        Self {
            idle_since: Mutex::new(Some(Instant::now())),
            close: Notify::new(),
            idle,
        }
    }

    /// Returns the start of the idle time, or `None` while a request is served or the next part of a response is created.
    pub(super) fn idle_since(&self) -> Option<Instant> {
        *locked(&self.idle_since)
    }

    /// Marks the connection as busy until the returned value is dropped.
    fn begin(self: &Arc<Self>) -> RequestInProgress {
        *locked(&self.idle_since) = None;
        RequestInProgress(Arc::clone(self))
    }

    /// Begins the idle time anew, because a part of a response was sent.
    fn proceed(&self) {
        let mut idle_since = locked(&self.idle_since);
        if idle_since.is_some() {
            *idle_since = Some(Instant::now());
        }
    }

    /// Completes if the connection has been idle for `limit`.
    async fn idle_for(&self, limit: Duration) {
        loop {
            let end = self.idle_since().unwrap_or_else(Instant::now) + limit;
            tokio::time::sleep_until(end).await;
            if self.idle_since().is_some_and(|since| since + limit <= end) {
                return;
            }
        }
    }
}

/// A request that a connection serves.
#[derive(Debug)]
struct RequestInProgress(Arc<Activity>);

impl Drop for RequestInProgress {
    fn drop(&mut self) {
        *locked(&self.0.idle_since) = Some(Instant::now());
        self.0.idle.notify_one();
    }
}

/// Serves one connection until the client closes it or leaves it idle for too long, or the server stops or needs room.
pub(super) async fn serve_connection(
    stream: TcpStream,
    router: Router,
    activity: Arc<Activity>,
    limits: ConnectionLimits,
    mut stopping: watch::Receiver<()>,
) -> ConnectionEnd {
    let service = RequestCounter {
        service: TowerToHyperService::new(router),
        activity: Arc::clone(&activity),
    };
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .max_buf_size(BUFFER_BYTES)
        .keep_alive(limits.keep_alive)
        .header_read_timeout(limits.header);
    let served = http.serve_connection(TokioIo::new(stream), service);
    tokio::pin!(served);
    loop {
        tokio::select! {
            // Errors concern only this client, which may have closed the connection at any time.
            _ = served.as_mut() => return ConnectionEnd::Closed,
            () = activity.idle_for(limits.response) => return ConnectionEnd::Closed,
            // No request can begin between the check and the return, because only this loop polls the connection.
            () = activity.close.notified() => if activity.idle_since().is_some() {
                return ConnectionEnd::Closed;
            },
            _ = stopping.changed() => break,
        }
    }
    served.as_mut().graceful_shutdown();
    let busy = activity.idle_since().is_none();
    let limit = if busy {
        limits.shutdown
    } else {
        limits.shutdown_header
    };
    match tokio::time::timeout(limit, served).await {
        Err(_) if activity.idle_since().is_none() => ConnectionEnd::CutOff,
        Ok(_) | Err(_) => ConnectionEnd::Closed,
    }
}

/// Marks a connection as busy while its service creates a response.
#[derive(Debug)]
struct RequestCounter {
    service: TowerToHyperService<Router>,
    activity: Arc<Activity>,
}

impl Service<Request<Incoming>> for RequestCounter {
    type Response = Response;
    type Error = std::convert::Infallible;
    type Future = futures_util::future::BoxFuture<'static, Result<Response, Self::Error>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        let in_progress = self.activity.begin();
        let response = self.service.call(request);
        let activity = Arc::clone(&self.activity);
        Box::pin(async move {
            let Ok(response) = response.await;
            drop(in_progress);
            Ok(response.map(|body| Body::new(SentBody::new(body, activity))))
        })
    }
}

/// The body of a response, whose parts are asked for as fast as the client reads them. Only the client's time counts as
/// idle, not the time in which the server creates the next part.
#[derive(Debug)]
struct SentBody {
    body: Body,
    activity: Arc<Activity>,
    /// The next part, while the server creates it.
    next_part: Option<RequestInProgress>,
}

impl SentBody {
    const fn new(body: Body, activity: Arc<Activity>) -> Self {
        Self {
            body,
            activity,
            next_part: None,
        }
    }
}

impl HttpBody for SentBody {
    type Data = <Body as HttpBody>::Data;
    type Error = <Body as HttpBody>::Error;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Self::Data>, Self::Error>>> {
        let this = self.get_mut();
        let polled = Pin::new(&mut this.body).poll_frame(context);
        if polled.is_ready() {
            this.next_part = None;
            this.activity.proceed();
        } else if this.next_part.is_none() {
            this.next_part = Some(this.activity.begin());
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;
    use std::pin::Pin;
    use std::sync::Arc;
    use std::task::{Context, Poll, Waker};
    use std::time::Duration;

    use axum::body::{Body, HttpBody as _};
    use futures_util::stream;
    use tokio::time::Instant;

    use super::{Activity, SentBody, locked};

    #[test]
    fn a_response_is_idle_only_while_the_client_reads_a_part() {
        let activity = Arc::new(Activity::new(Arc::default()));
        let mut polls = 0;
        let parts = stream::poll_fn(move |_| {
            polls += 1;
            match polls {
                2 => Poll::Ready(Some(Ok::<_, Infallible>("part"))),
                4 => Poll::Ready(None),
                _ => Poll::Pending,
            }
        });
        let mut body = SentBody::new(Body::from_stream(parts), Arc::clone(&activity));
        let mut poll = || Pin::new(&mut body).poll_frame(&mut Context::from_waker(Waker::noop()));
        for is_ready in [false, true, false, true] {
            assert_eq!(poll().is_ready(), is_ready);
            assert_eq!(activity.idle_since().is_some(), is_ready);
        }
        // The client may be gone before the next part is there.
        let never = stream::pending::<Result<&str, Infallible>>();
        let mut body = SentBody::new(Body::from_stream(never), Arc::clone(&activity));
        let polled = Pin::new(&mut body).poll_frame(&mut Context::from_waker(Waker::noop()));
        assert!(polled.is_pending() && activity.idle_since().is_none());
        drop(body);
        assert!(activity.idle_since().is_some());
    }

    #[test]
    fn a_part_that_was_sent_begins_the_idle_time_anew() {
        let activity = Arc::new(Activity::new(Arc::default()));
        let minute = Duration::from_mins(1);
        let earlier = Instant::now().checked_sub(minute);
        *locked(&activity.idle_since) = earlier;
        activity.proceed();
        assert!(activity.idle_since() > earlier);
        *locked(&activity.idle_since) = None;
        activity.proceed();
        assert_eq!(activity.idle_since(), None, "a request is served");
    }
}
