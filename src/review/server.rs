//! Starts the server: binds the port, reads the queue, and serves until it is stopped.

use std::net::SocketAddr;
use std::sync::Arc;

use tokio::net::TcpListener;

use super::connection::ConnectionLimits;
use super::connections;
use super::guard::START;
use super::item::ReviewItem;
use super::item_images::ImageCache;
use super::options::ReviewOptions;
use super::routes;
use super::session::Session;
use super::state::ServerState;
use crate::catalog::{Catalog, CatalogError};
use crate::domain::ContentHash;
use crate::store::Project;

/// Why the server cannot start or run.
#[derive(Debug, thiserror::Error)]
pub enum ReviewError {
    /// The address cannot be bound.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The cause.
        source: std::io::Error,
    },
    /// The operating system provides no randomness for the token.
    #[error("cannot make a token: {0}")]
    Token(std::io::Error),
    /// The queue cannot be read.
    #[error("cannot read the review queue: {0}")]
    Queue(String),
    /// The catalog cannot be read.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
}

/// A server that is bound and ready to serve.
#[derive(Debug)]
pub struct ReviewServer {
    listener: TcpListener,
    state: Arc<ServerState>,
    address: SocketAddr,
    counts: QueueCounts,
}

/// Number of items in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueCounts {
    /// All items.
    pub items: usize,
    /// Items that show results. All other items are attention checks.
    pub results: usize,
    /// Items that the reviewer has answered.
    pub answered: usize,
}

/// Binds the port and reads the queue.
///
/// # Errors
/// Returns an error if the address cannot be bound, the system provides no randomness, or the queue cannot be read.
pub async fn bind(
    catalog: Catalog,
    project: Project,
    options: ReviewOptions,
) -> Result<ReviewServer, ReviewError> {
    let address = options.listen;
    let failed = |source| ReviewError::Listen { address, source };
    let preferred = preferred_port(&project, &options.queue.reviewer);
    let listener = listen(address, preferred).await.map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let state = ServerState {
        images: ImageCache::new(catalog.clone(), project.clone(), options.limits),
        session: Session::new(address.port()).map_err(ReviewError::Token)?,
        hosts: hosts(address),
        catalog,
        project,
        options,
        served_items: std::sync::Mutex::default(),
    };
    // Loads the items now: after a restart, a page may resend an answer before it requests the queue.
    let queue = state.load_queue().await;
    let queue = queue.map_err(|error| ReviewError::Queue(error.to_string()))?;
    let count =
        |is: &dyn Fn(&ReviewItem) -> bool| queue.items.iter().filter(|item| is(item)).count();
    Ok(ReviewServer {
        counts: QueueCounts {
            items: queue.items.len(),
            results: count(&|item| item.check.is_none()),
            answered: count(&|item| queue.history.answer(item).is_some()),
        },
        listener,
        state: Arc::new(state),
        address,
    })
}

impl ReviewServer {
    /// Returns the start URL with the one-time token.
    pub fn url(&self) -> String {
        let token = &self.state.session.token;
        format!("http://{}{START}?token={token}", self.address)
    }

    /// Returns the bound address.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the number of items in the queue.
    pub const fn counts(&self) -> QueueCounts {
        self.counts
    }

    /// Serves requests until `stop` completes, and then at most two seconds longer. Returns the number of requests that
    /// were cut off without a response.
    pub async fn serve(self, stop: impl Future<Output = ()>) -> usize {
        let router = routes::router(&self.state);
        connections::serve(self.listener, router, ConnectionLimits::system(), stop).await
    }
}

/// First port and number of ports of the dynamic range (RFC 6335).
const DYNAMIC_PORTS: [u16; 2] = [49_152, 16_384];

/// Returns a port that is the same on every start for a project and reviewer. The browser keeps unsaved answers per
/// origin, so a restarted server needs the same port to receive these answers.
fn preferred_port(project: &Project, reviewer: &str) -> u16 {
    let dir = project.dir();
    let dir = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    let name = format!("{}\0{reviewer}", dir.display());
    let [first, second, ..] = *ContentHash::of(name.as_bytes()).as_bytes();
    DYNAMIC_PORTS[0] + u16::from_be_bytes([first, second]) % DYNAMIC_PORTS[1]
}

/// Binds the address. Port 0 tries the preferred port first.
async fn listen(address: SocketAddr, preferred: u16) -> std::io::Result<TcpListener> {
    if address.port() == 0
        && let Ok(listener) = TcpListener::bind(SocketAddr::new(address.ip(), preferred)).await
    {
        return Ok(listener);
    }
    TcpListener::bind(address).await
}

/// Returns the accepted values of the `Host` header.
fn hosts(address: SocketAddr) -> Vec<String> {
    let port = address.port();
    let mut hosts = vec![address.to_string()];
    if address.ip().is_loopback() {
        hosts.extend([format!("localhost:{port}"), format!("127.0.0.1:{port}")]);
    }
    hosts
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use super::listen;

    #[tokio::test]
    async fn port_zero_prefers_the_fixed_port_if_it_is_free() {
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let port =
            |listener: &tokio::net::TcpListener| listener.local_addr().expect("an address").port();
        let probe = listen(any, 0).await.expect("a socket");
        let preferred = port(&probe);
        let other = listen(any, preferred).await.expect("a socket");
        assert_ne!(port(&other), preferred, "it is taken");
        drop(probe);
        let rebound = listen(any, preferred).await.expect("a socket");
        assert_eq!(port(&rebound), preferred);
    }
}
