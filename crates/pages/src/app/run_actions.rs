//! Actions on the pairs of a project: run, stop, try again, take out.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::child_run;
use super::failure::{AppFailure, AppResult};
use super::number_text::grouped;
use super::projects::{OpenProject, is_project};
use super::read_only::refuse_read_only;
use super::sentence::Sentence;
use super::state::AppState;
use crate::on_thread::on_thread;
use mocban_core::domain::FailureClass;
use mocban_project::location::now;
use mocban_project::retire::{RetireChoice, retire as retire_pairs};
use mocban_project::retry::{RetryRequest, retry as retry_pairs};
use mocban_runner::is_running;

/// Name of the project that is made of the built-in dataset.
const DEMO: &str = "mocban-demo";
/// Largest number of pairs at the same time.
const MAX_JOBS: u16 = 1024;

/// The fields of the form that starts a run.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RunBody {
    /// Pairs at the same time, as the field has it.
    #[serde(default)]
    jobs: String,
    /// `all`, `failed`, or `look` for files that changed or are missing although everything is aligned.
    which: String,
}

/// The fields of the forms about single pairs and groups of failed ones.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PairsBody {
    #[serde(default)]
    pair: Option<String>,
    #[serde(default)]
    class: Option<FailureClass>,
}

/// Replies that the page is read again.
fn reload() -> Json<Value> {
    Json(json!({ "reload": true }))
}

/// Starts a run of the pairs that wait, and of the failed ones if asked.
pub(super) async fn run(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<RunBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let mut args = Vec::new();
    if !body.jobs.is_empty() {
        let jobs = body.jobs.parse::<u16>().ok();
        let jobs = jobs.filter(|jobs| (1..=MAX_JOBS).contains(jobs));
        let jobs = jobs.ok_or_else(|| {
            let (jobs, most) = (&body.jobs, grouped(u64::from(MAX_JOBS)));
            AppFailure::refused(Sentence::new(
                format!("{jobs} is not a number of pairs from 1 to {most}"),
                format!("{jobs} không phải là số cặp từ 1 đến {most}"),
            ))
        })?;
        args.extend(["-j".to_owned(), jobs.to_string()]);
    }
    if body.which == "failed" {
        args.extend(["--rerun".to_owned(), "failed".to_owned()]);
    }
    let started = now();
    child_run::start(&state, &open.dir, &args, &[]).await?;
    if body.which == "look" {
        // The page then says whether a file has changed or is missing.
        return Ok(Json(json!({ "go": format!("?looked={started}") })));
    }
    Ok(reload())
}

/// Makes a project of the built-in dataset, which waits for its run.
pub(super) async fn demo(State(state): State<Arc<AppState>>) -> AppResult<Json<Value>> {
    let folder = &state.options.folder;
    if is_project(folder) {
        return Err(AppFailure::refused(Sentence::new(
            "this folder is a project itself",
            "thư mục này đã là một dự án",
        )));
    }
    refuse_read_only(&state, None).await?;
    let dir = folder.join(DEMO);
    child_run::finish(
        &state.options.program,
        &["demo".as_ref(), dir.as_os_str(), "--no-run".as_ref()],
    )
    .await?;
    Ok(Json(json!({ "go": format!("p/{DEMO}/") })))
}

/// Stops the run on this computer.
pub(super) async fn stop(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    child_run::stop(&open.catalog).await?;
    Ok(reload())
}

/// Lets failed pairs run again. Starts a run unless one is active, which then takes them up.
pub(super) async fn retry(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<PairsBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let request = match (body.pair, body.class) {
        (Some(pair), _) => RetryRequest::Names(vec![pair]),
        (None, Some(class)) => RetryRequest::Class(class),
        (None, None) => return Err(AppFailure::not_found()),
    };
    let location = open.location();
    let retried = on_thread(async move || retry_pairs(&request, &location).await).await;
    retried.map_err(|error| AppFailure::of(error, &open.dir))?;
    if !runs(&open).await? {
        child_run::start(&state, &open.dir, &[], &[]).await?;
    }
    Ok(reload())
}

/// Takes a pair out of every count.
pub(super) async fn retire(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<PairsBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let pair = body.pair.ok_or_else(AppFailure::not_found)?;
    let location = open.location();
    let retired =
        on_thread(async move || retire_pairs(&RetireChoice::Ids(vec![pair]), &location).await)
            .await;
    let retired = retired.map_err(|error| AppFailure::of(error, &open.dir))?;
    let at = retired.at.unwrap_or_default();
    let go = format!("../../pairs?done=retire&at={at}");
    Ok(Json(json!({ "go": go })))
}

/// Refuses what must not change while a run works on the project.
pub(super) async fn refuse_during_run(open: &OpenProject) -> AppResult<()> {
    if !runs(open).await? {
        return Ok(());
    }
    Err(AppFailure::refused(Sentence::new(
        "a run is in progress: wait for its end, or press Stop on the page Run",
        "đang có một lần chạy: hãy chờ, hoặc bấm Dừng ở trang Căn chỉnh",
    )))
}

/// Returns whether a run works on a project.
pub(super) async fn runs(open: &OpenProject) -> AppResult<bool> {
    let running = is_running(&open.project, &open.catalog, now()).await;
    running.map_err(|error| AppFailure::of(error, &open.dir))
}
