//! Actions on pairs that were chosen in a list, and what the list then says was done.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::PageQuery;
use super::child_run;
use super::chosen_sets::CHOSEN;
use super::components::{action_form, grouped};
use super::failure::{AppFailure, AppResult};
use super::pair_query::PairQuery;
use super::projects::OpenProject;
use super::read_only::refuse_read_only;
use super::run_actions::{refuse_during_run, runs};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::on_thread;
use mocban_catalog::{ListedNames, PairFilter};
use mocban_core::domain::{ErrorCode, JobStatus, PairName, UnixMillis};
use mocban_project::ProjectError;
use mocban_project::retire::{RetireChoice, RetireOutcome, retire, retired_at, undo};
use mocban_project::retry::{RetryRequest, retry};
use mocban_project::selection;

/// Most pairs that are chosen at a time.
pub(super) const MAX_CHOSEN: usize = 1000;

/// Statuses of the pairs that are run if they are chosen to go on.
pub(super) const RESUMED: [JobStatus; 3] =
    [JobStatus::Ready, JobStatus::Backoff, JobStatus::Quarantined];

/// Parts of the address of a list that say what was done.
const DONE: [&str; 4] = ["done", "count", "at", "still_out"];

/// What is done to pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ChosenChange {
    /// Computes all their results again.
    Compute,
    /// Runs the waiting and the failed ones.
    Resume,
    /// Takes them out of every count.
    Retire,
    /// Lets a person judge their results.
    Review,
}

/// The fields of the form.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChosenBody {
    pairs: Vec<String>,
    change: ChosenChange,
    /// The list that the page shows, as its address names it.
    #[serde(default)]
    list: String,
}

/// A retired pair, or the time at which pairs were retired.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RestoreBody {
    #[serde(default)]
    pair: Option<String>,
    #[serde(default)]
    at: String,
    /// The list that the page shows, as its address names it. `None` on the page of a pair.
    #[serde(default)]
    list: Option<String>,
}

/// Responds with the ids of all pairs of a list, which the page then chooses, and with those of them that wait or have failed.
pub(super) async fn listed(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let query = PairQuery::of(&visit.query);
    if query.lacks_compared {
        return Err(AppFailure::refused(metric_is_lacking()));
    }
    if query.is_retired {
        return Err(AppFailure::refused(Sentence::new(
            "retired pairs cannot be chosen: bring them back first",
            "không thể chọn các cặp đã đưa ra khỏi thống kê: trước hết hãy đưa chúng trở lại",
        )));
    }
    let (filter, order, metric) = (&query.filter, query.order, query.metric);
    let names = open.catalog.listed_names(filter, order, metric, MAX_CHOSEN);
    let refusal = match names.await? {
        ListedNames::All(names) => {
            let open_names = resumed_names(&open, &query).await?;
            return Ok(Json(json!({ "pairs": names, "open": open_names })));
        }
        ListedNames::TooMany => {
            let most = grouped(MAX_CHOSEN as u64);
            Sentence::new(
                format!(
                    "more than {most} pairs match, and at most {most} can be chosen: narrow the filter"
                ),
                format!("có hơn {most} cặp phù hợp, và chỉ có thể chọn tối đa {most}: hãy lọc bớt"),
            )
        }
        ListedNames::NotSearched { searched } => {
            let searched = grouped(searched as u64);
            Sentence::new(
                format!(
                    "only {searched} pairs were looked at, and more may match: narrow the filter by state or block"
                ),
                format!(
                    "mới xem {searched} cặp và có thể còn cặp phù hợp: hãy lọc bớt theo trạng thái hoặc ván"
                ),
            )
        }
    };
    Err(AppFailure::refused(refusal))
}

/// Returns the ids of the pairs of a list that wait or have failed.
async fn resumed_names(open: &OpenProject, query: &PairQuery) -> AppResult<Vec<PairName>> {
    let asked = &query.filter.statuses;
    let is_asked = |status: &JobStatus| asked.is_empty() || asked.contains(status);
    let statuses: Vec<JobStatus> = RESUMED.into_iter().filter(is_asked).collect();
    if statuses.is_empty() {
        return Ok(Vec::new());
    }
    let filter = PairFilter {
        statuses,
        ..query.filter.clone()
    };
    let names = open
        .catalog
        .listed_names(&filter, query.order, query.metric, MAX_CHOSEN);
    Ok(match names.await? {
        ListedNames::All(names) => names,
        ListedNames::TooMany | ListedNames::NotSearched { .. } => Vec::new(),
    })
}

