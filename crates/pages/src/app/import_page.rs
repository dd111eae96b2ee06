//! The import: choose folders or a list, see how the files would be paired, and store the pairs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::response::Html;
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::{PageQuery, encoded};
use super::components::{NavSection, action_form, choice, frame, grouped};
use super::failure::{AppFailure, AppResult};
use super::folder_picker::{FileCounts, PickedFolder, PickerRoots};
use super::projects::{find, is_project};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::on_thread;
use mocban_core::domain::{LengthUnit, one_line};
use mocban_project::import_blocks::{BlockSource, ListedItems, import_blocks};
use mocban_project::import_pairs::{AllowedChanges, PairImport, PairSource, import_pairs};
use mocban_project::import_plan::{ImportPlan, plan_import};
use mocban_project::location::Location;
use mocban_project::{ProjectError, ProjectResult};
use mocban_store::Project;

/// Number of pairs that are shown before an import.
const SHOWN_PAIRS: usize = 20;
/// Number of warnings and missing files that are shown.
const SHOWN_LINES: usize = 12;
/// Longest name of a new project, characters.
const NAME_CHARS: usize = 60;

/// What the user has chosen, as the address has it.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ImportChoice {
    /// Name of the project.
    project: String,
    /// Folder of scans.
    meshes: String,
    /// Folder of prints.
    prints: String,
    /// A list.
    list: String,
    unit: String,
    /// Whether files may be missing.
    missing: String,
    /// Whether most known pairs may get other files.
    changed: String,
}

/// What would be imported.
enum Planned {
    Pairs(ImportPlan),
    /// A list of whole blocks, whose pairs a run finds.
    Blocks,
}

impl ImportChoice {
    fn of(query: &PageQuery) -> Self {
        let get = |name| query.get(name).unwrap_or_default().to_owned();
        Self {
            project: get("project"),
            meshes: get("meshes"),
            prints: get("prints"),
            list: get("list"),
            unit: get("unit"),
            ..Self::default()
        }
    }

    /// Returns what is imported, once enough is chosen.
    fn items(&self, roots: &PickerRoots) -> AppResult<Option<ListedItems>> {
        if !self.list.is_empty() {
            let list = roots.allowed(Path::new(&self.list))?;
            let (items, _) = ListedItems::of(&list, None).map_err(AppFailure::from)?;
            return Ok(Some(items));
        }
        if self.meshes.is_empty() || self.prints.is_empty() {
            return Ok(None);
        }
        Ok(Some(ListedItems::Pairs(PairSource::Folders {
            meshes: roots.allowed(Path::new(&self.meshes))?,
            prints: roots.allowed(Path::new(&self.prints))?,
            unit: self.unit.parse::<LengthUnit>().ok(),
        })))
    }

    /// Returns the folder of the project, which need not exist.
    fn dir(&self, folder: &Path) -> AppResult<PathBuf> {
        let found = find(folder).into_iter();
        if let Some(found) = found.into_iter().find(|found| found.key == self.project) {
            return Ok(found.dir);
        }
        if is_project(folder) {
            return Err(AppFailure::refused(Sentence::new(
                "the folder of the app is a project itself: start the app in the folder above it for a new one",
                "thư mục của ứng dụng đã là một dự án: hãy mở ứng dụng ở thư mục bên trên để tạo dự án mới",
            )));
        }
        let name = self.project.trim();
        let is_plain = !name.starts_with('.') && !name.contains(['/', '\\', ':']);
        let is_short = name.chars().count() <= NAME_CHARS && !name.is_empty();
        if is_plain && is_short && !name.contains(char::is_control) {
            return Ok(folder.join(name));
        }
        let name = &self.project;
        Err(AppFailure::refused(Sentence::new(
            format!(
                "{name:?} cannot be the name of a project: give a name of at most {NAME_CHARS} characters without / and :"
            ),
            format!(
                "{name:?} không thể là tên dự án: hãy đặt tên tối đa {NAME_CHARS} ký tự, không có / và :"
            ),
        )))
    }

