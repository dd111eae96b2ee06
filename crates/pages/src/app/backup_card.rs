//! The backup of a project: its form, with the size of the scans and prints, and what was stored.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::{Html, Response};
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::attachment::attachment;
use super::components::{action_form, grouped};
use super::failure::{AppFailure, AppResult};
use super::number_text::{english_count, english_form, file_size};
use super::read_only::refuse_read_only_output;
use super::sentence::Sentence;
use super::state::AppState;
use super::tasks::{FinishedTask, TaskKind, TaskLines};
use super::visit::Visit;
use crate::on_thread::read_on_thread;
use crate::review::Language;
use mocban_core::domain::one_line;
use mocban_project::ProjectResult;
use mocban_project::backup::backup;
use mocban_project::backup_checks::free_beside;
use mocban_project::backup_inputs::{InputsSize, LeftOutReason, SavedInputs, inputs_size};
use mocban_project::input_list::inputs_folder;
use mocban_project::location::Location;

/// Path of the backup in a project.
pub(super) const BACKUP: &str = "backups/backup.sqlite";
/// Largest backup that is offered for download, bytes.
pub(super) const DOWNLOAD_BYTES: u64 = 256 << 20;
/// Most inputs that are named because they were not copied.
const SHOWN: usize = 3;

/// Returns the card with the form.
pub(super) fn card(visit: &Visit) -> Markup {
    html! {
        section.card {
            h2 { (visit.t("Backup", "Sao lưu")) }
            p { (visit.t("One file with pairs, results, verdicts and settings, also during a run. Depth maps and masks are not in it. Copy it to another disk.", "Một tệp gồm các cặp, kết quả, đánh giá và thiết lập, kể cả khi đang chạy. Không gồm bản đồ độ sâu và mặt nạ. Hãy chép sang ổ đĩa khác.")) }
            (action_form("actions/backup", "inline", &html! {
                label.check {
                    input #with-inputs type="checkbox" name="inputs" value="yes" autocomplete="off"; " "
                    (visit.t("with the scans and prints", "kèm bản quét và bản in")) " "
                    span.muted #inputs-size data-load="health/inputs" aria-live="polite" { (visit.t("(adding up their sizes…)", "(đang tính dung lượng…)")) }
                }
                button #backup { (visit.t("Back up now", "Sao lưu ngay")) }
            }))
        }
    }
}

/// Responds with the size of the scans and prints, and with the room for them.
pub(super) async fn size_part(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let (location, folder) = (open.location(), inputs_folder(&open.dir.join(BACKUP)));
    let free = free_beside(&folder);
    let size = read_on_thread(async move || inputs_size(&folder, &location).await).await?;
    let said = size_sentence(&size, free);
    let part = html! { (said.text(visit.language)) };
    Ok(Html(part.into_string()))
}

/// Says how large the scans and prints are, and how much of the disk is free.
fn size_sentence(size: &InputsSize, free: Option<u64>) -> Sentence {
    let texts = Language::ALL.map(|language| {
        let is_english = matches!(language, Language::English);
        let of = |bytes: u64, english: &str, vietnamese: &str| {
            let (bytes, words) = (
                file_size(language, bytes),
                if is_english { english } else { vietnamese },
            );
            words.replace("{}", &bytes)
        };
        let mut parts = vec![if size.is_partial {
            of(size.bytes, "at least {}", "ít nhất {}")
        } else {
            file_size(language, size.bytes)
        }];
        if size.to_copy < size.bytes {
            parts.push(of(size.to_copy, "{} of it new", "trong đó {} mới"));
        }
        parts.extend(free.map(|free| of(free, "{} are free", "đĩa còn trống {}")));
        let mut text = format!("({})", parts.join("; "));
        if free.is_some_and(|free| free < size.to_copy) {
            text += if is_english {
                ": not enough room"
            } else {
                ": không đủ chỗ"
            };
        }
        if size.remote > 0 {
            let remote = grouped(size.remote);
            let [before, after] = if is_english {
                [
                    "; without ",
                    english_form(
                        size.remote,
                        [" file of an object store", " files of an object store"],
                    ),
                ]
            } else {
                ["; không gồm ", " tệp ở kho đối tượng"]
            };
            text.extend([before, &remote, after]);
        }
        text
    });
    let [english, vietnamese] = texts;
    Sentence::new(english, vietnamese)
}

/// The field of the form that starts a backup.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BackupBody {
    /// `yes` to copy the scans and prints, too.
    #[serde(default)]
    inputs: String,
}

/// Starts a backup.
pub(super) async fn start(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<BackupBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let with_inputs = body.inputs == "yes";
    let file = open.dir.join(BACKUP);
    refuse_read_only_output(file.parent().unwrap_or(&open.dir))?;
    let work = move |location| backup_lines(location, with_inputs);
    state.tasks.start(TaskKind::Backup, &open, work)?;
    Ok(Json(json!({ "reload": true })))
}

