//! The health of a project: whether files and rows are sound, and a backup.

use std::path::Path as FilePath;
use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::Html;
use maud::html;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::task::spawn_blocking;

use super::action_body::ActionBody;
use super::backup_card::{self, BACKUP, DOWNLOAD_BYTES};
use super::components::{NavSection, action_form, frame, grouped};
use super::failure::AppResult;
use super::home::free_space;
use super::number_text::english_count;
use super::projects::is_project;
use super::read_only::refuse_read_only;
use super::restore_page::restore_address;
use super::sentence::Sentence;
use super::state::AppState;
use super::task_part::task_part;
use super::tasks::{FinishedTask, TaskKind, TaskLines, TaskState};
use super::visit::Visit;
use crate::messages;
use mocban_core::domain::one_line;
use mocban_project::ProjectResult;
use mocban_project::check::check;
use mocban_project::input_list::unfinished_copies;
use mocban_project::location::Location;
use mocban_runner::check::{CheckOptions, CheckSummary, Kind, Notes};
use mocban_store::StagingFolder;
use mocban_system::platform;

/// Most findings of each kind that are shown.
const SHOWN: usize = 3;

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let checked = state.tasks.state(TaskKind::Check, &open.key);
    let mut stored = state.tasks.state(TaskKind::Backup, &open.key);
    let lacks_most_files = matches!(&checked, Some(TaskState::Done(done)) if done.lacks_most_files);
    let file = open.dir.join(BACKUP);
    if stored.is_none() {
        let file = file.clone();
        let why = spawn_blocking(move || interrupted(&file)).await;
        if let Some(why) = why.ok().flatten() {
            stored = Some(state.tasks.note_failure(TaskKind::Backup, &open.key, why));
        }
    }
    let meta = std::fs::metadata(&file).ok();
    let shown = std::path::absolute(&file).unwrap_or(file);
    let body = html! {
        div #live data-live="1500" {
            @if let Some(free) = platform::free_bytes(&open.dir) { p.muted { (free_space(&visit, free)) } }
            section.card {
                h2 { (visit.t("Check", "Kiểm tra")) }
                p { (visit.t("A check reads every file of results and compares it with the catalog. It changes nothing, and a run may go on. A repair needs the project for itself.", "Kiểm tra đọc mọi tệp kết quả và so với danh mục, không thay đổi gì, và vẫn có thể chạy. Chỉ sửa chữa được khi không có lần chạy nào đang diễn ra.")) }
                (action_form("actions/check", "inline", &html! {
                    button.primary #check name="what" value="check" { (visit.t("Check now", "Kiểm tra ngay")) }
                    button #repair name="what" value="repair" data-confirm=(visit.t("Mend what can be mended? Damaged results are computed again by the next run.", "Sửa những gì sửa được? Kết quả bị hỏng sẽ được tính lại trong lần chạy sau.")) { (visit.t("Repair", "Sửa chữa")) }
                    @if lacks_most_files {
                        button #compute-lost name="what" value="lost" data-confirm=(visit.t("Are these files lost? The next run computes them again, which takes as long as at first. If scans or prints are lost too, the numbers and pictures of their pairs are gone.", "Các tệp này đã mất? Lần chạy sau sẽ tính lại chúng, lâu như lần đầu. Nếu bản quét hoặc bản in cũng đã mất thì số đo và hình ảnh của các cặp đó không còn nữa.")) { (visit.t("They are lost: compute them again", "Chúng đã mất: tính lại")) }
                    }
                }))
                (task_part(&visit, checked.as_ref()))
            }
            @if stored.is_some() || meta.is_some() {
                section.card {
                    h2 { (visit.t("Last backup", "Bản sao lưu gần nhất")) }
                    (task_part(&visit, stored.as_ref()))
                    @if let Some(meta) = meta {
                        p { code { (one_line(&shown.to_string_lossy())) } " " span.muted { (visit.file_size(meta.len())) } " "
                            @if meta.len() <= DOWNLOAD_BYTES { a.button href="backup.sqlite" download { (visit.t("Save a copy", "Lưu một bản")) } }
                            @if !is_project(&state.options.folder) {
                                " " a.button href={ (visit.root) (restore_address(&shown)) } { (visit.t("Restore as a new project", "Khôi phục thành dự án mới")) }
                            }
                        }
                    }
                }
            }
        }
        // Outside of the part that is renewed, so that the choice and the size stay.
        (backup_card::card(&visit))
    };
    let title = visit.t("Health", "Tình trạng");
    Ok(frame(&visit, title, Some(&key), NavSection::Health, &body))
}

