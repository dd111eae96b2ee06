//! Exports: a question instead of a format, and the files of the last export.

use std::collections::BTreeSet;
use std::path::Path as FilePath;
use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::{Html, Response};
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::task::spawn_blocking;

use super::action_body::ActionBody;
use super::address::encoded;
use super::attachment::attachment;
use super::chosen_pairs::require_pairs;
use super::components::{NavSection, action_form, choice, frame, grouped};
use super::export_size::size_card;
use super::export_zip::zip_link;
use super::exports::{
    OF_CHOSEN, PURPOSES, Purpose, exports_dir, is_export, pictures_side, purpose_of,
    recover_exports,
};
use super::failure::{AppFailure, AppResult};
use super::number_text::english_count;
use super::read_only::refuse_read_only_output;
use super::run_blocks::{failed_blocks, failed_blocks_part};
use super::sentence::Sentence;
use super::state::AppState;
use super::task_part::task_part;
use super::tasks::{FinishedTask, TaskKind};
use super::visit::Visit;
use crate::messages::{left_out_reasons, vietnamese};
use crate::review::Language;
use mocban_core::domain::{PairName, ThresholdMetric, one_line};
use mocban_export::{ExportFormat, ExportOptions, ResultFilter};
use mocban_project::ProjectResult;
use mocban_project::block_status::BlockStatus;
use mocban_project::export::{ExportedProject, export};
use mocban_project::location::Location;

/// Most files of an export that are listed.
const SHOWN_FILES: usize = 100;
/// Largest file that is offered for download, bytes. Larger ones are in the folder.
const DOWNLOAD_BYTES: u64 = 64 << 20;

/// The fields of the form.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExportBody {
    purpose: String,
    only: String,
    metric: String,
    /// Pairs that were chosen in a list. `None` for all.
    #[serde(default)]
    pairs: Option<Vec<String>>,
}

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let mut task = state.tasks.state(TaskKind::Export, &open.key);
    if task.is_none() {
        let dir = open.dir.clone();
        let recovered = spawn_blocking(move || recover_exports(&dir)).await;
        if recovered.unwrap_or(false) {
            let why = Sentence::new(
                "the program ended before the last export was done, so an earlier one is kept: press Export again",
                "chương trình dừng trước khi xuất xong nên bản xuất trước được giữ lại: hãy bấm Xuất lại",
            );
            task = Some(state.tasks.note_failure(TaskKind::Export, &open.key, why));
        }
    }
    let folders = exported(&open.dir);
    let blocks = BlockStatus(open.catalog.block_states().await?);
    let body = html! {
        (failed_blocks_part(&visit, "./", failed_blocks(&blocks)))
        (form(&visit))
        (size_card(&visit))
        div #live data-live="1500" {
            (task_part(&visit, task.as_ref()))
            @for (name, files) in &folders {
                (folder_part(&visit, &open.dir, name, files, &zip_link(&visit, &state.zip_sizes, &key, &exports_dir(&open.dir).join(name), name)))
            }
        }
    };
    let title = visit.t("Export", "Xuất dữ liệu");
    Ok(frame(&visit, title, Some(&key), NavSection::Export, &body))
}

fn form(visit: &Visit) -> Markup {
    let metrics = ThresholdMetric::ALL.map(|metric| (metric.name(), visit.metric(metric)));
    action_form(
        "actions/export",
        "card fields",
        &html! {
            label { span { (visit.t("I need", "Tôi cần")) }
                select #purpose name="purpose" { @for (name, _, texts) in PURPOSES { (choice(name, texts[visit.index()], None)) } }
            }
            label { span { (visit.t("Which results", "Kết quả nào")) }
                select name="only" {
                    (choice(ResultFilter::All.name(), visit.t("all pairs with a result", "tất cả các cặp có kết quả"), None))
                    (choice(ResultFilter::Confident.name(), visit.t("without low confidence", "trừ độ tin cậy thấp"), None))
                    (choice(ResultFilter::Passed.name(), visit.t("passed by reviewers", "được người đánh giá cho đạt"), None))
                }
            }
            label { span { (visit.t("Metric", "Độ đo")) }
                select name="metric" {
                    (choice("", visit.t("all metrics", "mọi độ đo"), None))
                    @for (value, text) in metrics { (choice(value, text, None)) }
                }
            }
            button.primary #export { (visit.t("Export", "Xuất")) }
        },
    )
}

