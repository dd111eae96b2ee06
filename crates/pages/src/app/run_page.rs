//! The first page of a project: its state, the run in progress, and what failed.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};

use super::components::{NavSection, action_form, figure, frame, grouped};
use super::failed_groups::failed_groups;
use super::failure::AppResult;
use super::home::free_space;
use super::latest_results::latest_results;
use super::looked_part::looked_part;
use super::pair_query::{ALIGNED_PAIRS, ALL_PAIRS, FAILED_PAIRS, LOW_CONFIDENCE_PAIRS};
use super::projects::OpenProject;
use super::run_blocks::{
    blocks_text, cut_again_text, failed_block_list, failed_blocks, other_blocks_text,
    outdated_blocks_text,
};
use super::run_state::RunState;
use super::state::AppState;
use super::visit::Visit;
use crate::review::Language;
use mocban_core::domain::{JobStatus, UnixMillis, one_line};
use mocban_project::ProjectError;
use mocban_system::platform;

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let read = RunState::read(&open, &state.failed_runs).await;
    let run =
        read.map_err(|error: ProjectError| super::failure::AppFailure::of(error, &open.dir))?;
    let looked = visit.query.parsed::<UnixMillis>("looked");
    let last = open.catalog.last_activity().await?;
    let looked = looked.filter(|_| !run.is_running && run.failed_run.is_none());
    let is_unchanged = looked.is_some_and(|looked| last.is_none_or(|last| last < looked))
        && run.to_align() + run.open_blocks() == 0;
    let places = match looked {
        Some(looked) => Some(state.looked_inputs.look(&open, looked).await?),
        None => None,
    };
    let body = html! {
        div #live data-live="2000" {
            (figures(&visit, &run))
            @if let Some(sentence) = run.failed_run.as_ref().filter(|_| !run.is_running) {
                p.notice.bad #failed-run role="alert" { (one_line(sentence.text(visit.language))) }
            }
            (progress(&visit, &run))
            @if let Some(places) = &places { (looked_part(&visit, &key, places, is_unchanged)) }
            (controls(&visit, &run))
            (disk(&visit, &open))
            (latest_results(&visit, &run.latest))
            (failed_block_list(&visit, &run.blocks))
            (failed_groups(&visit, &key, &run.failures))
        }
    };
    let title = visit.t("Run", "Căn chỉnh");
    Ok(frame(&visit, title, Some(&key), NavSection::Run, &body))
}

fn figures(visit: &Visit, run: &RunState) -> Markup {
    let [running, waiting] = run.computed_and_waiting();
    // The lists have pairs by their jobs, of which more are leased than computed.
    let is_listed = running == run.jobs(JobStatus::Leased);
    let list = |address: &'static str| is_listed.then_some(address);
    let failed_blocks = failed_blocks(&run.blocks);
    let running_blocks = run.blocks.leased();
    let running_name = if run.is_running {
        visit.t("running", "đang chạy")
    } else {
        visit.t("interrupted", "bị ngắt")
    };
    let judged: u64 = run.counts.verdicts.values().sum();
    let blocks = run.blocks.0.len() as u64;
    let blocks_name = |number: u64| visit.form(number, ["block", "blocks"], "ván");
    html! {
        div.figures {
            (figure(run.counts.pairs, visit.form(run.counts.pairs, ["pair", "pairs"], "cặp"), Some(ALL_PAIRS), ""))
            (figure(run.jobs(JobStatus::Done), visit.t("aligned", "đã căn chỉnh"), Some(ALIGNED_PAIRS), "good"))
            (figure(run.jobs(JobStatus::Quarantined), visit.t("failed", "lỗi"), Some(FAILED_PAIRS), "bad"))
            (figure(waiting, visit.t("waiting", "đang chờ"), list("pairs?state=waiting"), ""))
            @if running > 0 || running_blocks == 0 { (figure(running, running_name, list("pairs?state=running"), "")) }
            @if running_blocks > 0 { (figure(running_blocks, &format!("{} {running_name}", blocks_name(running_blocks)), Some("blocks?state=waiting"), "")) }
            (figure(run.counts.low_confidence, visit.t("low confidence", "độ tin cậy thấp"), Some(LOW_CONFIDENCE_PAIRS), "warn"))
            (figure(judged, visit.form(judged, ["verdict", "verdicts"], "đánh giá"), Some("review"), ""))
            @if !run.blocks.is_empty() { (figure(blocks, blocks_name(blocks), Some("blocks"), "")) }
            @if failed_blocks > 0 { (figure(failed_blocks, visit.form(failed_blocks, ["block failed", "blocks failed"], "ván lỗi"), Some("blocks?state=failed"), "bad")) }
        }
    }
}

