//! The page of a whole block: its state, its stages, its characters, and the ways to its pictures and its correction.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Path, Request, State};
use axum::http::Method;
use axum::response::{Html, IntoResponse as _, Response};
use maud::{Markup, html};

use super::address::encoded;
use super::blocks_page::state_badge;
use super::components::{
    NavSection, action_form, frame, grouped, metadata, scan_file, score, stored_message,
};
use super::failure::{AppFailure, AppResult};
use super::missing_names::no_block;
use super::pass_on::{in_chosen_language, pass_on, path_below};
use super::projects::OpenProject;
use super::read_only::refuse_read_only;
use super::remedies::block_remedy;
use super::run_blocks::{changed_names, changed_part};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::local_server::AccessControl;
use crate::on_thread::read_on_thread;
use crate::view::{BlockAccess, PictureReading, open_block};
use mocban_catalog::{BlockDetail, Catalog, StoredCharacter};
use mocban_core::domain::{
    BlockCharacterState, BlockName, BlockStage, FailureClass, JobStatus, one_line,
};
use mocban_project::{details, input_warnings};

/// Most characters that are listed.
const SHOWN_CHARACTERS: usize = 1000;
/// Path of the action that stores nothing, below the pages of a block.
const TRY: &str = "correct/try";
/// Pages on which a person changes the block, below its pages. Nobody draws there what cannot be stored.
const EDITORS: [&str; 2] = ["correct", "boxes"];
/// Most events of the history that are shown.
const SHOWN_EVENTS: usize = 50;

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path((key, block)): Path<(String, String)>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let name = block.parse::<BlockName>().ok();
    let name = name.ok_or_else(|| no_block(&block))?;
    let detail = open.catalog.block(&name).await?;
    let detail = detail.ok_or_else(|| no_block(&block))?;
    let characters = open.catalog.block_characters(&name).await?;
    let missing = details::missing_block_files(&open.project, &detail.state.attributes).await;
    // Other pages say why settings cannot be read.
    let changed = changed_names(&open, std::slice::from_ref(&detail.state)).await;
    let changed = changed.unwrap_or_default();
    let body = html! {
        nav.pager { a href="../../blocks" { (visit.t("All blocks", "Tất cả các ván")) } }
        (state_part(&visit, &key, &detail))
        (changed_part(&visit, "../../", changed.len() as u64))
        (ways(&visit, &detail))
        (stages(&visit, &detail))
        (character_list(&visit, &name, &characters, &missing))
        (files(&visit, &detail, &missing))
        (history(&visit, &detail))
    };
    let title = one_line(name.as_str());
    Ok(frame(&visit, &title, Some(&key), NavSection::Blocks, &body))
}

/// Passes a request on to the pages with the pictures of a block and with its correction. The block is read again whenever
/// its pictures are opened; the correction reads it again by itself.
pub(super) async fn pages(
    State(state): State<Arc<AppState>>,
    Path(parts): Path<Vec<String>>,
    Extension(access): Extension<Arc<AccessControl>>,
    request: Request,
) -> AppResult<Response> {
    let [key, block, ..] = parts.as_slice() else {
        return Err(AppFailure::not_found());
    };
    let request = match in_chosen_language(&state, request, &["", "boxes", "correct"]) {
        Ok(request) => request,
        Err(plain) => return Ok(plain.into_response()),
    };
    let open = state.open(key).await?;
    let (is_change, below) = (request.method() == Method::POST, path_below(&request));
    if EDITORS.contains(&below) || (is_change && below != TRY) {
        refuse_read_only(&state, Some(key)).await?;
    }
    // Only reviews have a third part.
    let id = [open.key.as_str(), block, ""].map(str::to_owned);
    if path_below(&request).is_empty() {
        state.blocks.close(&id);
    }
    let router = if let Some(router) = state.blocks.get(&id, &open) {
        router
    } else {
        let opened = opened(&state, &open, block).await?;
        state.blocks.keep(id, &open, opened)
    };
    pass_on(router, access, request).await
}