async fn backup_lines(location: Location, with_inputs: bool) -> ProjectResult<FinishedTask> {
    let stored = backup(&location.dir.join(BACKUP), with_inputs, &location, &()).await?;
    let [pairs, verdicts] = [stored.pairs, stored.verdicts].map(grouped);
    let [english, vietnamese] =
        [Language::English, Language::Vietnamese].map(|language| file_size(language, stored.bytes));
    let mut lines = vec![[
        format!(
            "{} and {} are in the backup ({english}).",
            english_count(stored.pairs, ["pair", "pairs"]),
            english_count(stored.verdicts, ["verdict", "verdicts"])
        ),
        format!("Bản sao lưu có {pairs} cặp và {verdicts} đánh giá ({vietnamese})."),
    ]];
    lines.extend(stored.inputs.as_ref().map_or_else(Vec::new, inputs_lines));
    let is_warning = stored.inputs.is_some_and(|inputs| inputs.left_out > 0);
    Ok(FinishedTask::new(lines, is_warning))
}

/// Says which scans and prints were saved, and which were not.
fn inputs_lines(saved: &SavedInputs) -> TaskLines {
    let [files, copied] = [saved.copies.files, saved.copied].map(grouped);
    let folder = saved.copies.folder.to_string_lossy();
    let folder = one_line(&folder);
    let [english, vietnamese] = [Language::English, Language::Vietnamese]
        .map(|language| file_size(language, saved.copies.bytes));
    let mut lines = vec![[
        format!(
            "{} ({english}) {} in {folder}, {copied} of them {} copied now. Copy this folder together with the backup.",
            english_count(saved.copies.files, ["scan or print", "scans and prints"]),
            english_form(saved.copies.files, ["is", "are"]),
            english_form(saved.copied, ["was", "were"])
        ),
        format!(
            "{files} bản quét và bản in ({vietnamese}) nằm trong {folder}, {copied} trong số đó vừa được chép. Hãy chép cả thư mục này cùng với bản sao lưu."
        ),
    ]];
    if saved.remote > 0 {
        let remote = grouped(saved.remote);
        lines.push([
            format!("Files of an object store that were not copied: {remote}."),
            format!("Số tệp ở kho đối tượng không được chép: {remote}."),
        ]);
    }
    if saved.left_out > 0 {
        let left_out = grouped(saved.left_out);
        let [english, vietnamese] = [0, 1].map(|index| {
            let named = saved.first_left_out.iter().take(SHOWN).map(|input| {
                let why = match input.reason {
                    LeftOutReason::Missing => ["missing", "bị thiếu"],
                    LeftOutReason::Changed => ["changed", "đã đổi"],
                    LeftOutReason::Unreadable => ["cannot be read", "không đọc được"],
                    LeftOutReason::Unwritable => [
                        "name or size not allowed on this disk",
                        "ổ đĩa không cho phép tên hoặc kích thước này",
                    ],
                };
                format!("{} ({})", one_line(&input.path), why[index])
            });
            named.collect::<Vec<_>>().join(", ")
        });
        lines.push([
            format!("Scans and prints that were not saved: {left_out}, {english}. Put missing files back; if files have changed, press Look for changed files on the page Run; then back up again."),
            format!("Số bản quét và bản in chưa được sao lưu: {left_out}, {vietnamese}. Hãy đưa tệp thiếu về chỗ cũ; nếu có tệp đã đổi, hãy bấm Tìm tệp đã đổi ở trang Căn chỉnh; rồi sao lưu lại."),
        ]);
    }
    lines
}

/// Responds with the backup.
pub(super) async fn download(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let file = open.dir.join(BACKUP);
    let read = move || {
        let length = std::fs::metadata(&file).ok()?.len();
        (length <= DOWNLOAD_BYTES).then(|| std::fs::read(&file).ok())?
    };
    let read = tokio::task::spawn_blocking(read).await.ok().flatten();
    let bytes = read.ok_or_else(AppFailure::not_found)?;
    let name = format!("{}.sqlite", key.replace('/', "-"));
    Ok(attachment(&name, "application/vnd.sqlite3", bytes))
}

#[cfg(test)]
mod tests {
    use super::size_sentence;
    use crate::review::Language;
    use mocban_project::backup_inputs::InputsSize;

    #[test]
    fn the_size_says_what_is_new_and_whether_there_is_room() {
        let size = InputsSize {
            files: 12,
            bytes: 12_300_000_000,
            to_copy: 12_300_000_000,
            remote: 0,
            is_partial: false,
        };
        let text =
            |size: &InputsSize, free, language| size_sentence(size, free).text(language).to_owned();
        let free = Some(80_000_000_000);
        assert_eq!(
            text(&size, free, Language::English),
            "(12.3 GB; 80.0 GB are free)"
        );
        assert_eq!(
            text(&size, free, Language::Vietnamese),
            "(12,3 GB; đĩa còn trống 80,0 GB)"
        );
        let size = InputsSize {
            to_copy: 2_000_000_000,
            remote: 3,
            ..size
        };
        assert_eq!(
            text(&size, Some(1_000_000_000), Language::English),
            "(12.3 GB; 2.0 GB of it new; 1.0 GB are free): not enough room; without 3 files of an object store"
        );
        assert_eq!(
            text(&size, None, Language::Vietnamese),
            "(12,3 GB; trong đó 2,0 GB mới); không gồm 3 tệp ở kho đối tượng"
        );
        let size = InputsSize {
            is_partial: true,
            remote: 0,
            to_copy: size.bytes,
            ..size
        };
        assert_eq!(text(&size, None, Language::English), "(at least 12.3 GB)");
        assert_eq!(text(&size, None, Language::Vietnamese), "(ít nhất 12,3 GB)");
    }
}
