//! The page of a block: its layers as images, its characters, and the 3D views of their pairs.

use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path, RawQuery, State};
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse as _, Redirect, Response};
use axum::routing::get;

use super::block_access::BlockAccess;
use super::boxes_page;
use super::correction_page;
use super::page;
use super::refusal::{refused, unavailable};
use super::shown_block::ShownBlock;
use crate::embedded::{self, EmbeddedAsset, SCRIPT, STYLE, embedded_asset};
use crate::review::Language;
use mocban_core::domain::BlockName;
use mocban_export::block_view::{PageLayer, PageRegion};

/// The assets of this page.
const ASSETS: [EmbeddedAsset; 10] = [
    embedded_asset!("block-view", "block-view.js", SCRIPT),
    embedded_asset!("block-view", "block-correct.js", SCRIPT),
    embedded_asset!("block-view", "block-boxes.js", SCRIPT),
    embedded_asset!("block-view", "box-edits.js", SCRIPT),
    embedded_asset!("block-view", "box-messages.js", SCRIPT),
    embedded_asset!("block-view", "block-messages.js", SCRIPT),
    embedded_asset!("block-view", "block-request.js", SCRIPT),
    embedded_asset!("block-view", "block-shapes.js", SCRIPT),
    embedded_asset!("block-view", "block-camera.js", SCRIPT),
    embedded_asset!("block-view", "block-view.css", STYLE),
];

/// Returns the routes of the page of a block, of its correction and of its boxes. Without `view`, the correction is shown
/// first. A language in the address of a page, as in `?lang=vi`, is preferred to `language`; without both, the browser
/// decides.
pub(super) fn block_page(
    block: &BlockName,
    view: Option<Arc<ShownBlock>>,
    store: BlockAccess,
    language: Option<Language>,
) -> Router {
    let work = store.work();
    let pages = match view {
        Some(view) => page_routes(view, language, store.back()),
        None => Router::new().route("/", get(async || Redirect::to("correct"))),
    };
    pages
        .route("/assets/{name}", get(asset))
        .merge(boxes_page::routes(
            block.clone(),
            store.clone(),
            Arc::clone(&work),
            language,
        ))
        .merge(correction_page::routes(
            block.clone(),
            store,
            work,
            language,
        ))
}

/// What the routes of the page of an aligned block share.
#[derive(Debug, Clone)]
struct BlockPageState {
    shown: Arc<ShownBlock>,
    language: Option<Language>,
    back: Option<&'static str>,
}

/// Returns the routes of the page of a block that is aligned.
fn page_routes(
    shown: Arc<ShownBlock>,
    language: Option<Language>,
    back: Option<&'static str>,
) -> Router {
    Router::new()
        .route("/", get(index))
        .route("/block.json", get(block_json))
        .route("/layer/{layer}", get(overview))
        .route("/layers", get(layers))
        .route("/region/{layer}/{x}/{y}/{width}/{height}", get(region))
        .route("/scan/{index}", get(scan))
        .with_state(BlockPageState {
            shown,
            language,
            back,
        })
}

async fn index(State(state): State<BlockPageState>, RawQuery(query): RawQuery) -> Html<String> {
    let language = Language::asked_for(query.as_deref()).or(state.language);
    let name = state.shown.pictures.block.name.as_str();
    Html(page::block(name, language, state.back))
}

async fn asset(Path(name): Path<String>) -> Response {
    embedded::asset(&ASSETS, &name)
}

async fn block_json(State(state): State<BlockPageState>) -> Response {
    match state.shown.pictures.page().await {
        Ok(page) => {
            let kind = [(header::CONTENT_TYPE, "application/json")];
            let shown = state.shown.pictures.block.to_json(page.size());
            (kind, shown.to_string()).into_response()
        }
        Err(why) => unavailable(&why),
    }
}

async fn overview(State(state): State<BlockPageState>, Path(layer): Path<String>) -> Response {
    match layer.parse::<PageLayer>() {
        Ok(layer) => picture(state.shown.pictures.overview(layer).await),
        Err(_) => StatusCode::NOT_FOUND.into_response(),
    }
}

/// Begins to read the files of the layers, because the page shows enough.
async fn layers(State(state): State<BlockPageState>) -> StatusCode {
    state.shown.read_layers();
    StatusCode::NO_CONTENT
}

async fn region(
    State(state): State<BlockPageState>,
    Path((layer, x, y, width, height)): Path<(String, usize, usize, usize, usize)>,
) -> Response {
    let region = PageRegion {
        corner: [x, y],
        size: [width, height],
    };
    match layer.parse::<PageLayer>() {
        Ok(layer) => picture(state.shown.region(layer, region).await),
        Err(_) => StatusCode::NOT_FOUND.into_response(),
    }
}

/// Responds with a picture, or that there is none, or why it cannot be drawn.
fn picture(drawn: Result<Option<Bytes>, String>) -> Response {
    match drawn {
        Ok(Some(jpeg)) => ([(header::CONTENT_TYPE, "image/jpeg")], jpeg).into_response(),
        Ok(None) => StatusCode::NOT_FOUND.into_response(),
        Err(why) => unavailable(&why),
    }
}

async fn scan(State(state): State<BlockPageState>, Path(index): Path<usize>) -> Response {
    let shown = Arc::clone(&state.shown.pictures);
    let read = state
        .shown
        .pictures
        .work
        .call(move || shown.block.scan(index));
    let failed = |why: String| refused(StatusCode::INTERNAL_SERVER_ERROR, &why);
    match read.await {
        Ok(Ok(Some(bytes))) => {
            let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
            (kind, bytes).into_response()
        }
        Ok(Ok(None)) => StatusCode::NOT_FOUND.into_response(),
        Ok(Err(error)) => failed(error.to_string()),
        Err(error) => failed(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::ASSETS;
    use crate::local_server::assert_loads_nothing;

    #[test]
    fn assets_refer_to_no_other_host() {
        for (name, _, text) in ASSETS {
            assert_loads_nothing(name, text);
        }
    }
}
