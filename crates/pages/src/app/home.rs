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
    failed_blocks: u64,
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
            Ok::<_, mocban_project::ProjectError>(ProjectState {
                other_files: counts.other_files + blocks.other_files(),
                counts,
                is_running: running,
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
    let jobs = |status| counts.jobs.get(&status).copied().unwrap_or(0);
    let (done, failed) = (jobs(JobStatus::Done), jobs(JobStatus::Quarantined));
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

/// Names what a project needs next.
fn next_step(visit: &Visit, found: &ProjectState) -> &'static str {
    let counts = &found.counts;
    let jobs = |status| counts.jobs.get(&status).copied().unwrap_or(0);
    // Without a run, leases are those of an interrupted one.
    let outstanding = [JobStatus::Ready, JobStatus::Backoff, JobStatus::Leased].map(jobs);
    let outstanding: u64 = outstanding.iter().sum();
    if found.is_running {
        visit.t("Watch the run", "Xem tiến trình")
    } else if outstanding + counts.stale > 0 {
        visit.t("Align the pairs", "Căn chỉnh các cặp")
    } else if found.open_blocks > 0 {
        visit.t("Align the blocks", "Căn chỉnh các ván")
    } else if found.other_files > 0 {
        visit.t("Look for changed files", "Tìm tệp đã đổi")
    } else if jobs(JobStatus::Quarantined) + found.failed_blocks > 0 {
        visit.t("See what failed", "Xem các mục lỗi")
    } else {
        visit.t("Open", "Mở")
    }
}
