//! The home page: the projects of the folder, and what each needs next.

use std::sync::Arc;

use axum::extract::State;
use axum::response::Html;
use maud::{Markup, html};

use super::components::{NavSection, action_form, empty, frame, grouped};
use super::failure::{AppFailure, AppResult};
use super::projects::{find, is_project};
use super::run_blocks::{failed_blocks, failed_blocks_part, outdated_blocks};
use super::state::AppState;
use super::visit::Visit;
use crate::review::Language;
use mocban_catalog::StatusCounts;
use mocban_core::domain::{JobStatus, one_line};
use mocban_project::block_status::BlockStatus;
use mocban_project::blocking::blocking;
use mocban_project::location::now;
use mocban_runner::{fingerprints, is_running};
use mocban_system::platform;

/// What the home page says of a project.
struct Overview {
    key: String,
    /// What is known of the project, or why it cannot be read.
    state: Result<ProjectState, AppFailure>,
    last_change: Option<i64>,
}

/// The counts of a project.
struct ProjectState {
    counts: StatusCounts,
    is_running: bool,
    /// Whether the last run did not end well.
    has_failed_run: bool,
    failed_blocks: u64,
    /// Number of blocks that wait for a run.
    waiting_blocks: u64,
    /// Number of verdicts on pairs whose results the next run makes.
    waiting_verdicts: u64,
    /// Number of blocks that a run would work on or works on.
    open_blocks: u64,
    /// Number of finished pairs and blocks that an import gave other files. The next run compares their content.
    other_files: u64,
}

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let folder = state.options.folder.clone();
    let found = blocking(move || find(&folder)).await?;
    let mut projects = Vec::new();
    for found in found {
        projects.push(read(&state, found.key).await);
    }
    let shown = state.options.folder.canonicalize();
    let shown = shown.unwrap_or_else(|_| state.options.folder.clone());
    let free = platform::free_bytes(&state.options.folder);
    let body = html! {
        p.muted {
            (visit.t("Folder", "Thư mục")) ": " (one_line(&shown.display().to_string()))
            @if let Some(free) = free { " · " (free_space(&visit, free)) }
        }
        @if let Some(why) = state.uploads.left_over() {
            p.notice.bad #upload-last { (visit.t("The last upload did not end well: ", "Lần gửi trước không thành công: ")) (why.text(visit.language)) ". " a href="import" { (visit.t("Import", "Nhập dữ liệu")) } }
        }
        @if projects.is_empty() {
            (empty(visit.t("There is no project in this folder yet.", "Chưa có dự án nào trong thư mục này."), &html! {
                p { a.button.primary href="import" { (visit.t("Import scans and prints", "Nhập bản quét và bản in")) } }
                (demo_form(&visit))
                p { (restore_link(&visit)) }
            }))
        } @else {
            div.cards { @for project in &projects { (card(&visit, project)) } }
            @if !is_project(&state.options.folder) { div.row {
                a.button href="import" { (visit.t("Import into a new project", "Nhập vào dự án mới")) }
                (restore_link(&visit))
                @if projects.iter().all(|project| project.key != "mocban-demo") { (demo_form(&visit)) }
            } }
        }
    };
    let title = visit.t("Projects", "Các dự án");
    Ok(frame(&visit, title, None, NavSection::None, &body))
}

async fn read(state: &AppState, key: String) -> Overview {
    let mut last_change = None;
    let counts = async {
        let open = state.open(&key).await?;
        last_change = open.catalog.last_activity().await.ok().flatten();
        let read = async {
            let settings = open.location().settings()?;
            let running = is_running(&open.project, &open.catalog, now()).await?;
            let fingerprints = fingerprints(&settings.config.stages);
            let counts = open.catalog.status(&fingerprints).await?;
            let blocks = BlockStatus(open.catalog.block_states().await?);
            let options = mocban_project::run::options(&settings.config);
            let outdated = if running {
                0
            } else {
                outdated_blocks(&open.catalog, &options, &blocks).await?
            };
            // Without pairs that wait, no verdict waits.
            let waiting_verdicts = if outstanding(&counts) > 0 {
                open.catalog.waiting_verdicts().await?
            } else {
                0
            };
            Ok::<_, mocban_project::ProjectError>(ProjectState {
                waiting_blocks: blocks.waiting(),
                waiting_verdicts,
                other_files: counts.other_files + blocks.other_files(),
                counts,
                is_running: running,
                has_failed_run: state.failed_runs.of(&open).await?.is_some(),
                failed_blocks: failed_blocks(&blocks),
                open_blocks: blocks.waiting() + blocks.leased() + outdated,
            })
        };
        read.await.map_err(|error| AppFailure::of(error, &open.dir))
    };
    let counts = counts.await;
    Overview {
        state: counts,
        key,
        last_change,
    }
}

/// Says how much space is left on the disk.
pub(super) fn free_space(visit: &Visit, bytes: u64) -> String {
    let size = visit.file_size(bytes);
    match visit.language {
        Language::English => format!("{size} free on this disk"),
        Language::Vietnamese => format!("đĩa còn trống {size}"),
    }
}

fn restore_link(visit: &Visit) -> Markup {
    html! { a.button href="restore" { (visit.t("Restore a backup", "Khôi phục bản sao lưu")) } }
}

fn demo_form(visit: &Visit) -> Markup {
    action_form(
        "actions/demo",
        "inline",
        &html! {
            button #demo { (visit.t("Try it with 24 generated pairs", "Thử với 24 cặp được tạo sẵn")) }
        },
    )
}

