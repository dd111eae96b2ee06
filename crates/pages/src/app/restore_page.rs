//! The page that makes a new project of a backup.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::extract::State;
use axum::response::Html;
use maud::{Markup, html};
use tokio::task::spawn_blocking;

use super::address::encoded;
use super::backup_files::{FoundBackup, backups_below};
use super::components::{NavSection, frame, grouped};
use super::failure::{AppFailure, AppResult};
use super::folder_picker::{FileCounts, PickedFolder, PickerRoots};
use super::import_page::{counts_text, root_links};
use super::project_name::new_project_dir;
use super::projects::is_project;
use super::sentence::Sentence;
use super::state::AppState;
use super::task_part::task_part;
use super::tasks::{TaskKind, TaskState};
use super::visit::Visit;
use mocban_core::domain::one_line;
use mocban_project::blocking::blocking;
use mocban_store::{CATALOG_FILE, StagingFolder};

/// Responds with the choice of a backup, or with the state of the restore whose name the address has.
pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let title = visit.t("Restore a backup", "Khôi phục bản sao lưu");
    let show = |body: &Markup| frame(&visit, title, None, NavSection::None, body);
    if let Some(name) = visit.query.get("name") {
        if let Some(task) = last_task(&state, name).await {
            return Ok(show(&progress_part(&visit, name, &task)));
        }
        if new_project_dir(name, &state.options.folder).is_ok_and(|dir| is_project(&dir)) {
            return Ok(show(&existing_part(&visit, name)));
        }
    }
    let folder = state.options.folder.clone();
    let path = visit.query.get("path").map(PathBuf::from);
    let read = move || {
        let roots = PickerRoots::new(&folder);
        let picked = roots.read(path.as_deref().unwrap_or(&folder));
        let whole = folder.canonicalize();
        let found = backups_below(whole.as_deref().unwrap_or(&folder));
        (picked, found, roots, is_project(&folder))
    };
    let (picked, found, roots, is_one_project) = blocking(read).await?;
    let body = html! {
        p { (visit.t(
            "A backup becomes a new project in the folder of the app. The backup and the other projects stay as they are.",
            "Bản sao lưu trở thành một dự án mới trong thư mục của ứng dụng. Bản sao lưu và các dự án khác giữ nguyên.",
        )) }
        @if is_one_project {
            p.notice.warn { (visit.t(
                "The folder of the app is a project itself. Start the app in the folder above it to restore a backup.",
                "Thư mục của ứng dụng đã là một dự án. Hãy mở ứng dụng ở thư mục bên trên để khôi phục bản sao lưu.",
            )) }
        }
        (chosen_part(&visit))
        @if visit.query.get("backup").is_some() {
            section.card #content data-load={ (visit.root) "restore/content" (visit.query.text()) } aria-live="polite" {
                p.muted { (visit.t("Reading the backup…", "Đang đọc bản sao lưu…")) }
            }
        }
        (found_part(&visit, &found))
        h2 { (visit.t("Folders of this computer", "Thư mục trên máy này")) }
        @match picked {
            Err(failure) => p.notice.bad role="alert" { (failure.text(visit.language)) },
            Ok(picked) => (picker(&visit, &picked)),
        }
        (root_links(&visit, &roots))
    };
    Ok(show(&body))
}

/// Returns the state of the last restore to a name. Notes if an earlier process ended during one.
async fn last_task(state: &AppState, name: &str) -> Option<TaskState> {
    let known = state.tasks.state(TaskKind::Restore, name);
    if known.is_some() {
        return known;
    }
    let catalog = new_project_dir(name, &state.options.folder).ok()?;
    let catalog = catalog.join(CATALOG_FILE);
    let remove = move || {
        if catalog.exists() {
            0
        } else {
            StagingFolder::remove_stale(&catalog)
        }
    };
    let removed = spawn_blocking(remove).await.unwrap_or(0);
    let why = || {
        Sentence::new(
            "the program ended before the project was restored, so there is none yet: choose the backup again",
            "chương trình dừng trước khi khôi phục xong nên chưa có dự án: hãy chọn lại bản sao lưu",
        )
    };
    (removed > 0).then(|| state.tasks.note_failure(TaskKind::Restore, name, why()))
}

fn progress_part(visit: &Visit, name: &str, task: &TaskState) -> Markup {
    let again = visit.query.with("name", "");
    html! {
        div #live data-live="1500" {
            p { (visit.t("New project", "Dự án mới")) ": " b { (one_line(name)) } }
            (task_part(visit, Some(task)))
            @match task {
                TaskState::Running => {},
                TaskState::Done(_) => p.row {
                    a.button.primary #restored href=(visit.project_page(name, "")) { (visit.t("Open the project", "Mở dự án")) }
                    a.button href=(visit.here) { (visit.t("Restore another backup", "Khôi phục bản sao lưu khác")) }
                },
                TaskState::Failed(_) => p.row {
                    a.button.primary href={ (visit.here) (again.text()) } { (visit.t("Try again", "Thử lại")) }
                    a.button href=(visit.root) { (visit.t("All projects", "Tất cả dự án")) }
                },
            }
        }
    }
}