    fn plan(&self, folder: &Path, roots: &PickerRoots) -> AppResult<Option<Planned>> {
        let dir = self.dir(folder).unwrap_or_else(|_| folder.join("new"));
        match self.items(roots)? {
            None => Ok(None),
            Some(ListedItems::Blocks(_)) => Ok(Some(Planned::Blocks)),
            Some(ListedItems::Pairs(source)) => {
                let plan = plan_import(source, &Project::at(&dir), SHOWN_PAIRS);
                Ok(Some(Planned::Pairs(plan.map_err(AppFailure::from)?)))
            }
        }
    }
}

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let chosen = ImportChoice::of(&visit.query);
    let folder = state.options.folder.clone();
    let path = visit.query.get("path").map(PathBuf::from);
    let read = {
        let chosen = chosen.clone();
        move || {
            let roots = PickerRoots::new(&folder);
            let path = path.unwrap_or_else(|| folder.clone());
            let picked = roots.read(&path);
            let found = find(&folder).into_iter();
            let is_known = found.into_iter().any(|found| found.key == chosen.project);
            (picked, chosen.plan(&folder, &roots), roots, is_known)
        }
    };
    let (picked, planned, roots, is_known) = tokio::task::spawn_blocking(read)
        .await
        .map_err(|error| ProjectError::from(mocban_project::error::TaskStopped(error)))?;
    let body = html! {
        (chosen_part(&visit, &chosen))
        @match planned {
            Err(failure) => p.notice.bad role="alert" { (failure.text(visit.language)) },
            Ok(None) => {},
            Ok(Some(planned)) => (plan_part(&visit, &chosen, &planned)),
        }
        @if is_known {
            div data-load={ "p/" (encoded(&chosen.project)) "/last-import" } aria-live="polite" {}
        }
        h2 { (visit.t("Folders of this computer", "Thư mục trên máy này")) }
        @match picked {
            Err(failure) => p.notice.bad role="alert" { (failure.text(visit.language)) },
            Ok(picked) => (picker(&visit, &picked)),
        }
        (root_links(&visit, &roots))
    };
    let title = visit.t("Import", "Nhập dữ liệu");
    let project = Some(chosen.project.as_str()).filter(|name| !name.is_empty());
    Ok(frame(&visit, title, project, NavSection::Import, &body))
}

/// Says what to choose, or what is chosen.
fn chosen_part(visit: &Visit, chosen: &ImportChoice) -> Markup {
    let rows = [
        ("meshes", &chosen.meshes, visit.t("Scans", "Bản quét")),
        ("prints", &chosen.prints, visit.t("Prints", "Bản in")),
        ("list", &chosen.list, visit.t("List", "Danh sách")),
    ];
    let is_empty = rows.iter().all(|(_, value, _)| value.is_empty());
    html! {
        @if is_empty {
            p { (visit.t(
                "Choose the folder of the scans and the folder of the prints: files with the same name are a pair. Or choose a list (CSV, XLSX, JSON Lines). Nothing is stored before you have seen the pairs.",
                "Hãy chọn thư mục bản quét và thư mục bản in: các tệp cùng tên là một cặp. Hoặc chọn một danh sách (CSV, XLSX, JSON Lines). Chưa có gì được lưu trước khi bạn xem các cặp.",
            )) }
        } @else {
            dl.chosen { @for (name, value, label) in rows {
                @if !value.is_empty() {
                    dt { (label) }
                    dd { code { (one_line(value)) } " " a href={ (visit.here) (visit.query.with(name, "").text()) } { (visit.t("remove", "bỏ")) } }
                }
            } }
        }
    }
}

fn plan_part(visit: &Visit, chosen: &ImportChoice, planned: &Planned) -> Markup {
    html! {
        section.card {
            h2 { (visit.t("What would be imported", "Sẽ nhập những gì")) }
            @match planned {
                Planned::Blocks => p { (visit.t("A list of whole blocks with their pages. A run finds the characters and makes the pairs.", "Một danh sách ván nguyên kèm trang in. Lần chạy sẽ tìm các chữ và tạo cặp.")) },
                Planned::Pairs(plan) => (pairs_part(visit, plan)),
            }
            (import_form(visit, chosen, planned))
        }
    }
}

