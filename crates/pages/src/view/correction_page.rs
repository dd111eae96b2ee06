//! The page on which a person chooses the same places on the relief and on the page of a block.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use axum::body::Bytes;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, RawQuery, State};
use axum::http::StatusCode;
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use serde::Deserialize;
use serde_json::json;

use super::block_access::BlockAccess;
use super::block_points::PointsSaved;
use super::page;
use super::read_once::ReadOnce;
use super::refusal::{refused, unavailable};
use super::scan_page::jpeg;
use crate::local_server::{AccessControl, WorkThread};
use crate::review::Language;
use mocban_core::domain::{BlockName, BlockSide, ContentHash, ControlPoints};
use mocban_core::locked;
use mocban_export::block_view::{BlockCorrection, PicturePoint, TriedAlignment};

/// Number of the last alignment that was tried on any page: if a block is opened again, a page that was opened before does not
/// take the alignment of another page for its own.
static LAST_TRIED: AtomicU64 = AtomicU64::new(0);

/// The state of the page.
struct CorrectionState {
    block: BlockName,
    language: Option<Language>,
    store: BlockAccess,
    work: Arc<WorkThread>,
    /// The block, which is read when the page is opened.
    shown: ReadOnce<BlockCorrection>,
    /// The last alignment that was tried and accepted, with its number.
    tried: Mutex<(u64, Option<Arc<TriedAlignment>>)>,
}

/// Points as the page sends them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PointsBody {
    side: BlockSide,
    points: Vec<PicturePoint>,
}

/// The alignment whose points are stored, and the hash of the stored points that the page has shown.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SaveBody {
    id: u64,
    saved_hash: Option<ContentHash>,
}

/// The hash of the stored points that the page has shown, which are removed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RemoveBody {
    saved_hash: Option<ContentHash>,
}

type CorrectionPage = State<Arc<CorrectionState>>;

/// Returns the routes of the page of a block.
pub(super) fn routes(
    block: BlockName,
    store: BlockAccess,
    work: Arc<WorkThread>,
    language: Option<Language>,
) -> Router {
    let state = CorrectionState {
        block,
        language,
        store,
        work,
        shown: ReadOnce::default(),
        tried: Mutex::default(),
    };
    Router::new()
        .route("/correct", get(index))
        .route("/correct/block.json", get(block_json))
        .route("/correct/face/{side}/{turns}", get(face))
        .route("/correct/page", get(page_image))
        .route("/correct/overlay/{id}", get(overlay))
        .route("/correct/try", post(try_points))
        .route("/correct/save", post(save))
        .route("/correct/remove", post(remove))
        .with_state(Arc::new(state))
}

impl CorrectionState {
    /// Returns the block, which is read if it was not yet.
    async fn shown(&self) -> Result<Arc<BlockCorrection>, Response> {
        let shown = self.shown.get(|| self.store.read_correction()).await;
        shown.map_err(|why| unavailable(&why))
    }

    /// Returns the alignment with a number, if no other one was tried since.
    fn tried(&self, id: u64) -> Option<Arc<TriedAlignment>> {
        let tried = locked(&self.tried);
        tried.1.clone().filter(|_| tried.0 == id)
    }

    /// Keeps an alignment, and returns its number.
    fn set_tried(&self, alignment: Option<TriedAlignment>) -> u64 {
        let id = LAST_TRIED.fetch_add(1, Ordering::Relaxed) + 1;
        let mut tried = locked(&self.tried);
        *tried = (id, alignment.map(Arc::new));
        id
    }

    /// Stores points, and responds.
    async fn store_points(
        &self,
        read: Option<ContentHash>,
        points: Option<ControlPoints>,
    ) -> Response {
        let saved_hash = points.as_ref().map(ControlPoints::hash);
        match self.store.save_points(read, points).await {
            Ok(PointsSaved::Saved) => {
                self.shown.forget().await;
                let next = self.store.next_command();
                Json(json!({"next": next, "saved_hash": saved_hash})).into_response()
            }
            Ok(PointsSaved::OthersSaved) => refused(
                StatusCode::CONFLICT,
                "the points of this block were changed since this page was opened: reload the page to see them",
            ),
            Ok(PointsSaved::FileReplaced(path)) => {
                let path = path.display();
                let why = format!(
                    "{path} was replaced since this page was opened: reload the page, and choose the points again"
                );
                refused(StatusCode::CONFLICT, &why)
            }
            Err(why) => unavailable(&why),
        }
    }
}