fn progress(visit: &Visit, run: &RunState) -> Markup {
    let settled = run.jobs(JobStatus::Done) + run.jobs(JobStatus::Quarantined);
    let rate = run.rate().filter(|_| run.is_running);
    html! {
        progress.wide value=(settled) max=(run.counts.pairs.max(1)) aria-label=(visit.t("Progress of the project", "Tiến độ của dự án")) {}
        p.muted {
            (grouped(settled)) " / " (grouped(run.counts.pairs))
            @if let Some(rate) = rate {
                " · " (rate_text(visit, rate))
                @if run.open_blocks() == 0 {
                    " · " (visit.t("time left", "còn lại")) " " (duration(visit, run.outstanding() as f64 / rate))
                }
            }
            @if run.is_running {
                @for worker in &run.workers { " · " (one_line(&worker.host)) ", " (visit.t("process", "tiến trình")) " " (worker.pid) }
            }
        }
        @if !run.blocks.is_empty() { p.muted #blocks { (blocks_text(visit, &run.blocks)) } }
    }
}

/// Returns a number of pairs a second, or a minute if they are few.
fn rate_text(visit: &Visit, per_second: f64) -> String {
    if per_second < 1.0 {
        let number = visit.decimal(60.0 * per_second, 1);
        format!("{number} {}", visit.t("pairs a minute", "cặp mỗi phút"))
    } else {
        let number = visit.decimal(per_second, 1);
        format!("{number} {}", visit.t("pairs a second", "cặp mỗi giây"))
    }
}

/// Returns a time as a person says it.
fn duration(visit: &Visit, seconds: f64) -> String {
    let (number, unit) = match seconds {
        s if s < 90.0 => (s.ceil(), visit.t("s", "giây")),
        s if s < 5400.0 => ((s / 60.0).ceil(), visit.t("min", "phút")),
        s => ((s / 3600.0).ceil(), visit.t("h", "giờ")),
    };
    format!("{number} {unit}")
}

fn controls(visit: &Visit, run: &RunState) -> Markup {
    if run.is_running {
        let text = if run.is_stopping() {
            visit.t("Stop at once", "Dừng ngay")
        } else {
            visit.t(
                "Stop after the stages in progress",
                "Dừng sau các giai đoạn đang làm",
            )
        };
        return html! {
            @if run.is_stopping() {
                p.notice { (visit.t("The run is stopping. Everything finished so far is stored.", "Đang dừng. Mọi thứ đã xong đều được lưu.")) }
            }
            (action_form("actions/stop", "inline", &html! { button #stop { (text) } }))
        };
    }
    let waiting = run.to_align();
    let blocks = run.open_blocks();
    let is_idle = waiting + blocks == 0;
    let is_empty = run.counts.pairs == 0 && run.blocks.is_empty();
    let failed = run.jobs(JobStatus::Quarantined);
    let other_files = run.counts.other_files + run.blocks.other_files();
    html! {
        @if let Some(text) = outdated_text(visit, run) { p.notice #outdated { (text) } }
        @if let Some(text) = outdated_blocks_text(visit, run.outdated_blocks) { p.notice #outdated-blocks { (text) } }
        @if let Some(text) = other_files_text(visit, run) { p.notice #other-files { (text) } }
        @if let Some(text) = other_blocks_text(visit, &run.blocks) { p.notice #other-block-files { (text) } }
        (action_form("actions/run", "inline run-form", &html! {
            label { (visit.t("Pairs at the same time", "Số cặp cùng lúc")) " "
                input.short type="number" name="jobs" min="1" max="1024" value=(run.jobs);
            }
            button.primary #start name="which" value=(if is_idle { "look" } else { "all" }) disabled[is_empty] {
                @if is_idle && run.changed_blocks > 0 {
                    (cut_again_text(visit, run.changed_blocks))
                } @else if is_idle {
                    (visit.t("Look for changed files", "Tìm tệp đã đổi"))
                } @else {
                    (visit.t("Align", "Căn chỉnh")) " "
                    (to_align(visit, blocks, waiting))
                }
            }
            @if failed > 0 {
                button name="which" value="failed" { (visit.t("Try failed pairs again", "Thử lại các cặp lỗi")) }
            }
        }))
        @if is_idle && failed + failed_blocks(&run.blocks) == 0 && other_files == 0 && run.counts.pairs > 0 {
            p.good { (visit.t("Everything is aligned. Next: judge a sample of the results.", "Mọi thứ đã được căn chỉnh. Tiếp theo: đánh giá một mẫu kết quả.")) " "
                a href="review" { (visit.t("Review", "Đánh giá")) } }
        }
    }
}

/// Says that pairs to align have outdated results. The button says how many there are to align in all.
fn outdated_text(visit: &Visit, run: &RunState) -> Option<String> {
    let (outdated, all) = (run.outdated(), run.to_align());
    match (visit.language, outdated) {
        (_, 0) => None,
        (Language::English, n) if n < all => Some(format!(
            "{} of the pairs to align had other settings or files in an earlier run.",
            grouped(n)
        )),
        (Language::English, _) => {
            Some("The pairs to align had other settings or files in an earlier run.".to_owned())
        }
        (Language::Vietnamese, n) if n < all => Some(format!(
            "{} trong số các cặp cần căn chỉnh đã chạy trước đây với thiết lập hoặc tệp khác.",
            grouped(n)
        )),
        (Language::Vietnamese, _) => {
            Some("Các cặp cần căn chỉnh đã chạy trước đây với thiết lập hoặc tệp khác.".to_owned())
        }
    }
}

/// Says that a list names other files of aligned pairs, which no run has read.
fn other_files_text(visit: &Visit, run: &RunState) -> Option<String> {
    let number = run.counts.other_files;
    let pairs = grouped(number);
    match (visit.language, number) {
        (_, 0) => None,
        (Language::English, 1) => Some(
            "1 aligned pair has another scan or print in the list than before: the next run looks at its files."
                .to_owned(),
        ),
        (Language::English, _) => Some(format!(
            "{pairs} aligned pairs have another scan or print in the list than before: the next run looks at them."
        )),
        (Language::Vietnamese, _) => Some(format!(
            "{pairs} cặp đã căn chỉnh có bản quét hoặc bản in khác trong danh sách so với trước: lần chạy tới sẽ xem lại các tệp đó."
        )),
    }
}

/// Returns the number of blocks and pairs that a run would align, such as `1 block and 3 pairs`.
fn to_align(visit: &Visit, blocks: u64, pairs: u64) -> String {
    let counted = |number: u64, english, vietnamese| {
        let name = visit.form(number, english, vietnamese);
        (number > 0).then(|| format!("{} {name}", grouped(number)))
    };
    let parts = [
        counted(blocks, ["block", "blocks"], "ván"),
        counted(pairs, ["pair", "pairs"], "cặp"),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    parts.join(visit.t(" and ", " và "))
}

fn disk(visit: &Visit, open: &OpenProject) -> Markup {
    let free = platform::free_bytes(&open.dir);
    html! { @if let Some(free) = free { p.muted { (free_space(visit, free)) } } }
}

#[cfg(test)]
mod tests;