/// Removes what an interrupted backup left, and says that it was interrupted.
fn interrupted(file: &FilePath) -> Option<Sentence> {
    let was_copying = unfinished_copies(file) > 0;
    if StagingFolder::remove_stale(file) > 0 {
        return Some(Sentence::new(
            "the program ended before the last backup was done, so an earlier one is kept: press Back up now again",
            "chương trình dừng trước khi sao lưu xong nên bản trước được giữ lại: hãy bấm Sao lưu ngay lần nữa",
        ));
    }
    was_copying.then(|| {
        Sentence::new(
            "the program ended before all scans and prints were copied: press Back up now again, and it goes on with the others",
            "chương trình dừng trước khi chép xong bản quét và bản in: hãy bấm Sao lưu ngay lần nữa để chép tiếp",
        )
    })
}

/// Starts a check.
pub(super) async fn start_check(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<CheckBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let accept_missing = body.what == "lost";
    let repair = accept_missing || body.what == "repair";
    if repair {
        refuse_read_only(&state, Some(&key)).await?;
    }
    let options = CheckOptions {
        repair,
        accept_missing,
        ..CheckOptions::default()
    };
    let work = move |location| check_lines(location, options);
    state.tasks.start(TaskKind::Check, &open, work)?;
    Ok(Json(json!({ "reload": true })))
}

/// The field of the form that starts a check.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CheckBody {
    /// `check`, `repair`, or `lost` to repair although most files of results are missing.
    #[serde(default)]
    what: String,
}

async fn check_lines(location: Location, options: CheckOptions) -> ProjectResult<FinishedTask> {
    let repair = options.repair;
    let summary = check(options, &location, &()).await?;
    let [pairs, files] = [summary.pairs, summary.files].map(grouped);
    let [english, vietnamese] = conclusion(&summary, repair);
    let mut lines = vec![[
        format!(
            "{} and {} were checked. {english}",
            english_count(summary.pairs, ["pair", "pairs"]),
            english_count(summary.files, ["file", "files"])
        ),
        format!("Đã kiểm tra {pairs} cặp và {files} tệp. {vietnamese}"),
    ]];
    for (kind, found) in &summary.damage {
        let number = grouped(found.found);
        lines.push(
            [kind.heading(), vietnamese_heading(*kind)].map(|what| format!("{what}: {number}")),
        );
    }
    lines.extend(input_lines(&summary));
    let is_damaged = summary.left() > 0;
    Ok(FinishedTask {
        lacks_most_files: is_damaged && summary.lacks_most_files(),
        ..FinishedTask::new(lines, is_damaged || has_other_inputs(&summary))
    })
}

/// Returns whether input files are not as they were when they were read.
const fn has_other_inputs(summary: &CheckSummary) -> bool {
    summary.inputs_missing.count + summary.inputs_changed.count + summary.inputs_unreadable.count
        > 0
}

/// Returns a line for missing, for changed and for unreadable input files, if there are any.
fn input_lines(summary: &CheckSummary) -> TaskLines {
    let kinds = [
        (
            (
                ["missing input file", "missing input files"],
                "tệp đầu vào bị thiếu",
            ),
            &summary.inputs_missing,
        ),
        (
            (
                ["changed input file", "changed input files"],
                "tệp đầu vào đã đổi",
            ),
            &summary.inputs_changed,
        ),
        (
            (
                ["unreadable input file", "unreadable input files"],
                "tệp đầu vào không đọc được",
            ),
            &summary.inputs_unreadable,
        ),
    ];
    let found = kinds.into_iter().filter(|(_, notes)| notes.count > 0);
    found.map(|(what, notes)| note_line(what, notes)).collect()
}

/// Returns how many files have a note, and the first notes.
fn note_line((english, vietnamese): ([&str; 2], &str), notes: &Notes) -> [String; 2] {
    let number = grouped(notes.count);
    let first = notes.first.iter().take(SHOWN);
    let translated: Vec<String> = first.clone().map(|note| vietnamese_note(note)).collect();
    let first: Vec<&str> = first.map(String::as_str).collect();
    [
        format!(
            "{}: {}",
            english_count(notes.count, english),
            first.join(", ")
        ),
        format!("{number} {vietnamese}: {}", translated.join(", ")),
    ]
}

/// Returns a note in Vietnamese: a file of a pair, or why it cannot be read.
fn vietnamese_note(note: &str) -> String {
    let why = note.strip_suffix(')');
    let why = why.and_then(|note| note.rsplit_once(" ("));
    if let Some((message, pair)) = why
        && let Some(known) = messages::vietnamese(message)
    {
        return format!("{known} ({pair})");
    }
    match note.rsplit_once(" of ") {
        Some((file, pair)) => format!("{file} của {pair}"),
        None => note.to_owned(),
    }
}

