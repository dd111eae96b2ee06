//! Starts the server: binds the port, reads the queue, and serves until it is stopped.

use std::net::SocketAddr;
use std::sync::Arc;

use tokio::net::TcpListener;

use super::item::ReviewItem;
use super::item_images::ImageCache;
use super::options::ReviewOptions;
use super::planted_faults::{FaultPlanter, FaultShortage, QueueError};
use super::routes;
use super::state::ServerState;
use super::unstored::UnstoredEvents;
use crate::local_server::{AccessControl, ConnectionLimits, WorkFailed, WorkThread, listen, serve};
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::explained_by_cause;
use mocban_store::Project;

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
    /// The catalog cannot be read.
    #[error("cannot read the review queue: {0}")]
    Catalog(#[source] CatalogError),
    /// An attention check could not be planted.
    #[error("cannot plant an attention check: {0}")]
    Fault(WorkFailed),
}

explained_by_cause! { ReviewError: Catalog }

/// A server that is bound and ready to serve.
#[derive(Debug)]
pub struct ReviewServer {
    listener: TcpListener,
    state: Arc<ServerState>,
    address: SocketAddr,
    counts: QueueCounts,
    shortage: Option<FaultShortage>,
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
    let name = origin_name(&project, &options.queue.reviewer);
    let listener = listen(address, &name).await.map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let quick = Arc::new(WorkThread::default());
    let (read, files) = (catalog.clone(), project.clone());
    let state = ServerState {
        planter: FaultPlanter::new(read.clone(), files.clone(), Arc::clone(&quick)),
        images: ImageCache::new(read, files, options.limits, quick),
        access: Arc::new(AccessControl::new("review", address).map_err(ReviewError::Token)?),
        catalog,
        project,
        options,
        unstored: UnstoredEvents::default(),
        served_items: std::sync::Mutex::default(),
    };
    // Loads the items now: after a restart, a page may resend an answer before it requests the queue.
    let queue = state.load_queue().await.map_err(|error| match error {
        QueueError::Catalog(error) => ReviewError::Catalog(error),
        QueueError::Stopped(error) => ReviewError::Fault(error),
    })?;
    let count =
        |is: &dyn Fn(&ReviewItem) -> bool| queue.items.iter().filter(|item| is(item)).count();
    Ok(ReviewServer {
        counts: QueueCounts {
            items: queue.items.len(),
            results: count(&|item| item.check.is_none()),
            answered: count(&|item| queue.history.answer(item).is_some()),
        },
        shortage: queue.shortage,
        listener,
        state: Arc::new(state),
        address,
    })
}

impl ReviewServer {
    /// Returns the start URL with the one-time token.
    pub fn url(&self) -> String {
        self.state.access.url()
    }

    /// Returns the bound address.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the number of items in the queue.
    pub const fn counts(&self) -> QueueCounts {
        self.counts
    }

    /// Returns whether fewer faults could be planted than wanted.
    pub const fn shortage(&self) -> Option<&FaultShortage> {
        self.shortage.as_ref()
    }

    /// Serves requests until `stop` completes, and then at most two seconds longer. Returns the number of requests that
    /// were cut off without a response, or that browsers keep because they are not stored.
    pub async fn serve(self, stop: impl Future<Output = ()>) -> usize {
        let router = routes::router(&self.state);
        let cut_off = serve(self.listener, router, ConnectionLimits::system(), stop).await;
        cut_off + self.state.unstored.count()
    }
}

/// Returns a name that is the same on every start for a project and reviewer. The browser keeps unsaved answers per
/// origin, so a restarted server needs the same port to receive these answers.
fn origin_name(project: &Project, reviewer: &str) -> String {
    let dir = project.dir();
    let dir = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    format!("{}\0{reviewer}", dir.display())
}