fn pairs_part(visit: &Visit, plan: &ImportPlan) -> Markup {
    html! {
        p { b { (grouped(plan.pairs)) } " " (visit.t("pairs", "cặp"))
            @if plan.missing.count > 0 { " · " span.bad { (grouped(plan.missing.count as u64)) " " (visit.t("missing files", "tệp không có")) } }
        }
        @for line in plan.missing.lines.iter().take(SHOWN_LINES) { p.notice.bad { (one_line(line)) } }
        @for line in plan.warnings.iter().take(SHOWN_LINES) { p.notice { (one_line(line)) } }
        @if let Some(renamed) = &plan.renamed { p.muted { (one_line(renamed)) } }
        @if !plan.first.is_empty() {
            div.scroll tabindex="0" role="region" aria-label=(visit.t("First pairs", "Các cặp đầu")) {
                table {
                    thead { tr {
                        @for title in [visit.t("Id", "Mã"), visit.t("Scan", "Bản quét"), visit.t("Print", "Bản in"), visit.t("Character", "Chữ"), visit.t("Block", "Ván")] {
                            th scope="col" { (title) }
                        }
                    } }
                    tbody { @for pair in &plan.first {
                        tr {
                            th scope="row" { (one_line(pair.name.as_str())) }
                            td { (file_name(&pair.mesh)) } td { (file_name(&pair.print)) }
                            td { (pair.character.as_deref().map(one_line).unwrap_or_default()) }
                            td { (pair.block.as_deref().map(one_line).unwrap_or_default()) }
                        }
                    } }
                }
            }
            @if plan.pairs > plan.first.len() as u64 { p.muted { (visit.t("The first pairs are shown.", "Chỉ hiện các cặp đầu.")) } }
        }
    }
}

/// Returns the last two parts of a path.
fn file_name(path: &Path) -> String {
    let parts: Vec<_> = path.components().rev().take(2).collect();
    let parts = parts
        .iter()
        .rev()
        .map(|part| part.as_os_str().to_string_lossy());
    one_line(&parts.collect::<Vec<_>>().join("/")).to_string()
}

fn import_form(visit: &Visit, chosen: &ImportChoice, planned: &Planned) -> Markup {
    let missing = match planned {
        Planned::Pairs(plan) => plan.missing.count > 0,
        Planned::Blocks => false,
    };
    let is_nothing = matches!(planned, Planned::Pairs(plan) if plan.pairs == 0);
    action_form(
        &format!("{}actions/import", visit.root),
        "fields",
        &html! {
            @for (name, value) in [("meshes", &chosen.meshes), ("prints", &chosen.prints), ("list", &chosen.list)] {
                input type="hidden" name=(name) value=(value);
            }
            label { span { (visit.t("Project (new or known name)", "Dự án (tên mới hoặc đã có)")) }
                input #project name="project" value=(chosen.project) required maxlength=(NAME_CHARS);
            }
            @if chosen.list.is_empty() {
                label { span { (visit.t("Unit of the scans", "Đơn vị của bản quét")) }
                    select name="unit" {
                        (choice("", visit.t("not known", "không rõ"), Some(&chosen.unit)))
                        @for unit in LengthUnit::ALL { (choice(unit.name(), unit.name(), Some(&chosen.unit))) }
                    }
                }
            }
            @if missing {
                label.check { input type="checkbox" name="missing" value="yes"; " " (visit.t("Also import pairs whose files are missing", "Nhập cả các cặp thiếu tệp")) }
            }
            label.check { input type="checkbox" name="changed" value="yes"; " " (visit.t("Known pairs may get other files", "Các cặp đã có được đổi tệp")) }
            button.primary #import disabled[is_nothing] { (visit.t("Import", "Nhập")) }
        },
    )
}

