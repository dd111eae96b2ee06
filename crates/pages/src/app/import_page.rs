//! The import: choose folders or a list, see how the files would be paired, and store the pairs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::response::Html;
use maud::{Markup, html};
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::{PageQuery, encoded};
use super::components::{NavSection, frame, grouped};
use super::failure::{AppFailure, AppResult};
use super::folder_picker::{FileCounts, PickedFolder, PickerRoots};
use super::import_changes::ColumnChanges;
use super::import_choice::{ImportChoice, ImportPreview, Planned};
use super::import_columns::{KEPT_COLUMNS, columns_part};
use super::import_matches::{with_change, without_change};
use super::import_partners::{ImportPartners, mending_part};
use super::import_preview::{changes_part, plan_part, warning};
use super::mended_group::MendedGroup;
use super::missing_names::no_project;
use super::plan_cache::PlanCache;
use super::project_places::ProjectPlaces;
use super::projects::FoundProject;
use super::read_only::refuse_read_only;
use super::sentence::Sentence;
use super::state::AppState;
use super::upload_form::upload_part;
use super::visit::Visit;
use crate::on_thread::on_thread;
use mocban_core::domain::{FailureClass, PairName, one_line};
use mocban_project::ProjectResult;
use mocban_project::blocking::blocking;
use mocban_project::import_blocks::{BlockSource, ListedItems, import_blocks};
use mocban_project::import_pairs::{AllowedChanges, PairImport, import_pairs};
use mocban_project::location::Location;
use mocban_project::pair_choices::PairChoices;