/// Reads a block and returns its pages.
async fn opened(state: &AppState, open: &Arc<OpenProject>, block: &str) -> AppResult<axum::Router> {
    let name = block.parse::<BlockName>().ok();
    let name = name.ok_or_else(|| no_block(block))?;
    if open.catalog.block(&name).await?.is_none() {
        return Err(no_block(block));
    }
    let open = Arc::clone(open);
    let location = open.location();
    let own = Arc::clone(&open);
    let work = Arc::clone(&state.block_work);
    let read = read_on_thread(async move || {
        let store = BlockAccess::new(&location, &name, None, work);
        let limits = location.settings()?.config.limits;
        open_block(
            &own.catalog,
            &own.project,
            (&name, None),
            limits,
            store,
            // The app adds the chosen language to the address of each page.
            None,
            PictureReading::Meanwhile,
        )
        .await
    });
    let opened = read.await;
    Ok(opened
        .map_err(|error| AppFailure::of(error, &open.dir))?
        .pages)
}

fn state_part(visit: &Visit, key: &str, detail: &BlockDetail) -> Markup {
    let state = &detail.state;
    html! {
        p { (state_badge(visit, state)) }
        @if let Some(stored) = &state.failure {
            div.notice.bad {
                p { b { (visit.class(stored.failure.class)) } " (" (visit.block_stage(stored.stage)) "): " (stored_message(visit, &stored.failure.message)) }
                (block_remedy(visit, key, &state.attributes, stored.stage, (stored.failure.class, stored.failure.message.as_str())))
                @if stored.stage == BlockStage::Boxes && visit.read_only.is_none() {
                    p { a href="view/boxes" { (visit.t("Edit the boxes on the page", "Sửa khung chữ trên trang in")) } }
                }
            }
        }
        @for warning in input_warnings::of_block(detail) {
            div.notice.warn { p { (one_line(Sentence::of_program(&warning).text(visit.language))) } }
        }
    }
}

/// Returns what a person can do with the block.
fn ways(visit: &Visit, detail: &BlockDetail) -> Markup {
    let has = |stage| detail.stages.iter().any(|one| one.stage == stage);
    let state = &detail.state;
    let is_refused = has(BlockStage::Face)
        && state.failure.as_ref().is_some_and(|stored| {
            stored.stage == BlockStage::Align && stored.failure.class == FailureClass::NoSolution
        });
    html! {
        section.actions {
            @if has(BlockStage::Align) {
                a.button href="view/" { (visit.t("Scan and page over each other", "Xem bản quét chồng lên trang in")) }
            }
            @if visit.read_only.is_none() && (has(BlockStage::Align) || is_refused) {
                a.button href="view/correct" { (visit.t("Align by places you choose", "Căn chỉnh theo các điểm tự chọn")) }
                a.button href="view/boxes" { (visit.t("Edit boxes", "Sửa khung chữ")) }
            }
            @if state.status == JobStatus::Quarantined {
                (action_form("../../actions/retry", "inline", &html! {
                    input type="hidden" name="pair" value=(state.attributes.name.as_str());
                    button { (visit.t("Let it run again", "Cho chạy lại")) }
                }))
            } @else {
                (action_form("../../actions/run", "inline", &html! {
                    input type="hidden" name="jobs" value="";
                    input type="hidden" name="which" value="all";
                    button { (visit.t("Run what has changed", "Chạy những gì đã đổi")) }
                }))
            }
        }
        @if let Some(points) = &state.control_points {
            p.muted { (grouped(points.points.len() as u64)) " " (visit.form(points.points.len() as u64, ["place was chosen by a person.", "places were chosen by a person."], "điểm do người dùng chọn.")) }
        }
    }
}

fn stages(visit: &Visit, detail: &BlockDetail) -> Markup {
    html! {
        section {
            h2 { (visit.t("Stages", "Các bước")) }
            table { tbody { @for stage in BlockStage::ALL {
                @let done = detail.stages.iter().find(|one| one.stage == stage);
                tr {
                    th scope="row" { (visit.block_stage(stage)) }
                    td { @match done {
                        Some(done) => { (visit.time(done.at)) " · " (visit.duration(done.ms)) },
                        None => { "–" },
                    } }
                }
            } } }
        }
    }
}

