//! Request handlers. Every request has passed the guard before it arrives here.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, RawQuery, State};
use axum::http::{HeaderMap, header};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router, middleware};
use serde_json::{Value, json};

use super::alignment_editor::{self, AlignmentBody, AlignmentSummary};
use super::answer::{AnswerBody, UndoBody};
use super::api_error::{self, ApiError};
use super::history::ReviewerHistory;
use super::i18n::Language;
use super::item::ReviewItem;
use super::item_images::ImageLayer;
use super::page;
use super::state::ServerState;
use super::summary::ReviewSummary;
use super::unstored::confirmation_limit;
use super::{assets, examples};
use crate::embedded;
use crate::local_server::AccessControl;
use mocban_catalog::{CatalogError, ManualAlignment};
use mocban_core::domain::{PairName, ReviewOrder, one_line};

/// Returns all routes.
pub(super) fn router(state: &Arc<ServerState>) -> Router {
    Router::new()
        .route("/", get(index))
        .route("/assets/{name}", get(asset))
        .route("/image/{id}/{layer}", get(image))
        .route("/scan/{id}", get(scan))
        .route("/api/config", get(config))
        .route("/api/queue", get(queue))
        .route("/api/summary", get(summary))
        .route("/api/details/{id}", get(details))
        .route("/api/find/{pair}", get(find))
        .route("/api/alignment/{id}", get(alignment))
        .route("/api/answer", post(answer))
        .route("/api/undo", post(undo))
        .route("/api/align", post(align))
        .layer(middleware::map_response_with_state(
            Arc::clone(state),
            api_error::explain,
        ))
        .with_state(Arc::clone(state))
}

type ApiResult<T = Json<Value>> = Result<T, ApiError>;

async fn index(
    State(state): State<Arc<ServerState>>,
    RawQuery(query): RawQuery,
    headers: HeaderMap,
) -> Html<String> {
    let asked = Language::asked_for(query.as_deref());
    let language = asked.unwrap_or_else(|| language(&state, &headers));
    let options = &state.options;
    Html(page::review(&options.queue, options.project_page, language).into_string())
}

/// Returns the language of the options, or else that of the browser.
fn language(state: &ServerState, headers: &HeaderMap) -> Language {
    let accepted = headers.get(header::ACCEPT_LANGUAGE);
    let of_browser = accepted.and_then(|value| Language::accepted(value.to_str().ok()?));
    let chosen = state.options.language.or(of_browser);
    chosen.unwrap_or(Language::English)
}

async fn asset(Path(name): Path<String>) -> Response {
    embedded::asset(&assets::ASSETS, &name)
}

/// Returns the values that the script needs at the start, such as the CSRF token, the key bindings and the messages.
async fn config(
    State(state): State<Arc<ServerState>>,
    Extension(access): Extension<Arc<AccessControl>>,
) -> Json<Value> {
    let messages = Language::ALL.map(|language| (language.name(), language.messages()));
    Json(json!({
        "csrf_token": access.csrf_token(),
        "keys": state.options.keys,
        "review_order": state.options.queue.order,
        "min_view_ms": state.options.min_view_ms,
        // Longer than the server waits for the catalog.
        "send_limit_ms": 3 * confirmation_limit().as_millis() as u64 / 2,
        "examples": examples::EXAMPLES,
        "messages": BTreeMap::from(messages),
    }))
}

async fn queue(State(state): State<Arc<ServerState>>) -> ApiResult {
    let queue = state.load_queue().await?;
    let hides_pairs = state.options.queue.has_attention_checks();
    let items = queue.items.iter().map(|item| {
        let answer = queue.history.answer(item).map(|answer| {
            json!({
                "event": answer.event, "verdict": answer.verdict, "reason": answer.reason,
                "note": answer.note, "at": answer.at,
            })
        });
        let alignment = queue.history.alignment(item);
        json!({
            "id": item.id,
            "pair": (!hides_pairs).then_some(&item.pair),
            "answer": answer,
            "manual_alignment": alignment.and_then(|made| AlignmentSummary::of(item, made)),
        })
    });
    let pairs: BTreeSet<&PairName> = queue.items.iter().map(|item| &item.pair).collect();
    Ok(Json(json!({
        "items": items.collect::<Vec<_>>(),
        "pairs": pairs,
        "opens_guide": state.options.opens_guide && queue.history.is_empty(),
        "fault_shortage": queue.shortage.as_ref().map(|shortage| {
            json!({ "made": shortage.planted, "wanted": shortage.wanted })
        }),
    })))
}

/// Returns the summary of a review in which every item is answered.
async fn summary(State(state): State<Arc<ServerState>>) -> ApiResult {
    let queue = state.load_queue().await?;
    let summary = ReviewSummary::read(&state, &queue).await?;
    Ok(Json(json!(summary.ok_or(ApiError::NotFinished)?)))
}

/// Returns the first item of a pair. A later item would reveal that the first has a duplicate.
async fn find(State(state): State<Arc<ServerState>>, Path(pair): Path<String>) -> ApiResult {
    let queue = state.load_queue().await?;
    let mut items = queue.items.iter();
    let first = items.find(|item| item.pair.as_str() == pair);
    Ok(Json(json!({ "id": first.ok_or(ApiError::NoItem)?.id })))
}

