//! Accepts connections. Their number and all waiting times are limited, so that no client can block
//! the server or prevent its shutdown.
//!
//! `axum::serve` has no such limits. See <https://github.com/tokio-rs/axum/issues/2741>.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use tokio::net::TcpListener;
use tokio::sync::{Notify, watch};
use tokio::task::JoinSet;

use super::connection::{Activity, ConnectionEnd, ConnectionLimits, serve_connection};

/// Serves connections until `stop` completes. Then finishes the requests in progress within the time limits and closes
/// all connections. Returns the number of requests that were cut off without a response.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    limits: ConnectionLimits,
    stop: impl Future<Output = ()>,
) -> usize {
    let (stopping, _) = watch::channel(());
    let mut connections = OpenConnections {
        limits,
        activities: Vec::new(),
        tasks: JoinSet::new(),
        idle: Arc::default(),
    };
    tokio::select! {
        never = connections.accept(&listener, &router, &stopping) => match never {},
        () = stop => {}
    }
    drop(listener);
    stopping.send_replace(());
    let mut cut_off = 0;
    while let Some(end) = connections.tasks.join_next().await {
        // A handler that panicked gave no response either.
        cut_off += usize::from(!matches!(end, Ok(ConnectionEnd::Closed)));
    }
    cut_off
}

/// The open connections of a server.
#[derive(Debug)]
struct OpenConnections {
    limits: ConnectionLimits,
    /// One entry per connection, including connections that have just been closed.
    activities: Vec<Arc<Activity>>,
    tasks: JoinSet<ConnectionEnd>,
    /// Notified if a connection becomes idle.
    idle: Arc<Notify>,
}

impl OpenConnections {
    /// Accepts connections without end.
    async fn accept(
        &mut self,
        listener: &TcpListener,
        router: &Router,
        stopping: &watch::Sender<()>,
    ) -> std::convert::Infallible {
        loop {
            let Ok((stream, _)) = listener.accept().await else {
                // If the process has no free file descriptor, closing an idle connection frees one. Any other error
                // concerns only the connection that was not accepted.
                self.close_idle();
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            };
            self.make_room().await;
            let activity = Arc::new(Activity::new(Arc::clone(&self.idle)));
            self.activities.push(Arc::clone(&activity));
            let task = serve_connection(
                stream,
                router.clone(),
                activity,
                self.limits,
                stopping.subscribe(),
            );
            self.tasks.spawn(task);
        }
    }

    /// Waits until there is room for one more connection. If there is none, closes the connection that has been idle
    /// longest, or waits until a connection becomes idle.
    async fn make_room(&mut self) {
        loop {
            while self.tasks.try_join_next().is_some() {}
            self.activities
                .retain(|activity| Arc::strong_count(activity) > 1);
            if self.tasks.len() < self.limits.connections {
                return;
            }
            self.close_idle();
            tokio::select! {
                _ = self.tasks.join_next() => {}
                () = self.idle.notified() => {}
            }
        }
    }