fn character_list(
    visit: &Visit,
    block: &BlockName,
    characters: &[StoredCharacter],
    missing: &[&str],
) -> Markup {
    let label = visit.t("Characters", "Các chữ");
    html! {
        section {
            h2 { (label) }
            @if characters.is_empty() && missing.contains(&"labels") {
                p.bad { (visit.t("The file of the labels is missing, so the characters are not known.", "Không có tệp nhãn nên chưa biết các chữ.")) }
            } @else if characters.is_empty() {
                p.muted { (visit.t("A run finds them on the page.", "Lần chạy sẽ tìm chúng trên trang in.")) }
            } @else {
                p.row {
                    (grouped(characters.len() as u64)) " " (visit.form(characters.len() as u64, ["character", "characters"], "chữ")) " · "
                    a href={ "../../pairs?block=" (encoded(block.as_str())) } { (visit.t("All pairs of this block", "Tất cả các cặp của ván này")) }
                }
                div.scroll tabindex="0" role="region" aria-label=(label) {
                    table {
                        thead { tr {
                            th scope="col" { (visit.t("Label", "Nhãn")) }
                            th scope="col" { (visit.t("Character", "Chữ")) }
                            th scope="col" { (visit.t("State", "Trạng thái")) }
                            th.number scope="col" { (visit.t("Certainty of the place", "Độ chắc chắn của vị trí")) }
                            th scope="col" { (visit.t("Pair", "Cặp")) }
                        } }
                        tbody { @for one in characters.iter().take(SHOWN_CHARACTERS) { (character_row(visit, one)) } }
                    }
                }
                @if characters.len() > SHOWN_CHARACTERS {
                    p.muted { (visit.t("Only the first are listed:", "Chỉ liệt kê các chữ đầu tiên:")) " " (grouped(SHOWN_CHARACTERS as u64)) }
                }
            }
        }
    }
}

fn character_row(visit: &Visit, one: &StoredCharacter) -> Markup {
    let is_uncertain = one
        .confidence
        .is_some_and(|confidence| confidence < Catalog::LOW_CHARACTER_CONFIDENCE);
    html! {
        tr {
            td { (one_line(&one.label)) }
            td { (one.character.as_deref().map(one_line).unwrap_or_default()) }
            td {
                (visit.character_state(one.state))
                @if let Some(reason) = &one.reason { ": " (one_line(Sentence::of_program(reason).text(visit.language))) }
            }
            td.number.warn[is_uncertain] { (score(visit, one.confidence)) }
            td { @if let Some(pair) = one.pair.as_ref().filter(|_| one.state != BlockCharacterState::Left) {
                a href={ "../../pair/" (encoded(pair)) "/" } { (one_line(pair)) }
            } }
        }
    }
}

fn files(visit: &Visit, detail: &BlockDetail, missing: &[&str]) -> Markup {
    let attributes = &detail.state.attributes;
    let is_missing = html! { span.bad { (visit.t("missing", "không có tệp này")) } };
    let note = |kind: &str| html! { @if missing.contains(&kind) { " " (is_missing) } };
    html! {
        section {
            h2 { (visit.t("Files", "Các tệp")) }
            dl {
                (scan_file(visit, &attributes.mesh_path, attributes.unit))
                @if missing.contains(&"mesh") { dd { (is_missing) } }
                dt { (visit.t("Page", "Trang in")) } dd { code { (one_line(&attributes.page_path)) } (note("page")) }
                dt { (visit.t("Labels", "Nhãn")) } dd {
                    @match &attributes.labels_path {
                        Some(labels) => { code { (one_line(labels)) } (note("labels")) },
                        None => { (visit.t("none: the characters are found", "không có: chữ được tự tìm")) },
                    }
                }
            }
            @if let Some(meta) = attributes.meta.as_ref().filter(|meta| !meta.is_empty()) {
                h2 { (visit.t("Other columns of the list", "Các cột khác của danh sách")) }
                dl { (metadata(meta)) }
            }
        }
    }
}

fn history(visit: &Visit, detail: &BlockDetail) -> Markup {
    let hidden = detail.attempts.len().saturating_sub(SHOWN_EVENTS);
    html! {
        section {
            details {
                summary { h2 { (visit.t("History", "Lịch sử")) } }
                ul.history { @for attempt in detail.attempts.iter().skip(hidden) {
                    li {
                        (visit.time(attempt.at)) " · " (visit.block_stage(attempt.stage)) " · "
                        @match &attempt.failure {
                            Some(failure) => span.bad { (visit.class(failure.class)) ": " (stored_message(visit, &failure.message)) },
                            None => { (visit.t("done", "xong")) @if let Some(ms) = attempt.ms { " (" (visit.duration(ms)) ")" } },
                        }
                    }
                } }
            }
        }
    }
}