async fn image(
    State(state): State<Arc<ServerState>>,
    Path((id, layer)): Path<(String, String)>,
) -> ApiResult<Response> {
    let layer: Option<ImageLayer> = serde_json::from_value(layer.into()).ok();
    let layer = layer.ok_or(ApiError::NoItem)?;
    if let Some((kind, bytes)) = examples::layer(&id, layer) {
        return Ok(([(header::CONTENT_TYPE, kind)], bytes).into_response());
    }
    let item = served_item(&state, &id)?;
    let png = state.images.layer(&item, layer).await?;
    let kind = [(header::CONTENT_TYPE, "image/png")];
    Ok((kind, png).into_response())
}

async fn scan(
    State(state): State<Arc<ServerState>>,
    Path(id): Path<String>,
) -> ApiResult<Response> {
    let item = served_item(&state, &id)?;
    let data = state.images.scan_view(&item).await?;
    let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((kind, data).into_response())
}

/// Returns the pair, metrics and scores of an answered item, without revealing whether the item is an attention check.
async fn details(State(state): State<Arc<ServerState>>, Path(id): Path<String>) -> ApiResult {
    let item = served_item(&state, &id)?;
    let history = ReviewerHistory::read(&state.catalog, &state.options.queue).await?;
    if history.answer(&item).is_none() {
        return Err(ApiError::NotAnswered);
    }
    let images = state.images.of(&item).await?;
    let scores = images.scores;
    let metrics = item.results.iter().map(|(metric, _)| metric.title());
    let others = match state.options.queue.order {
        ReviewOrder::Adjudicate => other_verdicts(&state, &item).await?,
        // The verdicts of other reviewers are on genuine results, so they could reveal a planted fault.
        ReviewOrder::Random | ReviewOrder::LeastConfident => Vec::new(),
    };
    Ok(Json(json!({
        "pair": item.pair, "metrics": metrics.collect::<Vec<_>>(), "iou": scores.iou, "dice": scores.dice, "others": others,
    })))
}

/// Returns the distinct verdicts of other reviewers on an item's results.
async fn other_verdicts(
    state: &ServerState,
    item: &ReviewItem,
) -> Result<Vec<Value>, CatalogError> {
    let log = state.catalog.verdict_log(Some(&item.pair)).await?;
    let is_on_item = |hash| item.results.iter().any(|(_, of_item)| *of_item == hash);
    let mut verdicts: Vec<Value> = Vec::new();
    for event in log {
        let is_other = event.reviewer != state.options.queue.reviewer && event.undone_at.is_none();
        let verdict = json!({
            "reviewer": one_line(&event.reviewer), "verdict": event.verdict, "reason": event.reason,
            "note": event.note.as_deref().map(one_line),
        });
        if is_other && is_on_item(event.result_hash) && !verdicts.contains(&verdict) {
            verdicts.push(verdict);
        }
    }
    Ok(verdicts)
}

/// Returns the initial state of the alignment editor.
async fn alignment(State(state): State<Arc<ServerState>>, Path(id): Path<String>) -> ApiResult {
    let item = served_item(&state, &id)?;
    // The images may be cached.
    state.images.require_current(&item).await?;
    let images = state.images.of(&item).await?;
    let history = ReviewerHistory::read(&state.catalog, &state.options.queue).await?;
    let start = alignment_editor::start(&item, &images, history.alignment(&item));
    Ok(Json(json!(start)))
}

async fn answer(
    State(state): State<Arc<ServerState>>,
    body: Result<Json<AnswerBody>, JsonRejection>,
) -> ApiResult {
    let Json(body) = body?;
    let item = served_item(&state, &body.item)?;
    let verdict = body.verdict(&item, &state)?;
    let stored = state
        .catalog
        .answer(verdict, item.shown(), (state.options.now)());
    let is_new = state.unstored.store(&body.event, stored).await?;
    Ok(Json(json!({ "stored": body.event, "new": is_new })))
}

async fn undo(
    State(state): State<Arc<ServerState>>,
    body: Result<Json<UndoBody>, JsonRejection>,
) -> ApiResult {
    let Json(body) = body?;
    let reviewer = &state.options.queue.reviewer;
    let now = (state.options.now)();
    let undone = state.catalog.undo_event(&body.event, reviewer, now);
    state.unstored.store(&body.event, undone).await?;
    Ok(Json(json!({ "undone": body.event })))
}

async fn align(
    State(state): State<Arc<ServerState>>,
    body: Result<Json<AlignmentBody>, JsonRejection>,
) -> ApiResult {
    let Json(body) = body?;
    let item = served_item(&state, &body.item)?;
    let images = state.images.of(&item).await?;
    let print_from_depth = body.print_from_depth(&images)?;
    // One read of the results, because a run may store new ones at any time.
    let placed = state.images.place(&item, print_from_depth).await?;
    let record = ManualAlignment {
        note: body.note()?,
        event: body.event,
        pair: item.pair.clone(),
        reviewer: state.options.queue.reviewer.clone(),
        print_from_depth,
        print_from_mesh: placed.print_from_mesh,
        mesh_hash: placed.mesh_hash,
        print_hash: item.view.print_hash,
        depth_hash: item.view.depth_hash,
        seen: item.view.hash(),
        iou: placed.scores.iou,
        dice: placed.scores.dice,
    };
    let summary = json!(AlignmentSummary::of(&item, &record));
    let now = (state.options.now)();
    let event = record.event.clone();
    let stored = state.catalog.store_manual_alignment(record, now);
    state.unstored.store(&event, stored).await?;
    Ok(Json(summary))
}

fn served_item(state: &ServerState, id: &str) -> Result<Arc<ReviewItem>, ApiError> {
    state.item(id).ok_or(ApiError::NoItem)
}