/// Says that there is a project, which an earlier process may have restored without the repair that follows.
fn existing_part(visit: &Visit, name: &str) -> Markup {
    html! {
        p { (visit.t("Project", "Dự án")) ": " b { (one_line(name)) } }
        p.notice { (visit.t(
            "The project is there. If the program ended during its restore, files of results may be missing: press Check now on the page Health, which then offers to compute them again.",
            "Đã có dự án này. Nếu chương trình dừng trong khi khôi phục thì có thể thiếu tệp kết quả: hãy bấm Kiểm tra ngay ở trang Tình trạng, ở đó có nút để tính lại chúng.",
        )) }
        p.row {
            a.button.primary #restored href=(visit.project_page(name, "")) { (visit.t("Open the project", "Mở dự án")) }
            a.button href=(visit.project_page(name, "health")) { (visit.t("Health", "Tình trạng")) }
            a.button href=(visit.here) { (visit.t("Restore another backup", "Khôi phục bản sao lưu khác")) }
        }
    }
}

/// Says what is chosen.
fn chosen_part(visit: &Visit) -> Markup {
    let rows = [
        ("backup", visit.t("Backup", "Bản sao lưu")),
        ("inputs", visit.t("Scans and prints", "Bản quét và bản in")),
    ];
    let rows = rows.map(|(name, label)| (name, label, visit.query.get(name)));
    html! {
        @if rows.iter().any(|(.., value)| value.is_some()) {
            dl.chosen { @for (name, label, value) in rows {
                @if let Some(value) = value {
                    dt { (label) }
                    dd { code { (one_line(value)) } " " a href={ (visit.here) (visit.query.with(name, "").text()) } { (visit.t("remove", "bỏ")) } }
                }
            } }
        }
    }
}

/// Returns the link that chooses a file or a folder.
fn choose(visit: &Visit, name: &str, path: &Path, text: &str) -> Markup {
    let query = visit.query.with(name, &path.to_string_lossy());
    html! { a.button href={ (visit.here) (query.text()) } { (text) } }
}

fn found_part(visit: &Visit, found: &[FoundBackup]) -> Markup {
    let label = visit.t(
        "Backups in this folder",
        "Các bản sao lưu trong thư mục này",
    );
    html! {
        h2 { (label) }
        @if found.is_empty() {
            p.muted { (visit.t("There is none below the folder of the app. Choose a folder below.", "Không có bản nào bên dưới thư mục của ứng dụng. Hãy chọn thư mục bên dưới.")) }
        } @else {
            div.scroll #backups tabindex="0" role="region" aria-label=(label) { table { tbody {
                @for backup in found { tr {
                    th scope="row" { code { (one_line(&backup.path.to_string_lossy())) } }
                    td.muted { (visit.file_size(backup.bytes)) }
                    td.muted { @if let Some(time) = backup.written { (visit.time(time)) } }
                    td { (choose(visit, "backup", &backup.path, visit.t("Use this backup", "Dùng bản này"))) }
                } }
            } } }
        }
    }
}

fn picker(visit: &Visit, picked: &PickedFolder) -> Markup {
    let label = visit.t("Folders of this computer", "Thư mục trên máy này");
    let inputs = visit.t("Scans and prints are here", "Bản quét và bản in ở đây");
    let at = |path: &Path| {
        let query = visit.query.with("path", &path.to_string_lossy());
        format!("{}{}", visit.here, query.text())
    };
    html! {
        p { code #folder { (one_line(&picked.path.to_string_lossy())) } " " span.muted { (held(visit, &picked.counts)) } }
        div.row { (choose(visit, "inputs", &picked.path, inputs)) }
        div.scroll tabindex="0" role="region" aria-label=(label) { table { tbody {
            @if let Some(parent) = &picked.parent {
                tr { th scope="row" { a href=(at(parent)) { "↑ " (visit.t("folder above", "thư mục trên")) } } td {} td {} }
            }
            @for (name, counts) in &picked.folders {
                @let path = picked.path.join(name);
                tr {
                    th scope="row" { a href=(at(&path)) { (one_line(name)) "/" } }
                    td.muted { (held(visit, counts)) }
                    td { @if counts.meshes + counts.prints > 0 { (choose(visit, "inputs", &path, inputs)) } }
                }
            }
            @for name in &picked.backups {
                tr {
                    th scope="row" { (one_line(name)) }
                    td.muted { (visit.t("possible backup", "có thể là bản sao lưu")) }
                    td { (choose(visit, "backup", &picked.path.join(name), visit.t("Use this backup", "Dùng bản này"))) }
                }
            }
        } } }
    }
}

/// Says what is in a folder.
fn held(visit: &Visit, counts: &FileCounts) -> String {
    let english = ["possible backup", "possible backups"];
    let backups = visit.form(counts.backups, english, "tệp có thể là bản sao lưu");
    let backups = (counts.backups > 0).then(|| format!("{} {backups}", grouped(counts.backups)));
    let others = Some(counts_text(visit, counts)).filter(|text| !text.is_empty());
    let parts: Vec<String> = backups.into_iter().chain(others).collect();
    parts.join(", ")
}

/// Returns the address of the page for a backup, below that of the home page.
pub(super) fn restore_address(backup: &Path) -> String {
    format!("restore?backup={}", encoded(&backup.to_string_lossy()))
}

/// Refuses a file or a folder that was not chosen.
pub(super) fn chosen_path(roots: &PickerRoots, path: &str) -> AppResult<PathBuf> {
    if path.is_empty() {
        return Err(AppFailure::refused(Sentence::new(
            "choose a backup first",
            "trước hết hãy chọn bản sao lưu",
        )));
    }
    roots.allowed(Path::new(path))
}