/// Says that a difference of IoU needs another metric.
pub(super) fn metric_is_lacking() -> Sentence {
    Sentence::new(
        "a difference of IoU needs two metrics: choose another one under Compare with",
        "độ lệch IoU cần hai độ đo: hãy chọn độ đo khác ở mục So sánh với",
    )
}

/// Checks that pairs exist and are not retired, and that they are few enough.
///
/// # Errors
/// Names a pair that does not, and all that are retired.
pub(super) async fn require_pairs(
    open: &OpenProject,
    typed: &[String],
) -> AppResult<Vec<PairName>> {
    if typed.is_empty() {
        return Err(AppFailure::refused(Sentence::new(
            "no pair is chosen",
            "chưa chọn cặp nào",
        )));
    }
    if typed.len() > MAX_CHOSEN {
        let most = grouped(MAX_CHOSEN as u64);
        return Err(AppFailure::refused(Sentence::new(
            format!("at most {most} pairs can be chosen"),
            format!("chỉ có thể chọn tối đa {most} cặp"),
        )));
    }
    match selection::pairs(&open.catalog, typed).await {
        Ok(names) => Ok(names),
        Err(error) => {
            let retired = open.catalog.retired_pairs().await?.into_iter();
            let retired = retired.map(|pair| pair.name);
            let is_chosen = |name: &PairName| typed.iter().any(|typed| typed == name.as_str());
            let retired = retired.filter(is_chosen).collect();
            Err(AppFailure::of(error, &open.dir).with_retired(retired))
        }
    }
}

/// Does something with chosen pairs, and replies with the list that says what was done.
pub(super) async fn change(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<ChosenBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    // The choice for a review is stored in no project.
    if !matches!(body.change, ChosenChange::Review) {
        refuse_read_only(&state, Some(&key)).await?;
    }
    let chosen = require_pairs(&open, &body.pairs).await?;
    let names: Vec<String> = chosen.iter().map(PairName::to_string).collect();
    let list = without_done(&PageQuery::parse(&body.list));
    let (done, counted) = match body.change {
        ChosenChange::Compute => {
            let count = names.len();
            compute(&state, &open, names).await?;
            ("compute", ["count", &count.to_string()].map(str::to_owned))
        }
        ChosenChange::Resume => {
            let count = names.len();
            let done = resume(&state, &open, names).await?;
            (done, ["count", &count.to_string()].map(str::to_owned))
        }
        ChosenChange::Retire => {
            let at = retire_pairs(&open, names).await?;
            ("retire", ["at", &at.to_string()].map(str::to_owned))
        }
        ChosenChange::Review => {
            let key = state.chosen.keep(&open.key, &open.dir, &chosen).await;
            return Ok(Json(json!({ "go": format!("review?{CHOSEN}={key}") })));
        }
    };
    let [name, value] = counted;
    let list = list.with("done", done).with(&name, &value);
    Ok(Json(json!({ "go": format!("pairs{}", list.text()) })))
}

/// Computes the results of pairs again.
async fn compute(state: &AppState, open: &OpenProject, names: Vec<String>) -> AppResult<()> {
    refuse_during_run(open).await?;
    let args = ["--rerun", "all"].map(str::to_owned);
    child_run::start(state, &open.dir, &args, &names).await
}

/// Runs the waiting and failed ones of some pairs. Starts no run beside one in progress, which takes them up unless it works
/// on named pairs; then they wait for the next one. Returns what the list says was done.
async fn resume(
    state: &AppState,
    open: &OpenProject,
    names: Vec<String>,
) -> AppResult<&'static str> {
    let (request, location) = (RetryRequest::Names(names.clone()), open.location());
    let retried = on_thread(async move || retry(&request, &location).await).await;
    // None of them may have failed.
    let is_none_failed = |error: &ProjectError| error.code() == ErrorCode::NothingSelected;
    if let Err(error) = retried
        && !is_none_failed(&error)
    {
        return Err(AppFailure::of(error, &open.dir));
    }
    if runs(open).await? {
        return Ok("resume-later");
    }
    child_run::start(state, &open.dir, &[], &names).await?;
    Ok("resume")
}

/// Takes pairs out of every count. Returns when.
async fn retire_pairs(open: &OpenProject, names: Vec<String>) -> AppResult<UnixMillis> {
    let location = open.location();
    let choice = RetireChoice::Ids(names);
    let retired = on_thread(async move || retire(&choice, &location).await).await;
    let retired = retired.map_err(|error| AppFailure::of(error, &open.dir))?;
    Ok(retired.at.unwrap_or_default())
}