/// Returns the exports of a project with their files and sizes. An earlier export is replaced as a whole.
fn exported(dir: &FilePath) -> Vec<(String, Vec<(String, u64)>)> {
    let entries = std::fs::read_dir(exports_dir(dir)).into_iter().flatten();
    let mut found: Vec<_> = entries
        .flatten()
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            is_export(&name).then(|| (name, files(&entry.path())))
        })
        .collect();
    found.sort();
    found
}

/// Returns the files of a folder, without those of folders in it, with their sizes.
fn files(folder: &FilePath) -> Vec<(String, u64)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .filter_map(|entry| {
            let meta = entry.metadata().ok().filter(std::fs::Metadata::is_file)?;
            let name = entry.file_name().into_string().ok()?;
            (!name.starts_with('.')).then_some((name, meta.len()))
        })
        .take(SHOWN_FILES)
        .collect();
    files.sort();
    files
}

fn folder_part(
    visit: &Visit,
    dir: &FilePath,
    name: &str,
    files: &[(String, u64)],
    zip: &Markup,
) -> Markup {
    let purpose = purpose_of(name);
    let title = purpose.map_or_else(
        || name.to_owned(),
        |((.., titles), is_of_chosen)| export_title(visit.language, *titles, is_of_chosen),
    );
    let folder = exports_dir(dir).join(name);
    let folder = std::path::absolute(&folder).unwrap_or(folder);
    html! {
        section.card {
            h2 { (title) }
            (zip)
            p.muted { (visit.t("Folder", "Thư mục")) ": " code { (one_line(&folder.to_string_lossy())) } }
            ul { @for (file, bytes) in files {
                li {
                    @if *bytes <= DOWNLOAD_BYTES {
                        a href={ "exports/" (name) "/" (encoded(file)) } download { (one_line(file)) }
                    } @else { (one_line(file)) }
                    " " span.muted { (visit.file_size(*bytes)) }
                }
            } }
            @if has_folders(&folder) {
                p.muted { (visit.t("Pictures, scans and other files in its folders are in the ZIP.", "Hình ảnh, bản quét và các tệp khác trong các thư mục con có trong tệp ZIP.")) }
            }
        }
    }
}

/// Returns whether a folder has folders in it.
fn has_folders(folder: &FilePath) -> bool {
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.any(|entry| entry.path().is_dir())
}

/// Returns the title of an export: what it is for, and whether it has only chosen pairs.
fn export_title(language: Language, titles: [&str; 2], is_of_chosen: bool) -> String {
    let [english, vietnamese] = titles;
    match (language, is_of_chosen) {
        (Language::English, false) => english.to_owned(),
        (Language::English, true) => format!("{english} (chosen pairs)"),
        (Language::Vietnamese, false) => vietnamese.to_owned(),
        (Language::Vietnamese, true) => format!("{vietnamese} (các cặp đã chọn)"),
    }
}

/// Starts an export.
pub(super) async fn start(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<ExportBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let purpose = PURPOSES.iter().find(|(name, ..)| *name == body.purpose);
    let purpose = *purpose.ok_or_else(AppFailure::not_found)?;
    let only: ResultFilter = body
        .only
        .parse()
        .map_err(|text: String| AppFailure::refused(Sentence::of_program(&text)))?;
    let metric = body.metric.parse::<ThresholdMetric>().ok();
    let pairs = match body.pairs {
        None => None,
        Some(typed) => Some(require_pairs(&open, &typed).await?),
    };
    // The page of a list does not show the export.
    let reply = if pairs.is_some() {
        json!({ "go": "export" })
    } else {
        json!({ "reload": true })
    };
    let pairs = pairs.map(BTreeSet::from_iter);
    refuse_read_only_output(&exports_dir(&open.dir))?;
    let work = move |location| run(purpose, only, metric, pairs, location);
    state.tasks.start(TaskKind::Export, &open, work)?;
    Ok(Json(reply))
}