async fn index(State(state): CorrectionPage, RawQuery(query): RawQuery) -> Html<String> {
    let (block, back) = (state.block.as_str(), state.store.back());
    let language = Language::asked_for(query.as_deref()).or(state.language);
    Html(page::correction(block, language, back))
}

async fn block_json(
    State(state): CorrectionPage,
    Extension(access): Extension<Arc<AccessControl>>,
) -> Response {
    // The block may have run, or its files may have changed, since the page was opened before.
    match state.shown.refresh(|_| state.store.read_correction()).await {
        Ok(shown) => {
            let mut value = shown.to_json();
            value["csrf_token"] = json!(access.csrf_token());
            Json(value).into_response()
        }
        Err(why) => unavailable(&why),
    }
}

/// Responds with the relief of a side after a number of quarter turns, clockwise.
async fn face(State(state): CorrectionPage, Path((side, turns)): Path<(String, u8)>) -> Response {
    let Ok(side) = side.parse::<BlockSide>() else {
        return StatusCode::NOT_FOUND.into_response();
    };
    image(&state, move |shown| shown.face_jpeg(side, turns)).await
}

async fn page_image(State(state): CorrectionPage) -> Response {
    image(&state, |shown| Some(shown.page_jpeg())).await
}

async fn overlay(State(state): CorrectionPage, Path(id): Path<u64>) -> Response {
    let tried = state.tried(id);
    image(&state, move |_| tried.map(|tried| tried.overlay.clone())).await
}

/// Aligns from points. An alignment that is accepted is kept for `save`.
async fn try_points(
    State(state): CorrectionPage,
    body: Result<Json<PointsBody>, JsonRejection>,
) -> Response {
    let body = match body {
        Ok(Json(body)) => body,
        Err(rejection) => return refused(rejection.status(), &rejection.to_string()),
    };
    let shown = match state.shown().await {
        Ok(shown) => shown,
        Err(failed) => return failed,
    };
    let tried = move || shown.try_points(body.side, &body.points);
    match state.work.call(tried).await {
        Ok(Ok(tried)) => {
            let agreement = tried.agreement;
            let id = state.set_tried(Some(tried));
            Json(json!({"agreement": agreement, "id": id})).into_response()
        }
        Ok(Err(error)) => {
            state.set_tried(None);
            refused(StatusCode::UNPROCESSABLE_ENTITY, &error.to_string())
        }
        Err(error) => unavailable(&error.to_string()),
    }
}

/// Stores the points of an alignment that was tried.
async fn save(
    State(state): CorrectionPage,
    body: Result<Json<SaveBody>, JsonRejection>,
) -> Response {
    let SaveBody { id, saved_hash } = match body {
        Ok(Json(body)) => body,
        Err(rejection) => return refused(rejection.status(), &rejection.to_string()),
    };
    match state.tried(id) {
        Some(tried) => {
            let points = Some(tried.points.clone());
            state.store_points(saved_hash, points).await
        }
        None => refused(
            StatusCode::CONFLICT,
            "the page was opened again, or other points were tried: try these again before saving them",
        ),
    }
}

async fn remove(
    State(state): CorrectionPage,
    body: Result<Json<RemoveBody>, JsonRejection>,
) -> Response {
    match body {
        Ok(Json(body)) => {
            state.set_tried(None);
            state.store_points(body.saved_hash, None).await
        }
        Err(rejection) => refused(rejection.status(), &rejection.to_string()),
    }
}

/// Reads the block, and responds with an image that is drawn from it.
async fn image(
    state: &CorrectionState,
    draw: impl FnOnce(&BlockCorrection) -> Option<Vec<u8>> + Send + 'static,
) -> Response {
    let shown = match state.shown().await {
        Ok(shown) => shown,
        Err(failed) => return failed,
    };
    jpeg(&state.work, move || draw(&shown).map(Bytes::from)).await
}