/// Values of the address that belong to the files that were chosen, beside the columns of a list.
const OF_FILES: [&str; 8] = [
    "matches",
    "block",
    "from",
    "left_out",
    "whole_block",
    "missing",
    "changed",
    KEPT_COLUMNS,
];

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Html<String>> {
    // What was chosen before a refused change stays.
    let (query, refused) = match with_change(&visit.query) {
        Ok(query) => (query, None),
        Err(failure) => (with_change(&without_change(&visit.query))?, Some(failure)),
    };
    let visit = Visit { query, ..visit };
    let chosen = ImportChoice::of(&visit.query);
    let folder = state.options.folder.clone();
    let path = visit.query.get("path").map(PathBuf::from);
    let from: u64 = visit.query.parsed("from").unwrap_or_default();
    let read = {
        let (chosen, state) = (chosen.clone(), Arc::clone(&state));
        move || {
            let roots = PickerRoots::new(&folder);
            let path = path.unwrap_or_else(|| folder.clone());
            let picked = roots.read(&path);
            let places = ProjectPlaces::find(&folder);
            let known = places.named(&chosen.project).cloned();
            let dir = places.dir_or_new(&chosen.project);
            let preview = chosen.preview(&dir, &roots, from, &state.plans);
            let uploads = state.uploads.folder();
            let partners = preview.as_ref().and_then(|preview| {
                ImportPartners::find(preview, Path::new(&chosen.meshes), &roots, uploads)
            });
            (picked, preview, partners, roots, known)
        }
    };
    let (picked, preview, mut partners, roots, known) = blocking(read).await?;
    if let (Some(known), Some(partners), Some(preview)) = (&known, &mut partners, &preview) {
        let open = state.open_found(known.clone()).await?;
        partners.add_replacements(&open, preview, &roots).await?;
    }
    let planned = preview.as_ref().map(|preview| &preview.planned);
    let changes = match (planned, &known) {
        (Some(Ok(planned)), Some(known)) if chosen.has_columns() => {
            let open = state.open_found(known.clone()).await?;
            ColumnChanges::find(planned, &open).await?
        }
        _ => ColumnChanges::default(),
    };
    let mended = visit.query.parsed::<PairName>("mend");
    let class = visit.query.parsed::<FailureClass>("mend_class");
    if (mended.is_some() || class.is_some()) && known.is_none() {
        return Err(no_project(&chosen.project, &state.options.folder));
    }
    let group = match (class, &known) {
        (Some(class), Some(known)) => {
            let open = state.open_found(known.clone()).await?;
            Some(MendedGroup::read(&open, class).await?)
        }
        _ => None,
    };
    let body = html! {
        @if let Some(failure) = &refused { p.notice.bad role="alert" { (failure.text(visit.language)) } }
        @if visit.query.get("compare").is_some() {
            p.notice role="status" { (visit.t("Nothing was imported yet: look first at what this import changes in the project.", "Chưa nhập gì: trước hết hãy xem lần nhập này thay đổi những gì trong dự án.")) }
        }
        @if let Some(pair) = &mended { (mending_part(&visit, pair)) }
        @if let Some(group) = &group { (group.part(&visit, &chosen.project)) }
        (chosen_part(&visit, &chosen))
        @if let Some(preview) = preview { (preview_part(&visit, &chosen, &preview, &changes)) }
        @if let Some(partners) = partners { (partners.part(&visit)) }
        (upload_part(&visit, &state.uploads, &chosen.project))
        @if known.is_some() {
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
    let project = known.is_some().then_some(chosen.project.as_str());
    Ok(frame(&visit, title, project, NavSection::Import, &body))
}

/// Returns the columns of a list, and the pairs or why there are none.
fn preview_part(
    visit: &Visit,
    chosen: &ImportChoice,
    preview: &ImportPreview,
    changes: &ColumnChanges,
) -> Markup {
    let head = preview.head.as_ref();
    // The form says what is missing, in both languages.
    let asks_for_columns = head.is_some_and(|head| !head.is_complete() && head.refused.is_none());
    html! {
        @if let Some(note) = &preview.note { p.notice { (one_line(&warning(visit, note))) } }
        @match &preview.planned {
            Err(_) if asks_for_columns => {},
            Err(failure) => section.card {
                h2 { (visit.t("What would be imported", "Sẽ nhập những gì")) }
                p.notice.bad role="alert" { (failure.text(visit.language)) }
                (changes_part(visit, &chosen.changes().unwrap_or_default()))
            },
            Ok(planned) => (plan_part(visit, chosen, planned, preview.from, &changes.part(visit))),
        }
        @if let Some(head) = head { (columns_part(visit, chosen, head)) }
    }
}

/// Returns an address without what belongs to files that were chosen before.
fn for_other_files(query: &PageQuery) -> PageQuery {
    let columns = ImportChoice::default();
    let columns = columns.columns().map(|(_, name, _)| name);
    let names = OF_FILES.into_iter().chain(columns);
    names.fold(query.clone(), |query, name| query.with(name, ""))
}

/// Says what to choose, or what is chosen.
fn chosen_part(visit: &Visit, chosen: &ImportChoice) -> Markup {
    let rows = [
        ("meshes", &chosen.meshes, visit.t("Scans", "Bản quét")),
        ("prints", &chosen.prints, visit.t("Prints", "Bản in")),
        ("list", &chosen.list, visit.t("List", "Danh sách")),
    ];
    let is_empty = rows.iter().all(|(_, value, _)| value.is_empty());
    let left_out = visit.query.parsed::<u64>("left_out");
    html! {
        @if let Some(left_out) = left_out {
            p.notice role="status" { (grouped(left_out)) " " (visit.form(left_out, ["other file of the archive is no scan, image or list and was left out.", "other files of the archive are no scans, images or lists and were left out."], "tệp khác trong tệp nén không phải bản quét, hình ảnh hay danh sách và đã bị bỏ qua.")) }
        }
        @if is_empty {
            p { (visit.t(
                "Choose the folder of the scans and the folder of the prints: files with the same name are a pair. Or choose a list (CSV, XLSX, JSON Lines). Nothing is stored before you have seen the pairs.",
                "Hãy chọn thư mục bản quét và thư mục bản in: các tệp cùng tên là một cặp. Hoặc chọn một danh sách (CSV, XLSX, JSON Lines). Chưa có gì được lưu trước khi bạn xem các cặp.",
            )) }
        } @else {
            dl.chosen { @for (name, value, label) in rows {
                @if !value.is_empty() {
                    dt { (label) }
                    dd { code { (one_line(value)) } " " a href={ (visit.here) (for_other_files(&visit.query).with(name, "").text()) } { (visit.t("remove", "bỏ")) } }
                }
            } }
        }
    }
}

fn picker(visit: &Visit, picked: &PickedFolder) -> Markup {
    let fresh = for_other_files(&visit.query);
    let at = |name: &str, path: &Path| {
        let query = if name == "path" { &visit.query } else { &fresh };
        let query = query.with(name, &path.to_string_lossy());
        format!("{}{}", visit.here, query.text())
    };
    let choose = |path: &Path, counts: &FileCounts| {
        let both = fresh.with("meshes", &path.to_string_lossy());
        let both = both.with("prints", &path.to_string_lossy());
        html! {
            div.row {
                @if counts.meshes > 0 { a.button href=(at("meshes", path)) { (visit.t("Scans are here", "Bản quét ở đây")) } }
                @if counts.prints > 0 { a.button href=(at("prints", path)) { (visit.t("Prints are here", "Bản in ở đây")) } }
                @if counts.meshes > 0 && counts.prints > 0 {
                    a.button href={ (visit.here) (both.text()) } { (visit.t("Both are here", "Cả hai ở đây")) }
                }
            }
        }
    };
    html! {
        p { code #folder { (one_line(&picked.path.to_string_lossy())) } " " span.muted { (counts_text(visit, &picked.counts)) } }
        (choose(&picked.path, &picked.counts))
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

/// Says how many files a folder has.
pub(super) fn counts_text(visit: &Visit, counts: &FileCounts) -> String {
    let parts = [
        (counts.meshes, ["scan", "scans"], "bản quét"),
        (counts.prints, ["image", "images"], "hình ảnh"),
        (counts.lists, ["list", "lists"], "danh sách"),
    ];
    let parts = parts.into_iter().filter(|(number, ..)| *number > 0);
    let parts: Vec<String> = parts
        .map(|(number, english, vietnamese)| {
            let name = visit.form(number, english, vietnamese);
            format!("{} {name}", grouped(number))
        })
        .collect();
    let more = if counts.is_partial {
        visit.t(" and more", " và thêm nữa")
    } else {
        ""
    };
    format!("{}{more}", parts.join(", "))
}

/// Returns links to the folders in which files are chosen. They keep all other choices of the page.
pub(super) fn root_links(visit: &Visit, roots: &PickerRoots) -> Markup {
    let at = |root: &Path| visit.query.with("path", &root.to_string_lossy()).text();
    html! {
        p.muted.row { (visit.t("Start at", "Bắt đầu từ")) ":"
            @for root in roots.all() {
                " " a href={ (visit.here) (at(root)) } { (one_line(&root.to_string_lossy())) }
            }
        }
    }
}

/// What an import stores, with which choices and in which folder, the project there, and what the page has shown of it.
type ReadImport = (
    ListedItems,
    PairChoices,
    PathBuf,
    Option<FoundProject>,
    Option<Planned>,
);

/// Imports what was chosen, if it is what the page showed.
pub(super) async fn import(
    State(state): State<Arc<AppState>>,
    ActionBody(chosen): ActionBody<ImportChoice>,
) -> AppResult<Json<Value>> {
    refuse_read_only(&state, Some(&chosen.project)).await?;
    let read = {
        let (chosen, folder) = (chosen.clone(), state.options.folder.clone());
        move || {
            let roots = PickerRoots::new(&folder);
            let places = ProjectPlaces::find(&folder);
            let dir = places.dir(&chosen.project)?;
            let planned = planned_as_shown(&chosen, &dir, &roots)?;
            let nothing = || {
                AppFailure::refused(Sentence::new(
                    "choose folders or a list first",
                    "trước hết hãy chọn thư mục hoặc danh sách",
                ))
            };
            let (items, _) = chosen.items(&roots)?.ok_or_else(nothing)?;
            let known = places.at(&dir).cloned();
            Ok((items, chosen.choices()?, dir, known, planned))
        }
    };
    let read: AppResult<ReadImport> = blocking(read).await?;
    let (items, choices, dir, known, planned) = read?;
    if let Some(go) = unseen_changes(&state, &chosen, known.as_ref(), planned).await? {
        return Ok(Json(json!({ "go": go })));
    }
    let allowed = AllowedChanges {
        missing: !chosen.missing.is_empty(),
        files: !chosen.changed.is_empty(),
        replace: false,
    };
    let at = Location::new(dir.clone());
    let stored = on_thread(async move || store(items, choices, allowed, &at).await).await;
    if stored.map_err(|error| AppFailure::of(error, &dir))? {
        return Err(AppFailure::refused(Sentence::new(
            "nothing was imported: all these pairs were taken out of every count, and stay out until they are brought back",
            "chưa nhập gì: tất cả các cặp này đã được đưa ra khỏi mọi thống kê, và vẫn ở ngoài cho đến khi được đưa trở lại",
        )));
    }
    // A new project has the name of its folder.
    let key = known.map_or_else(|| chosen.project.trim().to_owned(), |known| known.key);
    Ok(Json(json!({ "go": format!("p/{}/", encoded(&key)) })))
}

/// Returns the address of the page that shows what an import changes in a known project, if the page has compared it with
/// another one: the name of the project is typed below the pairs or blocks.
async fn unseen_changes(
    state: &AppState,
    chosen: &ImportChoice,
    known: Option<&FoundProject>,
    planned: Option<Planned>,
) -> AppResult<Option<String>> {
    let is_compared = chosen
        .compared
        .as_ref()
        .is_none_or(|name| *name == chosen.project);
    let planned = planned.filter(|_| chosen.has_columns() && !is_compared);
    let (Some(planned), Some(known)) = (planned, known) else {
        return Ok(None);
    };
    let open = state.open_found(known.clone()).await?;
    let changes = ColumnChanges::find(&planned, &open).await?;
    Ok(changes.may_change().then(|| chosen.comparison(&known.key)))
}

/// Returns what would be imported to the project in `dir`, if the page showed it. Refuses other pairs than it showed, in both
/// languages. The import checks it again.
fn planned_as_shown(
    chosen: &ImportChoice,
    dir: &Path,
    roots: &PickerRoots,
) -> AppResult<Option<Planned>> {
    let shown = chosen.choices()?.shown;
    // Blocks have no hash.
    if shown.is_none() && chosen.compared.is_none() {
        return Ok(None);
    }
    let preview = chosen.preview(dir, roots, 0, &PlanCache::default());
    let planned = preview.map(|preview| preview.planned).transpose()?;
    match &planned {
        Some(Planned::Pairs(plan, _)) if shown.is_some_and(|shown| plan.hash != shown) => {
            Err(AppFailure::refused(Sentence::new(
                "the files or the list changed after the pairs were shown, so nothing was imported: reload the page and look at the pairs again",
                "các tệp hoặc danh sách đã thay đổi sau khi hiện các cặp, nên chưa nhập gì: hãy tải lại trang và xem lại các cặp",
            )))
        }
        _ => Ok(planned),
    }
}

/// Imports pairs or blocks. Returns whether a person has retired all of the pairs.
async fn store(
    items: ListedItems,
    choices: PairChoices,
    allowed: AllowedChanges,
    location: &Location,
) -> ProjectResult<bool> {
    match items {
        ListedItems::Blocks(source) => {
            let source: BlockSource = source;
            import_blocks(&source, allowed, location, &()).await?;
            Ok(false)
        }
        ListedItems::Pairs(source) => {
            let import = PairImport {
                source,
                truth: None,
                allowed,
                choices,
            };
            let summary = import_pairs(import, location, &()).await?.summary;
            let listed = summary.added + summary.unchanged + summary.changed.len() as u64;
            Ok(listed > 0 && summary.still_retired == listed)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{PageQuery, PickerRoots, root_links};
    use crate::app::address::encoded;
    use crate::app::visit::Visit;
    use crate::review::Language;

    #[test]
    fn links_to_other_folders_keep_what_was_chosen() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let root = dir.path().canonicalize().expect("a path");
        let roots = PickerRoots::new(dir.path());
        for choices in [
            "project=b%2004&mend=ch%E1%BB%AF%201&path=%2Fa",
            "backup=%2Fb.sqlite&inputs=%2Fc&path=%2Fa",
        ] {
            let query = PageQuery::parse(choices);
            let expected = query.with("path", &root.to_string_lossy());
            let visit = Visit {
                query,
                ..Visit::in_language(Language::English)
            };
            let links = root_links(&visit, &roots).into_string();
            let href = format!("href=\"./{}\"", expected.text().replace('&', "&amp;"));
            assert!(links.contains(&href), "{href}: {links}");
            assert!(expected.text().contains(&encoded(&root.to_string_lossy())));
        }
    }
}
