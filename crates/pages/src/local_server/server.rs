//! A server for the browser of one user: binds its port, and serves pages until it is stopped.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::{Extension, Router};
use tokio::net::TcpListener;

use super::access_control::{AccessControl, Entrance};
use super::address::listen;
use super::connection::ConnectionLimits;
use super::connections::serve;
use mocban_core::domain::Explained;

/// Why the server cannot start.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
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
}

impl Explained for ServerError {}

/// Binds an address, see [`listen`]. Returns the bound address too.
pub(super) async fn bind(
    address: SocketAddr,
    name: &str,
) -> Result<(TcpListener, SocketAddr), ServerError> {
    let failed = |source| ServerError::Listen { address, source };
    let listener = listen(address, name).await.map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    Ok((listener, address))
}

/// A server that is bound and ready to serve.
#[derive(Debug)]
pub struct LocalServer {
    listener: TcpListener,
    access: Arc<AccessControl>,
    address: SocketAddr,
}

impl LocalServer {
    /// Binds an address. Port 0 chooses the same port for equal names, if it is free. Cookies are named after `page`.
    ///
    /// # Errors
    /// Returns an error if the address cannot be bound or the system provides no randomness.
    pub async fn bind(address: SocketAddr, name: &str, page: &str) -> Result<Self, ServerError> {
        let (listener, address) = bind(address, name).await?;
        let access =
            AccessControl::new(page, address, Entrance::Command).map_err(ServerError::Token)?;
        Ok(Self {
            listener,
            access: Arc::new(access),
            address,
        })
    }

    /// Returns the start URL with the one-time token.
    pub fn url(&self) -> String {
        self.access.url()
    }

    /// Returns the bound address.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Serves `pages` until `stop` completes, and then at most two seconds longer. Handlers find the [`AccessControl`] as an
    /// extension. Returns the number of requests that were cut off without a response.
    pub async fn serve(self, pages: Router, stop: impl Future<Output = ()>) -> usize {
        let access = Extension(Arc::clone(&self.access));
        let router = self.access.guarded(pages.layer(access));
        serve(self.listener, router, ConnectionLimits::system(), stop).await
    }
}
