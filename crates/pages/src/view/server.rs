//! The server: binds the port, and serves the page and its data until it is stopped.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::{Extension, Router};
use tokio::net::TcpListener;

use super::page;
use crate::local_server::{AccessControl, ConnectionLimits, WorkThread, listen, serve};
use crate::review::Language;
use mocban_core::domain::Explained;
use mocban_export::scan_view::{ScanView, assets};

/// The script of the page.
const SCRIPT: &str = include_str!("../../../../assets/scan-viewer/view.js");

/// Why the server cannot start.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
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

impl Explained for ViewError {}

/// A server that is bound and ready to serve.
#[derive(Debug)]
pub struct ViewServer {
    listener: TcpListener,
    access: Arc<AccessControl>,
    pages: Router,
}

/// The scan of a page.
#[derive(Debug)]
struct ShownScan {
    pair: String,
    language: Option<Language>,
    data: Bytes,
}

/// Binds the address for the view of a pair. Port 0 chooses the same port for equal names of pairs, if it is free. Without a
/// language, the browser decides.
///
/// # Errors
/// Returns an error if the address cannot be bound or the system provides no randomness.
pub async fn bind(
    address: SocketAddr,
    pair: &str,
    view: &ScanView,
    language: Option<Language>,
) -> Result<ViewServer, ViewError> {
    let shown = ShownScan {
        pair: pair.to_owned(),
        language,
        data: view.to_bytes().into(),
    };
    let pages = Router::new()
        .route("/", get(index))
        .route("/assets/{name}", get(asset))
        .route("/scan", get(scan))
        .with_state(Arc::new(shown));
    ViewServer::open(address, pair, pages).await
}

impl ViewServer {
    /// Binds the address for pages without a start address. Port 0 chooses the same port for equal names, if it is free.
    ///
    /// # Errors
    /// Returns an error if the address cannot be bound or the system provides no randomness.
    pub(super) async fn open(
        address: SocketAddr,
        name: &str,
        pages: Router,
    ) -> Result<Self, ViewError> {
        let failed = |source| ViewError::Listen { address, source };
        let listener = listen(address, name).await.map_err(failed)?;
        let bound = listener.local_addr().map_err(failed)?;
        let access = AccessControl::new("view", bound).map_err(ViewError::Token)?;
        Ok(Self {
            listener,
            access: Arc::new(access),
            pages,
        })
    }

    /// Returns the start URL with the one-time token.
    pub fn url(&self) -> String {
        self.access.url()
    }

    /// Serves requests until `stop` completes, and then at most two seconds longer.
    pub async fn serve(self, stop: impl Future<Output = ()>) {
        let access = Extension(Arc::clone(&self.access));
        let router = self.access.guarded(self.pages.layer(access));
        serve(self.listener, router, ConnectionLimits::system(), stop).await;
    }
}

async fn index(State(shown): State<Arc<ShownScan>>) -> Html<String> {
    Html(page::view(&shown.pair, shown.language))
}

async fn asset(Path(name): Path<String>) -> Response {
    let own = (name == "view.js").then_some(("text/javascript; charset=utf-8", SCRIPT));
    match own.or_else(|| assets::find(&name)) {
        Some((kind, text)) => ([(header::CONTENT_TYPE, kind)], text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn scan(State(shown): State<Arc<ShownScan>>) -> Response {
    let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
    (kind, shown.data.clone()).into_response()
}

/// Draws an image on the thread for long work and responds with it, or that there is none.
pub(super) async fn jpeg(
    work: &WorkThread,
    draw: impl FnOnce() -> Option<Bytes> + Send + 'static,
) -> Response {
    match work.call(draw).await {
        Ok(Some(jpeg)) => ([(header::CONTENT_TYPE, "image/jpeg")], jpeg).into_response(),
        Ok(None) => StatusCode::NOT_FOUND.into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}