/// Brings a pair back, or the pairs that were taken out of every count at the same time.
pub(super) async fn restore(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<RestoreBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let choice = if let Some(pair) = body.pair {
        RetireChoice::Ids(vec![pair])
    } else {
        let at = body.at.parse::<UnixMillis>();
        RetireChoice::RetiredAt(at.map_err(|_invalid| AppFailure::not_found())?)
    };
    let location = open.location();
    let restored = on_thread(async move || undo(&choice, &location).await).await;
    let restored = restored.map_err(|error| AppFailure::of(error, &open.dir))?;
    let Some(list) = body.list else {
        return Ok(Json(json!({ "reload": true })));
    };
    let done = with_restored(&PageQuery::parse(&list), &restored);
    Ok(Json(json!({ "go": format!("pairs{}", done.text()) })))
}

/// Returns the address of a list that says how many pairs came back, and how many did not.
pub(super) fn with_restored(list: &PageQuery, restored: &RetireOutcome) -> PageQuery {
    let still_out = match restored.warnings.len() {
        0 => String::new(),
        count => count.to_string(),
    };
    without_done(list)
        .with("done", "restore")
        .with("count", &restored.changed.to_string())
        .with("still_out", &still_out)
}

/// Returns the address of a list without what was done.
pub(super) fn without_done(query: &PageQuery) -> PageQuery {
    let names = DONE.into_iter().chain(["after"]);
    names.fold(query.clone(), |query, name| query.with(name, ""))
}

/// Says what was done to chosen pairs, as the address has it, and how it is undone.
pub(super) async fn done_notice(visit: &Visit, open: &OpenProject) -> AppResult<Markup> {
    let query = &visit.query;
    let count = query.parsed::<u64>("count").unwrap_or_default();
    let running = html! { a href="./" { (visit.t("Follow the run", "Theo dõi lần chạy")) } };
    let (text, count, next) = match query.get("done") {
        Some("compute") => (
            visit.t("Pairs that are computed again", "Số cặp được tính lại"),
            count,
            running,
        ),
        Some("resume") => (
            visit.t(
                "Chosen pairs, of which those that wait or failed run now",
                "Số cặp đã chọn, trong đó các cặp đang chờ hoặc bị lỗi được chạy",
            ),
            count,
            running,
        ),
        Some("resume-later") => (
            visit.t(
                "Chosen pairs, of which those that wait or failed run with the run in progress or, if it works on other pairs only, when you next press Align",
                "Số cặp đã chọn, trong đó các cặp đang chờ hoặc bị lỗi sẽ chạy trong lần chạy hiện tại hoặc, nếu lần đó chỉ chạy các cặp khác, khi bạn bấm Căn chỉnh lần sau",
            ),
            count,
            running,
        ),
        Some("restore") => (
            visit.t(
                "Pairs that are in every count again",
                "Số cặp đã được tính trở lại",
            ),
            count,
            still_out(visit),
        ),
        Some("retire") => {
            let at = query.parsed("at").unwrap_or_default();
            let retired = retired_at(&open.catalog, at).await?.len() as u64;
            let undo = html! { @if retired > 0 { (restore_form(visit, at)) } };
            let text = visit.t(
                "Pairs that were taken out of every count; their results and verdicts are kept",
                "Số cặp đã được đưa ra khỏi mọi thống kê; kết quả và đánh giá vẫn được giữ",
            );
            (text, retired, undo)
        }
        _ => return Ok(html! {}),
    };
    Ok(html! {
        div #done.notice.good role="status" { p { (text) ": " b { (grouped(count)) } } (next) }
    })
}

/// Says how many pairs did not come back, and why.
fn still_out(visit: &Visit) -> Markup {
    let count = visit.query.parsed::<u64>("still_out");
    html! {
        @if let Some(count) = count {
            p { (visit.t(
                "Pairs that stay out of every count, because they have no box any more in the labels of their blocks",
                "Số cặp vẫn không được tính vì không còn khung trong nhãn của ván",
            )) ": " b { (grouped(count)) } }
        }
    }
}

/// Returns the hidden field that names the list of the page.
pub(super) fn list_field(visit: &Visit) -> Markup {
    let list = without_done(&visit.query).text();
    html! { input type="hidden" name="list" value=(list.trim_start_matches('?')); }
}

fn restore_form(visit: &Visit, at: UnixMillis) -> Markup {
    action_form(
        "actions/restore",
        "inline",
        &html! {
            input type="hidden" name="at" value=(at);
            (list_field(visit))
            button #undo { (visit.t("Bring them back", "Đưa trở lại")) }
        },
    )
}
