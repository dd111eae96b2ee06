//! The page on which a person changes the boxes of the characters of a block.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::rejection::JsonRejection;
use axum::extract::{RawQuery, State};
use axum::http::StatusCode;
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use serde::Deserialize;
use serde_json::json;

use super::block_access::BlockAccess;
use super::block_labels::BoxesSaved;
use super::page;
use super::read_once::ReadOnce;
use super::refusal::{refused, unavailable};
use super::scan_page::jpeg;
use crate::local_server::{AccessControl, WorkThread};
use crate::messages::vietnamese;
use crate::review::Language;
use mocban_core::domain::{BlockName, ContentHash};
use mocban_export::block_view::{BoxEdits, EditableBoxes};

/// The state of the page.
struct BoxesState {
    block: BlockName,
    language: Option<Language>,
    store: BlockAccess,
    work: Arc<WorkThread>,
    /// The page with its boxes, which is read when it is opened.
    shown: ReadOnce<EditableBoxes>,
}

/// Changes of the boxes, and the hash of what the page has shown.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxesBody {
    shown: ContentHash,
    edits: BoxEdits,
}

/// The hash of what the page has shown, to go back to the earlier labels.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EarlierBody {
    shown: ContentHash,
}

type BoxesPage = State<Arc<BoxesState>>;

/// Returns the routes of the page of a block.
pub(super) fn routes(
    block: BlockName,
    store: BlockAccess,
    work: Arc<WorkThread>,
    language: Option<Language>,
) -> Router {
    let state = BoxesState {
        block,
        language,
        store,
        work,
        shown: ReadOnce::default(),
    };
    Router::new()
        .route("/boxes", get(index))
        .route("/boxes/block.json", get(block_json))
        .route("/boxes/page", get(page_image))
        .route("/boxes/save", post(save))
        .route("/boxes/earlier", post(use_earlier))
        .with_state(Arc::new(state))
}

impl BoxesState {
    /// Returns the page with its boxes, which is read if it was not yet.
    async fn shown(&self) -> Result<Arc<EditableBoxes>, Response> {
        let shown = self.shown.get(|| self.store.read_boxes(None)).await;
        shown.map_err(|why| unavailable(&why))
    }

    /// Stores boxes, and responds.
    async fn store(&self, shown: ContentHash, edits: Option<BoxEdits>) -> Response {
        let known = self.shown.known().await;
        match self.store.save_boxes(known, shown, edits).await {
            Ok(BoxesSaved::Saved) => {
                Json(json!({"is_saved": true, "next": self.store.next_command()})).into_response()
            }
            Ok(BoxesSaved::Unchanged) => Json(json!({"is_saved": false})).into_response(),
            Ok(BoxesSaved::OthersSaved) => refused(
                StatusCode::CONFLICT,
                "the labels of this block were changed since this page was opened: reload the page",
            ),
            Ok(BoxesSaved::Refused(why)) => refused(StatusCode::UNPROCESSABLE_ENTITY, &why),
            Err(why) => unavailable(&why),
        }
    }
}

async fn index(State(state): BoxesPage, RawQuery(query): RawQuery) -> Html<String> {
    let language = Language::asked_for(query.as_deref()).or(state.language);
    let back = state.store.back();
    Html(page::boxes(state.block.as_str(), language, back))
}

async fn block_json(
    State(state): BoxesPage,
    Extension(access): Extension<Arc<AccessControl>>,
) -> Response {
    // The block may have run, or its files may have changed, since the page was opened before.
    match state
        .shown
        .refresh(|known| state.store.read_boxes(known))
        .await
    {
        Ok(shown) => {
            let mut value = shown.to_json();
            value["csrf_token"] = json!(access.csrf_token());
            let warnings = shown.warnings().iter();
            let warnings = warnings.map(|one| vietnamese(one).unwrap_or_else(|| one.clone()));
            value["warnings_vi"] = warnings.collect();
            Json(value).into_response()
        }
        Err(why) => unavailable(&why),
    }
}

async fn page_image(State(state): BoxesPage) -> Response {
    match state.shown().await {
        Ok(shown) => {
            let draw = move || Some(Bytes::from(shown.page_jpeg()));
            jpeg(&state.work, draw).await
        }
        Err(failed) => failed,
    }
}

async fn save(State(state): BoxesPage, body: Result<Json<BoxesBody>, JsonRejection>) -> Response {
    match body {
        Ok(Json(BoxesBody { shown, edits })) => state.store(shown, Some(edits)).await,
        Err(rejection) => refused(rejection.status(), &rejection.to_string()),
    }
}

/// Gives the block the labels that those of this page have replaced.
async fn use_earlier(
    State(state): BoxesPage,
    body: Result<Json<EarlierBody>, JsonRejection>,
) -> Response {
    match body {
        Ok(Json(EarlierBody { shown })) => state.store(shown, None).await,
        Err(rejection) => refused(rejection.status(), &rejection.to_string()),
    }
}
