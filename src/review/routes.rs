//! What the server answers, address by address. Whoever comes here has passed the guard.

use std::collections::BTreeSet;
use std::sync::Arc;

use axum::extract::rejection::JsonRejection;
use axum::extract::{DefaultBodyLimit, Path, RawQuery, State};
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse, Redirect, Response};
use axum::routing::{get, post};
use axum::{Json, Router, middleware};
use serde_json::{Value, json};

use super::answer::{AnswerBody, BadAnswer, UndoBody};
use super::assets;
use super::card::Card;
use super::correction::{self, AlignBody, Corrected};
use super::deck::DeckError;
use super::desk::Desk;
use super::guard::{BODY_LIMIT, START, guard};
use super::known::Known;
use super::page;
use super::pictures::{Layer, PictureError};
use super::words::Language;
use crate::catalog::CatalogError;
use crate::domain::{PairName, ReviewOrder};
use crate::report::pair_artifacts::PairArtifactsError;

/// Everything there is, behind the guard.
pub(super) fn router(desk: &Arc<Desk>) -> Router {
    Router::new()
        .route(START, get(begin))
        .route("/", get(index))
        .route("/assets/{name}", get(asset))
        .route("/picture/{id}/{layer}", get(picture))
        .route("/api/boot", get(boot))
        .route("/api/deck", get(deck))
        .route("/api/about/{id}", get(about))
        .route("/api/find/{pair}", get(find))
        .route("/api/correction/{id}", get(correction_start))
        .route("/api/answer", post(answer))
        .route("/api/undo", post(undo))
        .route("/api/align", post(align))
        .layer(DefaultBodyLimit::max(BODY_LIMIT))
        .layer(middleware::from_fn_with_state(Arc::clone(desk), guard))
        .with_state(Arc::clone(desk))
}