fn picker(visit: &Visit, picked: &PickedFolder) -> Markup {
    let at = |name: &str, path: &Path| {
        let query = visit.query.with(name, &path.to_string_lossy());
        format!("{}{}", visit.here, query.text())
    };
    let choose = |path: &Path, counts: &FileCounts| {
        let both = visit.query.with("meshes", &path.to_string_lossy());
        let both = both.with("prints", &path.to_string_lossy());
        html! {
            @if counts.meshes > 0 { a.button href=(at("meshes", path)) { (visit.t("Scans are here", "Bản quét ở đây")) } " " }
            @if counts.prints > 0 { a.button href=(at("prints", path)) { (visit.t("Prints are here", "Bản in ở đây")) } " " }
            @if counts.meshes > 0 && counts.prints > 0 {
                a.button href={ (visit.here) (both.text()) } { (visit.t("Both are here", "Cả hai ở đây")) }
            }
        }
    };
    html! {
        p { code #folder { (one_line(&picked.path.to_string_lossy())) } " " span.muted { (counts_text(visit, &picked.counts)) } }
        p { (choose(&picked.path, &picked.counts)) }
        div.scroll tabindex="0" role="region" aria-label=(visit.t("Folders of this computer", "Thư mục trên máy này")) {
            table {
                tbody {
                    @if let Some(parent) = &picked.parent {
                        tr { th scope="row" { a href=(at("path", parent)) { "↑ " (visit.t("folder above", "thư mục trên")) } } td {} td {} }
                    }
                    @for (name, counts) in &picked.folders {
                        @let path = picked.path.join(name);
                        tr {
                            th scope="row" { a href=(at("path", &path)) { (one_line(name)) "/" } }
                            td.muted { (counts_text(visit, counts)) }
                            td { (choose(&path, counts)) }
                        }
                    }
                    @for name in &picked.lists {
                        tr {
                            th scope="row" { (one_line(name)) }
                            td.muted { (visit.t("list", "danh sách")) }
                            td { a.button href=(at("list", &picked.path.join(name))) { (visit.t("Use this list", "Dùng danh sách này")) } }
                        }
                    }
                }
            }
        }
    }
}

fn counts_text(visit: &Visit, counts: &FileCounts) -> String {
    let parts = [
        (counts.meshes, visit.t("scans", "bản quét")),
        (counts.prints, visit.t("images", "hình ảnh")),
        (counts.lists, visit.t("lists", "danh sách")),
    ];
    let parts = parts.iter().filter(|(number, _)| *number > 0);
    let parts: Vec<String> = parts
        .map(|(number, name)| format!("{} {name}", grouped(*number)))
        .collect();
    let more = if counts.is_partial {
        visit.t(" and more", " và thêm nữa")
    } else {
        ""
    };
    format!("{}{more}", parts.join(", "))
}

fn root_links(visit: &Visit, roots: &PickerRoots) -> Markup {
    html! {
        p.muted { (visit.t("Start at", "Bắt đầu từ")) ":"
            @for root in roots.all() {
                " " a href={ (visit.here) "?path=" (encoded(&root.to_string_lossy())) } { (one_line(&root.to_string_lossy())) }
            }
        }
    }
}

/// Imports what was chosen.
pub(super) async fn import(
    State(state): State<Arc<AppState>>,
    ActionBody(chosen): ActionBody<ImportChoice>,
) -> AppResult<Json<Value>> {
    let folder = state.options.folder.clone();
    let read = {
        let (chosen, folder) = (chosen.clone(), folder.clone());
        move || {
            let items = chosen.items(&PickerRoots::new(&folder))?;
            let nothing = || {
                AppFailure::refused(Sentence::new(
                    "choose folders or a list first",
                    "trước hết hãy chọn thư mục hoặc danh sách",
                ))
            };
            Ok((items.ok_or_else(nothing)?, chosen.dir(&folder)?))
        }
    };
    let read: AppResult<(ListedItems, PathBuf)> = tokio::task::spawn_blocking(read)
        .await
        .map_err(|error| ProjectError::from(mocban_project::error::TaskStopped(error)))?;
    let (items, dir) = read?;
    let allowed = AllowedChanges {
        missing: !chosen.missing.is_empty(),
        files: !chosen.changed.is_empty(),
        replace: false,
    };
    let at = dir.clone();
    let stored = on_thread(async move || store(items, allowed, &Location::new(at)).await).await;
    stored.map_err(|error| AppFailure::of(error, &dir))?;
    let found = find(&folder).into_iter();
    let key = found.into_iter().find(|found| found.dir == dir);
    let key = key.map_or_else(|| chosen.project.clone(), |found| found.key);
    Ok(Json(json!({ "go": format!("p/{}/", encoded(&key)) })))
}

async fn store(
    items: ListedItems,
    allowed: AllowedChanges,
    location: &Location,
) -> ProjectResult<()> {
    match items {
        ListedItems::Blocks(source) => {
            let source: BlockSource = source;
            import_blocks(&source, allowed, location, &()).await?;
        }
        ListedItems::Pairs(source) => {
            let import = PairImport {
                source,
                truth: None,
                allowed,
            };
            import_pairs(import, location, &()).await?;
        }
    }
    Ok(())
}