    /// Asks the connection that has been idle longest to close.
    fn close_idle(&self) {
        let idle = self.activities.iter();
        let idle = idle.filter_map(|activity| Some((activity.idle_since()?, activity)));
        if let Some((_, longest)) = idle.min_by_key(|(since, _)| *since) {
            longest.close.notify_one();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;
    use std::sync::Arc;
    use std::time::Duration;

    use axum::Router;
    use axum::routing::get;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::{TcpListener, TcpStream};
    use tokio::sync::{Notify, Semaphore, oneshot};
    use tokio::task::JoinHandle;

    use super::serve;
    use crate::local_server::connection::ConnectionLimits;

    const NEVER: Duration = Duration::from_hours(1);

    /// A server for tests. `/` responds at once, `/wait` only after a permit was added.
    struct TestServer {
        address: SocketAddr,
        permits: Arc<Semaphore>,
        /// Notified if a request of `/wait` has begun.
        begun: Arc<Notify>,
        stop: oneshot::Sender<()>,
        served: JoinHandle<usize>,
    }

    impl TestServer {
        async fn start(limits: ConnectionLimits) -> Self {
            let (permits, begun) = (Arc::new(Semaphore::new(0)), Arc::new(Notify::new()));
            let (waits, signal) = (Arc::clone(&permits), Arc::clone(&begun));
            let wait = get(async move || {
                signal.notify_one();
                waits.acquire().await.expect("an open semaphore").forget();
                "waited"
            });
            let router = Router::new()
                .route("/", get(async || "hello"))
                .route("/wait", wait);
            let listener = TcpListener::bind("127.0.0.1:0").await.expect("a socket");
            let address = listener.local_addr().expect("an address");
            let (stop, stopped) = oneshot::channel();
            let served = tokio::spawn(serve(listener, router, limits, async {
                stopped.await.expect("a stop");
            }));
            Self {
                address,
                permits,
                begun,
                stop,
                served,
            }
        }

        /// Opens a connection and sends `text`.
        async fn send(&self, text: &str) -> TcpStream {
            let mut stream = TcpStream::connect(self.address).await.expect("connected");
            stream.write_all(text.as_bytes()).await.expect("sent");
            stream
        }

        /// Opens a connection with a request that asks for the path.
        async fn get(&self, path: &str) -> TcpStream {
            let request = format!("GET {path} HTTP/1.1\r\nhost: a\r\nconnection: close\r\n\r\n");
            self.send(&request).await
        }

        /// Stops the server and returns the number of requests that were cut off.
        async fn stop(self) -> usize {
            self.stop.send(()).expect("a server");
            self.served.await.expect("no panic")
        }
    }

    /// Returns everything up to the end of a connection.
    async fn rest(mut stream: TcpStream) -> String {
        let mut text = String::new();
        // A reset instead of an end is also an end.
        let _ = stream.read_to_string(&mut text).await;
        text
    }

    fn limits() -> ConnectionLimits {
        ConnectionLimits {
            connections: 3,
            header: NEVER,
            response: NEVER,
            shutdown: NEVER,
            shutdown_header: Duration::from_millis(1),
            keep_alive: true,
        }
    }

    #[tokio::test]
    async fn a_connection_without_keep_alive_has_one_request() {
        let server = TestServer::start(ConnectionLimits {
            keep_alive: false,
            ..limits()
        })
        .await;
        let request = "GET / HTTP/1.1\r\nhost: a\r\n\r\n";
        let pipelined = rest(server.send(&request.repeat(3)).await).await;
        assert_eq!(pipelined.matches("hello").count(), 1, "{pipelined}");
    }

    #[tokio::test]
    async fn the_longest_idle_connection_is_closed_for_a_new_one() {
        let server = TestServer::start(limits()).await;
        let first = server.send("GET / HT").await;
        let second = server.send("").await;
        let third = server.send("GET / HTTP/1.1\r\nhost: a\r\n").await;
        assert!(rest(server.get("/").await).await.ends_with("hello"));
        assert_eq!(rest(first).await, "");
        // The connections opened later are still served.
        for (mut stream, end) in [
            (third, "\r\n"),
            (second, "GET / HTTP/1.1\r\nhost: a\r\n\r\n"),
        ] {
            stream.write_all(end.as_bytes()).await.expect("open");
            let mut status = [0; 12];
            stream.read_exact(&mut status).await.expect("a reply");
            assert_eq!(&status, b"HTTP/1.1 200");
        }
    }

    #[tokio::test]
    async fn requests_in_progress_are_not_closed_for_new_ones() {
        let server = TestServer::start(limits()).await;
        let mut streams = Vec::new();
        for _ in 0..3 {
            streams.push(server.get("/wait").await);
            server.begun.notified().await;
        }
        streams.push(server.get("/wait").await);
        server.permits.add_permits(4);
        for stream in streams {
            assert!(rest(stream).await.ends_with("waited"));
        }
    }

    #[tokio::test]
    async fn a_late_header_and_an_idle_connection_end_the_connection() {
        // Longer than a busy machine needs between the start of a connection and its first bytes.
        let server = TestServer::start(ConnectionLimits {
            header: Duration::from_secs(1),
            ..limits()
        })
        .await;
        for text in ["", "GET / HTTP/1.1\r\n"] {
            assert_eq!(rest(server.send(text).await).await, "");
        }
        let idle = server.send("GET / HTTP/1.1\r\nhost: a\r\n\r\n").await;
        assert!(rest(idle).await.ends_with("hello"));
    }

    #[tokio::test]
    async fn a_connection_without_a_further_request_ends() {
        // Longer than a busy machine needs between the start of a connection and its request.
        let server = TestServer::start(ConnectionLimits {
            response: Duration::from_secs(1),
            ..limits()
        })
        .await;
        assert_eq!(rest(server.send("GET / HT").await).await, "");
        // A request may take longer than this limit.
        let slow = server.get("/wait").await;
        server.begun.notified().await;
        tokio::time::sleep(Duration::from_secs(2)).await;
        server.permits.add_permits(1);
        assert!(rest(slow).await.ends_with("waited"));
    }

    #[tokio::test]
    async fn the_shutdown_finishes_requests_but_waits_for_no_header() {
        let server = TestServer::start(limits()).await;
        let half_open = server.send("GET / HTTP/1.1\r\n").await;
        let silent = server.send("").await;
        let busy = server.get("/wait").await;
        server.begun.notified().await;
        let permits = Arc::clone(&server.permits);
        let (cut_off, ()) = tokio::join!(server.stop(), async {
            assert_eq!(rest(half_open).await, "");
            assert_eq!(rest(silent).await, "");
            permits.add_permits(1);
            assert!(rest(busy).await.ends_with("waited"));
        });
        assert_eq!(cut_off, 0);
    }

    #[tokio::test]
    async fn the_shutdown_cuts_off_requests_that_take_too_long() {
        let server = TestServer::start(ConnectionLimits {
            shutdown: Duration::from_millis(20),
            ..limits()
        })
        .await;
        let busy = server.get("/wait").await;
        server.begun.notified().await;
        assert_eq!(server.stop().await, 1);
        assert_eq!(rest(busy).await, "");
    }
}
