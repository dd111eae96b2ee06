//! The page of a block: its layers as images, its characters, and the 3D views of their pairs.

use std::sync::{Arc, OnceLock};

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
use super::refusal::refused;
use super::scan_page::jpeg;
use crate::embedded::{self, EmbeddedAsset, SCRIPT, STYLE, embedded_asset};
use crate::local_server::WorkThread;
use crate::review::Language;
use mocban_core::domain::BlockName;
use mocban_export::block_view::{BlockView, PageLayer, PageRegion};

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
/// Longer side of the image of a whole layer or of a region, pixels. Closer views ask for regions, which show a smaller
/// part and so never have fewer pixels.
const LONGEST_SIDE: usize = 3000;

/// The block of a page, with the images of whole layers that were asked for.
#[derive(Debug)]
struct ShownBlock {
    view: BlockView,
    language: Option<Language>,
    back: Option<&'static str>,
    work: Arc<WorkThread>,
    overviews: [OnceLock<Bytes>; PageLayer::ALL.len()],
}

/// Returns the routes of the page of a block, of its correction and of its boxes. Without `view`, the correction is shown
/// first. A language in the address of a page, as in `?lang=vi`, is preferred to `language`; without both, the browser
/// decides.
pub(super) fn block_page(
    block: &BlockName,
    view: Option<BlockView>,
    store: BlockAccess,
    language: Option<Language>,
) -> Router {
    let work = store.work();
    let pages = match view {
        Some(view) => page_routes(view, language, store.back(), Arc::clone(&work)),
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

/// Returns the routes of the page of a block that is aligned.
fn page_routes(
    view: BlockView,
    language: Option<Language>,
    back: Option<&'static str>,
    work: Arc<WorkThread>,
) -> Router {
    let shown = ShownBlock {
        view,
        language,
        back,
        work,
        overviews: PageLayer::ALL.map(|_| OnceLock::new()),
    };
    Router::new()
        .route("/", get(index))
        .route("/block.json", get(block_json))
        .route("/layer/{layer}", get(overview))
        .route("/region/{layer}/{x}/{y}/{width}/{height}", get(region))
        .route("/scan/{index}", get(scan))
        .with_state(Arc::new(shown))
}

impl ShownBlock {
    /// Returns the image of a whole layer, which is drawn once.
    fn overview(&self, layer: PageLayer) -> Bytes {
        let stored = PageLayer::ALL.iter().zip(&self.overviews);
        let mut of_layer = stored.filter(|(one, _)| **one == layer);
        let draw = || self.picture(layer, self.view.layers.whole(), LONGEST_SIDE);
        match of_layer.next() {
            Some((_, stored)) => stored.get_or_init(draw).clone(),
            None => draw(),
        }
    }

    /// Draws a region of a layer as JPEG.
    fn picture(&self, layer: PageLayer, region: PageRegion, longest: usize) -> Bytes {
        self.view.layers.jpeg(layer, region, longest).into()
    }
}

async fn index(State(shown): State<Arc<ShownBlock>>, RawQuery(query): RawQuery) -> Html<String> {
    let language = Language::asked_for(query.as_deref()).or(shown.language);
    Html(page::block(shown.view.name.as_str(), language, shown.back))
}

async fn asset(Path(name): Path<String>) -> Response {
    embedded::asset(&ASSETS, &name)
}

async fn block_json(State(shown): State<Arc<ShownBlock>>) -> Response {
    let kind = [(header::CONTENT_TYPE, "application/json")];
    (kind, shown.view.to_json().to_string()).into_response()
}

async fn overview(State(shown): State<Arc<ShownBlock>>, Path(layer): Path<String>) -> Response {
    let Ok(layer) = layer.parse::<PageLayer>() else {
        return StatusCode::NOT_FOUND.into_response();
    };
    let work = Arc::clone(&shown.work);
    jpeg(&work, move || Some(shown.overview(layer))).await
}

async fn region(
    State(shown): State<Arc<ShownBlock>>,
    Path((layer, x, y, width, height)): Path<(String, usize, usize, usize, usize)>,
) -> Response {
    let region = PageRegion {
        corner: [x, y],
        size: [width, height],
    };
    let part = region.within(shown.view.layers.size());
    match (layer.parse::<PageLayer>(), part) {
        (Ok(layer), Some(part)) => {
            let work = Arc::clone(&shown.work);
            jpeg(&work, move || {
                Some(shown.picture(layer, part, LONGEST_SIDE))
            })
            .await
        }
        _ => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn scan(State(shown): State<Arc<ShownBlock>>, Path(index): Path<usize>) -> Response {
    let work = Arc::clone(&shown.work);
    let read = work.call(move || shown.view.scan(index));
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