async fn run(
    (name, format, titles): Purpose,
    only: ResultFilter,
    metric: Option<ThresholdMetric>,
    pairs: Option<BTreeSet<PairName>>,
    location: Location,
) -> ProjectResult<FinishedTask> {
    let of_chosen = if pairs.is_some() { OF_CHOSEN } else { "" };
    let limits = location.settings()?.config.limits;
    let metrics: Vec<ThresholdMetric> = metric.into_iter().collect();
    let options = ExportOptions {
        pairs,
        only,
        csv_bom: format == ExportFormat::Csv,
        csv_decimal_comma: name == "excel-comma",
        canvas_px: pictures_side(name),
        ..ExportOptions::all_of(&metrics, limits)
    };
    let output = exports_dir(&location.dir).join(format!("{name}{of_chosen}"));
    let ExportedProject {
        summary,
        least_confidence,
        missing_inputs,
    } = export(&output, &[format], options, &location, &()).await?;
    let done = grouped(summary.pairs.done);
    let exported = english_count(summary.pairs.done, ["pair was", "pairs were"]);
    let is_of_chosen = !of_chosen.is_empty();
    let [english, vietnamese_title] = [Language::English, Language::Vietnamese]
        .map(|language| export_title(language, titles, is_of_chosen));
    let is_empty = summary.pairs.done == 0;
    let mut lines = vec![if is_empty {
        [
            format!("{english}: no pair has a result to export."),
            format!("{vietnamese_title}: không có cặp nào có kết quả để xuất."),
        ]
    } else {
        [
            format!("{english}: {exported} exported."),
            format!("{vietnamese_title}: đã xuất {done} cặp."),
        ]
    }];
    let without_result = summary.pairs.without_result;
    if without_result > 0 {
        let number = grouped(without_result);
        lines.push([
            format!("Pairs without a result, which are left out: {number}."),
            format!("Số cặp chưa có kết quả nên bị bỏ qua: {number}."),
        ]);
    }
    if summary.left_out.refused() > 0 {
        let reasons = summary.left_out.text(least_confidence);
        let in_vietnamese = left_out_reasons(&reasons).unwrap_or_else(|| reasons.clone());
        lines.push([
            format!("Pairs that your choice leaves out: {reasons}."),
            format!("Số cặp bị bỏ qua theo lựa chọn của bạn: {in_vietnamese}."),
        ]);
    }
    if summary.kept_earlier {
        lines.push([
            "The earlier export was kept, because files of results are missing; check the project first.".to_owned(),
            "Bản xuất trước được giữ lại vì thiếu tệp kết quả; hãy kiểm tra dự án trước.".to_owned(),
        ]);
    }
    let missing = missing_inputs.as_ref();
    if let Some(missing) = missing {
        let said = Sentence::of_program(&missing.to_string());
        lines.push(
            [Language::English, Language::Vietnamese]
                .map(|language| said.text(language).to_owned()),
        );
    }
    let is_explained = |why: &str| missing.is_some_and(|missing| missing.explains(why));
    let others = summary.unreadable.iter();
    let others = others.filter(|(_, why)| !is_explained(why));
    for (pair, why) in others.take(3) {
        let line = format!("{pair}: {why}");
        let vietnamese = vietnamese(&line).unwrap_or_else(|| line.clone());
        lines.push([line, vietnamese]);
    }
    let is_warning = is_empty || summary.kept_earlier || !summary.unreadable.is_empty();
    Ok(FinishedTask::new(lines, is_warning))
}

/// Responds with a file of an export. Only files that the page lists are found.
pub(super) async fn download(
    State(state): State<Arc<AppState>>,
    Path((key, name, file)): Path<(String, String, String)>,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let known = exported(&open.dir)
        .into_iter()
        .find(|(known, _)| *known == name);
    let (_, files) = known.ok_or_else(AppFailure::not_found)?;
    let is_listed = |(known, bytes): &(String, u64)| *known == file && *bytes <= DOWNLOAD_BYTES;
    if !files.iter().any(is_listed) {
        return Err(AppFailure::not_found());
    }
    let path = exports_dir(&open.dir).join(&name).join(&file);
    let read = tokio::task::spawn_blocking(move || std::fs::read(path)).await;
    let bytes = read
        .ok()
        .and_then(Result::ok)
        .ok_or_else(AppFailure::not_found)?;
    Ok(attachment(&file, "application/octet-stream", bytes))
}

#[cfg(test)]
mod tests {
    use super::exported;

    #[test]
    fn only_plain_files_of_known_exports_are_listed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for folder in ["exports/excel/inner", "exports/other"] {
            std::fs::create_dir_all(dir.path().join(folder)).expect("a folder");
        }
        for file in [
            "excel/pairs.csv",
            "excel/.hidden",
            "excel/inner/x",
            "other/y",
        ] {
            std::fs::write(dir.path().join("exports").join(file), "abc").expect("written");
        }
        let found = exported(dir.path());
        assert_eq!(
            found,
            [("excel".to_owned(), vec![("pairs.csv".to_owned(), 3)])]
        );
    }
}