/// Returns what the findings of a check or a repair mean, and what to do.
fn conclusion(summary: &CheckSummary, repair: bool) -> [&'static str; 2] {
    let is_left = |kind: &Kind| {
        let found = summary.damage.get(kind);
        found.is_some_and(|found| found.left > 0)
    };
    let needs_backup = [Kind::Database, Kind::Row, Kind::Reference]
        .iter()
        .any(is_left);
    let lacks_files = summary.repaired.not_requeued > 0
        || [Kind::FileMissing, Kind::FileUnreadable]
            .iter()
            .any(is_left);
    match (summary.found(), summary.left()) {
        (0, _) if has_other_inputs(summary) => [
            "The results are sound, but not all input files are as they were when they were read:",
            "Các kết quả đều tốt, nhưng có tệp đầu vào không còn như lúc được đọc:",
        ],
        (0, _) => ["All are sound.", "Tất cả đều tốt."],
        (_, 0) if summary.repaired.requeued + summary.repaired.requeued_blocks == 0 => [
            "All damage was mended. The damage was:",
            "Mọi hư hỏng đã được sửa. Các hư hỏng là:",
        ],
        (_, 0) => [
            "All damage was mended. Press Align on the page Run to compute missing results again. The damage was:",
            "Mọi hư hỏng đã được sửa. Hãy bấm Căn chỉnh ở trang Căn chỉnh để tính lại kết quả bị thiếu. Các hư hỏng là:",
        ],
        _ if summary.lacks_most_files() => [
            "Most files of results are missing. Connect their disk and check again, or press They are lost: compute them again. The damage is:",
            "Thiếu hầu hết các tệp kết quả. Hãy nối lại ổ đĩa chứa chúng rồi kiểm tra lại, hoặc bấm Chúng đã mất: tính lại. Các hư hỏng là:",
        ],
        _ if repair && needs_backup => [
            "Some damage cannot be mended: put your last backup in place of the catalog. The damage was:",
            "Có hư hỏng không sửa được: hãy thay danh mục bằng bản sao lưu gần nhất. Các hư hỏng là:",
        ],
        _ if repair && lacks_files => [
            "Some files cannot be read or are missing. Put them back, then press Repair again. The damage was:",
            "Một số tệp không đọc được hoặc bị thiếu. Hãy đưa chúng về chỗ cũ rồi bấm Sửa chữa lần nữa. Các hư hỏng là:",
        ],
        _ if needs_backup && !summary.is_repairable() => [
            "Damage was found that Repair cannot mend: put your last backup in place of the catalog. The damage is:",
            "Có hư hỏng mà Sửa chữa không sửa được: hãy thay danh mục bằng bản sao lưu gần nhất. Các hư hỏng là:",
        ],
        _ if !repair && summary.is_repairable() => [
            "Damage was found. Press Repair to mend what can be mended:",
            "Có hư hỏng. Hãy bấm Sửa chữa để sửa những gì sửa được:",
        ],
        _ => [
            "Damage was found that Repair cannot mend:",
            "Có hư hỏng mà Sửa chữa không sửa được:",
        ],
    }
}

/// Returns the label of a number of findings of a kind in Vietnamese.
const fn vietnamese_heading(kind: Kind) -> &'static str {
    match kind {
        Kind::Database => "lỗi của cơ sở dữ liệu",
        Kind::Schema => "bảng, chỉ mục hoặc trigger khác với lược đồ",
        Kind::Row => "dòng hỏng mà không lần chạy nào tính lại được",
        Kind::Fingerprint => "dấu vân tay khác với thiết lập",
        Kind::Reference => "dòng trỏ đến dòng bị thiếu",
        Kind::Counter => "số đếm sai",
        Kind::JobMissing => "cặp không có việc",
        Kind::ReasonMissing => "cặp lỗi không có lý do",
        Kind::ResultMissing => "kết quả bị thiếu",
        Kind::ResultChanged => "kết quả bị đổi",
        Kind::Metrics => "cặp có số đo khác với kết quả",
        Kind::FileMissing => "tệp bị thiếu",
        Kind::FileChanged => "tệp bị đổi",
        Kind::FileUnreadable => "tệp không đọc được",
    }
}

#[cfg(test)]
mod tests {
    use super::{Notes, note_line};

    #[test]
    fn files_of_pairs_are_named_in_both_languages() {
        let notes = Notes {
            count: 4,
            first: vec![
                "scans/list of/3.ply of a3".to_owned(),
                "prints/4.jpg may not be read: permission denied (a4)".to_owned(),
                "odd".to_owned(),
                "not shown".to_owned(),
            ],
        };
        let lines = note_line(
            (
                ["missing input file", "missing input files"],
                "tệp đầu vào bị thiếu",
            ),
            &notes,
        );
        let expected = [
            "4 missing input files: scans/list of/3.ply of a3, prints/4.jpg may not be read: permission denied (a4), odd",
            "4 tệp đầu vào bị thiếu: scans/list of/3.ply của a3, không có quyền đọc prints/4.jpg (a4), odd",
        ];
        assert_eq!(lines, expected);
    }
}
