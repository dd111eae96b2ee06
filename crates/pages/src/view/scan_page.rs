//! The page of a pair: its scan on its print in 3D.

use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;

use super::page;
use crate::embedded::{self, EmbeddedAsset, SCRIPT, embedded_asset};
use crate::local_server::WorkThread;
use crate::review::Language;
use mocban_export::scan_view::ScanView;

/// The script of the page.
const VIEW: EmbeddedAsset = embedded_asset!("scan-viewer", "view.js", SCRIPT);

/// The scan of a page.
#[derive(Debug)]
struct ShownScan {
    pair: String,
    language: Option<Language>,
    data: Bytes,
}

/// Returns the routes of the view of a pair. Without a language, the browser decides.
pub fn scan_page(pair: &str, view: &ScanView, language: Option<Language>) -> Router {
    let shown = ShownScan {
        pair: pair.to_owned(),
        language,
        data: view.to_bytes().into(),
    };
    Router::new()
        .route("/", get(index))
        .route("/assets/{name}", get(asset))
        .route("/scan", get(scan))
        .with_state(Arc::new(shown))
}

async fn index(State(shown): State<Arc<ShownScan>>) -> Html<String> {
    Html(page::view(&shown.pair, shown.language, None))
}

/// Responds with a script or style of the page.
pub(crate) async fn asset(Path(name): Path<String>) -> Response {
    embedded::asset(&[VIEW], &name)
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