fn card(visit: &Visit, project: &Overview) -> Markup {
    let href = visit.project_page(&project.key, "");
    html! {
        article.card {
            h2 { a href=(href) { (one_line(&project.key)) } }
            @match &project.state {
                Err(failure) => p.notice.bad { (failure.text(visit.language)) },
                Ok(found) => {
                    (summary(visit, &found.counts, found.is_running))
                    @if found.has_failed_run { (failed_run_part(visit, &href)) }
                    (waiting_part(visit, &href, found))
                    (failed_blocks_part(visit, &href, found.failed_blocks))
                    @if let Some(time) = project.last_change {
                        p.muted { (visit.t("Last result", "Kết quả mới nhất")) ": " (visit.time(time)) }
                    }
                    p { a.button href=(href) { (next_step(visit, found)) } }
                }
            }
        }
    }
}

fn summary(visit: &Visit, counts: &StatusCounts, running: bool) -> Markup {
    let [done, failed] = [JobStatus::Done, JobStatus::Quarantined].map(|one| jobs(counts, one));
    let judged: u64 = counts.verdicts.values().sum();
    html! {
        p {
            b { (grouped(counts.pairs)) } " " (visit.form(counts.pairs, ["pair", "pairs"], "cặp")) " · "
            (grouped(done)) " " (visit.t("aligned", "đã căn chỉnh")) " · "
            (grouped(failed)) " " (visit.t("failed", "lỗi")) " · "
            (grouped(judged)) " " (visit.form(judged, ["verdict", "verdicts"], "đánh giá"))
        }
        progress value=(done + failed) max=(counts.pairs.max(1)) aria-label=(visit.t("Progress", "Tiến độ")) {}
        @if running { p.good { (visit.t("A run is in progress.", "Đang chạy.")) } }
    }
}

/// Says that the last run of a project did not end well. `base` is the relative address of its page, which says why.
fn failed_run_part(visit: &Visit, base: &str) -> Markup {
    html! {
        p.notice.bad .failed-run {
            (visit.t("The last run did not end well.", "Lần chạy trước không kết thúc tốt.")) " "
            a href=(base) { (visit.t("See why", "Xem lý do")) }
        }
    }
}

/// Says which blocks and verdicts of a project wait for a run. `base` is the relative address of the project.
fn waiting_part(visit: &Visit, base: &str, found: &ProjectState) -> Markup {
    let (blocks, verdicts) = (found.waiting_blocks, found.waiting_verdicts);
    html! {
        @if blocks > 0 && !found.is_running {
            p { a href={ (base) "blocks?state=waiting" } { (grouped(blocks)) " " (visit.form(blocks, ["block", "blocks"], "ván")) } " "
                (visit.form(blocks, ["waits for a run.", "wait for a run."], "đang chờ chạy.")) }
        }
        @if verdicts > 0 {
            p { (grouped(verdicts)) " " (visit.form(verdicts, ["verdict waits for the result of its pair.", "verdicts wait for the results of their pairs."], "đánh giá đang chờ kết quả của cặp.")) }
        }
    }
}

/// Returns the number of pairs that wait, run or back off. Without a run, leases are those of an interrupted one.
fn outstanding(counts: &StatusCounts) -> u64 {
    let open = [JobStatus::Ready, JobStatus::Backoff, JobStatus::Leased];
    open.iter().map(|status| jobs(counts, *status)).sum()
}

fn jobs(counts: &StatusCounts, status: JobStatus) -> u64 {
    counts.jobs.get(&status).copied().unwrap_or(0)
}

/// Names what a project needs next.
fn next_step(visit: &Visit, found: &ProjectState) -> &'static str {
    let counts = &found.counts;
    if found.is_running {
        visit.t("Watch the run", "Xem tiến trình")
    } else if outstanding(counts) + counts.stale > 0 {
        visit.t("Align the pairs", "Căn chỉnh các cặp")
    } else if found.open_blocks > 0 {
        visit.t("Align the blocks", "Căn chỉnh các ván")
    } else if found.other_files > 0 {
        visit.t("Look for changed files", "Tìm tệp đã đổi")
    } else if jobs(counts, JobStatus::Quarantined) + found.failed_blocks > 0 {
        visit.t("See what failed", "Xem các mục lỗi")
    } else {
        visit.t("Open", "Mở")
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Overview, ProjectState, card};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_catalog::StatusCounts;

    #[test]
    fn blocks_and_verdicts_that_wait_are_named() {
        let counts = StatusCounts {
            schema: 1,
            pairs: 0,
            retired: 0,
            jobs: BTreeMap::new(),
            stages: BTreeMap::new(),
            stale: 0,
            other_files: 0,
            low_confidence: 0,
            verdicts: BTreeMap::new(),
        };
        let project = |waiting_blocks, waiting_verdicts| Overview {
            key: "p".to_owned(),
            state: Ok(ProjectState {
                counts: counts.clone(),
                is_running: false,
                has_failed_run: false,
                failed_blocks: 0,
                waiting_blocks,
                waiting_verdicts,
                open_blocks: waiting_blocks,
                other_files: 0,
            }),
            last_change: None,
        };
        for (language, parts) in [
            (
                Language::English,
                [
                    "blocks?state=waiting\">1 block</a> waits for a run.",
                    "15 verdicts wait for the results of their pairs.",
                ],
            ),
            (
                Language::Vietnamese,
                [
                    "blocks?state=waiting\">1 ván</a> đang chờ chạy.",
                    "15 đánh giá đang chờ kết quả của cặp.",
                ],
            ),
        ] {
            let visit = Visit::in_language(language);
            let shown = card(&visit, &project(1, 15)).into_string();
            let idle = card(&visit, &project(0, 0)).into_string();
            for part in parts {
                assert!(shown.contains(part), "{part}: {shown}");
            }
            assert!(!idle.contains("state=waiting"), "{idle}");
        }
    }
}