/// Why a request cannot be answered.
#[derive(Debug, thiserror::Error)]
enum Trouble {
    #[error("there is no such card")]
    NoCard,
    #[error("answer it first")]
    NotAnswered,
    #[error("{0}")]
    Body(#[from] JsonRejection),
    #[error(transparent)]
    Answer(#[from] BadAnswer),
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(transparent)]
    Deck(#[from] DeckError),
    #[error(transparent)]
    Picture(#[from] PictureError),
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
}

impl Trouble {
    fn status(&self) -> StatusCode {
        match self {
            Self::NoCard | Self::Catalog(CatalogError::NothingToUndo(_)) => StatusCode::NOT_FOUND,
            Self::NotAnswered => StatusCode::FORBIDDEN,
            Self::Body(rejection) => rejection.status(),
            Self::Answer(_) => StatusCode::UNPROCESSABLE_ENTITY,
            Self::Picture(PictureError::Gone) => StatusCode::GONE,
            // The page sends again what the server could not store.
            Self::Catalog(_) | Self::Deck(_) | Self::Picture(_) | Self::PairArtifacts(_) => {
                StatusCode::SERVICE_UNAVAILABLE
            }
        }
    }
}

impl IntoResponse for Trouble {
    fn into_response(self) -> Response {
        let status = self.status();
        if status.is_server_error() {
            tracing::warn!(error = %self, "the review page was not answered");
        }
        (status, Json(json!({ "error": self.to_string() }))).into_response()
    }
}

type Answered<T = Json<Value>> = Result<T, Trouble>;

/// Takes the token and gives the cookie. A page that goes on by itself, not a redirect: the cookie goes only with
/// what begins on this site.
async fn begin(State(desk): State<Arc<Desk>>, RawQuery(query): RawQuery) -> Response {
    let query = query.unwrap_or_default();
    let token = query.strip_prefix("token=").unwrap_or_default();
    if desk.session.open(token) {
        let cookie = [(header::SET_COOKIE, desk.session.set_cookie())];
        return (cookie, Html(page::onward(desk.language).into_string())).into_response();
    }
    // An old address in the history of a browser that has the cookie leads on as well.
    if token.is_empty() {
        return Redirect::to("/").into_response();
    }
    let refused = page::refused(desk.language).into_string();
    (StatusCode::FORBIDDEN, Html(refused)).into_response()
}

async fn index(State(desk): State<Arc<Desk>>, RawQuery(query): RawQuery) -> Html<String> {
    let asked = query
        .as_deref()
        .and_then(|query| query.strip_prefix("lang="));
    let language = asked
        .and_then(|name| name.parse().ok())
        .unwrap_or(desk.language);
    Html(page::review(&desk, language).into_string())
}

async fn asset(Path(name): Path<String>) -> Response {
    match assets::find(&name) {
        Some((kind, text)) => ([(header::CONTENT_TYPE, kind)], text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

/// What the script starts from.
async fn boot(State(desk): State<Arc<Desk>>) -> Json<Value> {
    Json(json!({
        "word": desk.session.csrf(),
        "keys": desk.keys,
        "review_order": desk.deck_options.order,
        "min_view_ms": desk.min_view_ms,
        "words": Language::ALL.map(|language| (language.name(), language.words()))
            .into_iter().collect::<std::collections::BTreeMap<_, _>>(),
    }))
}

async fn deck(State(desk): State<Arc<Desk>>) -> Answered {
    let deck = desk.deal().await?;
    let hides_pairs = desk.deck_options.tests_the_reviewer();
    let items = deck.cards.iter().map(|card| {
        let answer = deck.known.answer(card).map(|answer| {
            json!({
                "event": answer.event, "verdict": answer.verdict, "reason": answer.reason,
                "note": answer.note, "at": answer.at,
            })
        });
        let correction = deck.known.correction(card);
        json!({
            "id": card.id,
            "pair": (!hides_pairs).then_some(&card.pair),
            "answer": answer,
            "corrected": correction.and_then(|made| Corrected::of(card, made)),
        })
    });
    let pairs: BTreeSet<&PairName> = deck.cards.iter().map(|card| &card.pair).collect();
    Ok(Json(
        json!({ "items": items.collect::<Vec<_>>(), "pairs": pairs }),
    ))
}

/// The first card of a pair, for who jumps to it; never one of its others, so that none tells that there are any.
async fn find(State(desk): State<Arc<Desk>>, Path(pair): Path<String>) -> Answered {
    let deck = desk.deal().await?;
    let mut cards = deck.cards.iter();
    let first = cards.find(|card| card.pair.as_str() == pair);
    Ok(Json(json!({ "id": first.ok_or(Trouble::NoCard)?.id })))
}

async fn picture(
    State(desk): State<Arc<Desk>>,
    Path((id, layer)): Path<(String, String)>,
) -> Answered<Response> {
    let card = card(&desk, &id)?;
    let layer = Layer::named(&layer).ok_or(Trouble::NoCard)?;
    let drawn = desk.pictures(&card).await?;
    let kind = [(header::CONTENT_TYPE, "image/png")];
    Ok((kind, drawn.layer(layer)).into_response())
}

/// What is told of a card once it is answered: for planted faults and repeats as for all others.
async fn about(State(desk): State<Arc<Desk>>, Path(id): Path<String>) -> Answered {
    let card = card(&desk, &id)?;
    let known = Known::read(&desk.catalog, &desk.deck_options).await?;
    if known.answer(&card).is_none() {
        return Err(Trouble::NotAnswered);
    }
    let drawn = desk.pictures(&card).await?;
    let agreement = correction::agreement(&drawn, &card.view.print_from_depth);
    let metrics = card.results.iter().map(|(metric, _)| metric.title());
    let others = match desk.deck_options.order {
        ReviewOrder::Adjudicate => others(&desk, &card).await?,
        // What others said of a planted fault does not exist, so it cannot be shown for anything.
        ReviewOrder::Random | ReviewOrder::LeastConfident => Vec::new(),
    };
    Ok(Json(json!({
        "pair": card.pair, "metrics": metrics.collect::<Vec<_>>(), "iou": agreement.iou, "dice": agreement.dice, "others": others,
    })))
}

/// What other reviewers said of a card's results.
async fn others(desk: &Desk, card: &Card) -> Result<Vec<Value>, CatalogError> {
    let log = desk.catalog.verdict_log(Some(&card.pair)).await?;
    let is_on_card = |hash| card.results.iter().any(|(_, of_card)| *of_card == hash);
    let mut said: Vec<Value> = Vec::new();
    for event in log {
        let is_other = event.reviewer != desk.deck_options.reviewer && event.undone_at.is_none();
        let line = json!({
            "reviewer": event.reviewer, "verdict": event.verdict, "reason": event.reason, "note": event.note,
        });
        if is_other && is_on_card(event.result_hash) && !said.contains(&line) {
            said.push(line);
        }
    }
    Ok(said)
}

async fn correction_start(State(desk): State<Arc<Desk>>, Path(id): Path<String>) -> Answered {
    let card = card(&desk, &id)?;
    let drawn = desk.pictures(&card).await?;
    let known = Known::read(&desk.catalog, &desk.deck_options).await?;
    let before = known.correction(&card);
    Ok(Json(json!(correction::start(&card, &drawn, before))))
}

async fn answer(
    State(desk): State<Arc<Desk>>,
    body: Result<Json<AnswerBody>, JsonRejection>,
) -> Answered {
    let Json(body) = body?;
    let card = card(&desk, &body.item)?;
    let verdict = body.verdict(&card, &desk)?;
    let stored = desk.catalog.answer(verdict, card.shown(), (desk.now)());
    let is_new = stored.await?;
    Ok(Json(json!({ "stored": body.event, "new": is_new })))
}

async fn undo(
    State(desk): State<Arc<Desk>>,
    body: Result<Json<UndoBody>, JsonRejection>,
) -> Answered {
    let Json(body) = body?;
    let reviewer = &desk.deck_options.reviewer;
    let taken = desk.catalog.take_back(&body.event, reviewer, (desk.now)());
    taken.await?;
    Ok(Json(json!({ "undone": body.event })))
}

async fn align(
    State(desk): State<Arc<Desk>>,
    body: Result<Json<AlignBody>, JsonRejection>,
) -> Answered {
    let Json(body) = body?;
    let card = card(&desk, &body.item)?;
    let drawn = desk.pictures(&card).await?;
    let map = body.print_from_depth(&drawn)?;
    let agreement = correction::agreement(&drawn, &map);
    let found = desk
        .catalog
        .pair(&card.pair)
        .await?
        .ok_or(Trouble::NoCard)?;
    let reviewer = &desk.deck_options.reviewer;
    let mut made = correction::made(
        &desk.project,
        &found.results,
        &card,
        reviewer,
        map,
        &agreement,
    )?;
    made.note = body.note()?;
    made.event = body.event;
    let told = json!(Corrected::of(&card, &made));
    desk.catalog
        .store_manual_alignment(made, (desk.now)())
        .await?;
    Ok(Json(told))
}

fn card(desk: &Desk, id: &str) -> Result<Arc<Card>, Trouble> {
    desk.card(id).ok_or(Trouble::NoCard)
}
