//! Makes a project of a backup, as a task of the app.

use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::folder_picker::PickerRoots;
use super::number_text::{english_count, english_form, file_size, grouped};
use super::project_name::new_project_dir;
use super::projects::is_project;
use super::read_only::refuse_read_only;
use super::restore_page::chosen_path;
use super::sentence::Sentence;
use super::state::AppState;
use super::tasks::{FinishedTask, TaskKind};
use crate::review::Language;
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{ErrorCode, FileKind, one_line, pointer_of};
use mocban_project::blocking::blocking;
use mocban_project::check::check;
use mocban_project::files::{is_backup, kind};
use mocban_project::input_list::{InputCopies, copies_beside};
use mocban_project::location::Location;
use mocban_project::restore::{RestoreRequest, Restored, is_free, restore};
use mocban_project::{ProjectError, ProjectResult};
use mocban_runner::check::{CheckOptions, CheckSummary};
use mocban_system::platform;

/// The fields of the form that restores a backup.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RestoreBackupBody {
    #[serde(default)]
    backup: String,
    /// Name of the new project.
    #[serde(default)]
    name: String,
    /// A folder with scans and prints.
    #[serde(default)]
    inputs: String,
}

/// Starts to restore a backup.
pub(super) async fn start(
    State(state): State<Arc<AppState>>,
    ActionBody(body): ActionBody<RestoreBackupBody>,
) -> AppResult<Json<Value>> {
    refuse_read_only(&state, None).await?;
    let folder = state.options.folder.clone();
    let name = body.name.trim().to_owned();
    let address = PageQuery::default()
        .with("backup", &body.backup)
        .with("inputs", &body.inputs)
        .with("name", &name);
    let look = {
        let (folder, name) = (folder.clone(), name.clone());
        move || request(&folder, &name, &body)
    };
    let request = blocking(look).await??;
    let explain = {
        let (backup, folder, name) = (request.backup.clone(), folder.clone(), name.clone());
        move |error: &ProjectError| restore_sentence(error, &backup, &folder, &name)
    };
    let work = move || restore_lines(request, Location::new(folder));
    let tasks = &state.tasks;
    tasks.start_named(TaskKind::Restore, &name, explain, work)?;
    Ok(Json(json!({ "go": format!("restore{}", address.text()) })))
}

/// Returns what is restored.
///
/// # Errors
/// Refuses a file that is no backup, a name that is taken, and a disk without room.
fn request(folder: &Path, name: &str, body: &RestoreBackupBody) -> AppResult<RestoreRequest> {
    let roots = PickerRoots::new(folder);
    let backup = chosen_path(&roots, &body.backup)?;
    check_backup_file(&backup)?;
    let dir = new_project_dir(name, folder)?;
    if is_project(&dir) || !is_free(&dir).map_err(|error| AppFailure::of(error, &dir))? {
        let name = quoted(name);
        return Err(AppFailure::refused(Sentence::new(
            format!("there is a folder {name} already: give the new project another name"),
            format!("đã có thư mục {name}: hãy đặt tên khác cho dự án mới"),
        )));
    }
    let inputs = (!body.inputs.is_empty()).then(|| roots.allowed(Path::new(&body.inputs)));
    let inputs = inputs.transpose()?;
    let bytes = std::fs::metadata(&backup).map_or(0, |meta| meta.len());
    let copies = match inputs {
        Some(_) => None,
        None => copies_beside(&backup).map_err(|error| {
            AppFailure::refused(restore_sentence(&error, &backup, folder, name))
        })?,
    };
    let copied = match copies {
        // What an interrupted restore has copied there is not copied again. `restore` checks the room for the rest.
        Some(copies) if !dir.exists() => copies.bytes,
        _ => 0,
    };
    check_room(folder, bytes, copied).map_err(AppFailure::refused)?;
    Ok(RestoreRequest {
        backup,
        dir,
        inputs,
    })
}

/// Refuses a file that is no backup.
pub(super) fn check_backup_file(backup: &Path) -> AppResult<()> {
    if is_backup(backup).unwrap_or(false) {
        return Ok(());
    }
    let shown = backup.display();
    if kind(backup) == Some(FileKind::LfsPointer) {
        return Err(AppFailure::refused(Sentence::new(
            format!("{shown} {}", pointer_of("backup")),
            format!(
                "{shown} là con trỏ của Git LFS và không chứa bản sao lưu; hãy tải nội dung bằng `git lfs pull`"
            ),
        )));
    }
    Err(AppFailure::refused(Sentence::new(
        format!(
            "{shown} is not a backup: choose a file that the page Health of a project has made"
        ),
        format!(
            "{shown} không phải là bản sao lưu: hãy chọn tệp mà trang Tình trạng của một dự án đã tạo"
        ),
    )))
}

/// Refuses a backup for which the disk has no room. `copied` is the length of the scans and prints that are copied.
///
/// # Errors
/// Returns the reason.
pub(super) fn check_room(folder: &Path, bytes: u64, copied: u64) -> Result<(), Sentence> {
    // Paths of files are changed in a copy, whose log may become as long as it.
    let needed = bytes.saturating_mul(2).saturating_add(copied);
    let free = match platform::free_bytes(folder) {
        Some(free) if free < needed => free,
        _ => return Ok(()),
    };
    let sizes = |language| [needed, free].map(|bytes| file_size(language, bytes));
    let [english, vietnamese] = [Language::English, Language::Vietnamese].map(sizes);
    let [needed, free] = english;
    let english =
        format!("the new project needs {needed}, and the disk has {free}: make room and try again");
    let [needed, free] = vietnamese;
    let vietnamese =
        format!("dự án mới cần {needed}, đĩa còn {free}: hãy giải phóng dung lượng rồi thử lại");
    Err(Sentence::new(english, vietnamese))
}

/// Explains why a backup cannot be restored to a project with a name.
pub(super) fn restore_sentence(
    error: &ProjectError,
    backup: &Path,
    folder: &Path,
    name: &str,
) -> Sentence {
    let shown = backup.display();
    match error.code() {
        ErrorCode::Damaged | ErrorCode::DamagedFile | ErrorCode::NotACatalog => Sentence::new(
            format!("{shown} is damaged, so nothing was restored: choose another backup"),
            format!("{shown} bị hỏng nên chưa khôi phục gì: hãy chọn bản sao lưu khác"),
        ),
        ErrorCode::OtherVersion => Sentence::new(
            format!(
                "{shown} was made by another version of this program: restore it with that version"
            ),
            format!(
                "{shown} do một phiên bản khác của chương trình tạo ra: hãy khôi phục bằng phiên bản đó"
            ),
        ),
        code if is_disk_full(code, error, folder) => Sentence::new(
            "the disk is full, so nothing was restored: make room and try again",
            "đĩa đã đầy nên chưa khôi phục gì: hãy giải phóng dung lượng rồi thử lại",
        ),
        ErrorCode::OutputInUse => Sentence::new(
            format!(
                "another program restores to {} now: wait for its end, or give another name",
                quoted(name)
            ),
            format!(
                "một chương trình khác đang khôi phục vào {}: hãy chờ, hoặc đặt tên khác",
                quoted(name)
            ),
        ),
        ErrorCode::NotWritable => Sentence::new(
            format!(
                "{} cannot be written to: check its rights and its disk, and try again",
                folder.display()
            ),
            format!(
                "không ghi được vào {}: hãy kiểm tra quyền và ổ đĩa, rồi thử lại",
                folder.display()
            ),
        ),
        _ => Sentence::of_error(error, &folder.join(name)),
    }
}

/// Returns whether a disk was full. SQLite gives back the room of what it could not write, and says so only in its message.
fn is_disk_full(code: ErrorCode, error: &ProjectError, folder: &Path) -> bool {
    code == ErrorCode::DiskFull
        || error.to_string().ends_with("the disk is full")
        || platform::is_disk_full(folder)
}

/// Restores a backup, and lets the next run compute what no backup has.
async fn restore_lines(request: RestoreRequest, location: Location) -> ProjectResult<FinishedTask> {
    let restored = restore(&request, &location, &()).await?;
    // The project is there already, so what fails now is only said.
    let options = CheckOptions {
        repair: true,
        accept_missing: true,
        ..CheckOptions::default()
    };
    let at = location.at(&request.dir);
    let repaired = check(options, &at, &()).await;
    Ok(finished(&restored, repaired, &request.dir))
}

fn finished(
    restored: &Restored,
    repaired: ProjectResult<CheckSummary>,
    dir: &Path,
) -> FinishedTask {
    let [pairs, verdicts] = [restored.pairs, restored.verdicts].map(grouped);
    let mut lines = vec![[
        format!(
            "{} and {} were restored. A backup has no depth maps and masks: press Align on the page Run to compute them again.",
            english_count(restored.pairs, ["pair", "pairs"]),
            english_count(restored.verdicts, ["verdict", "verdicts"])
        ),
        format!(
            "Đã khôi phục {pairs} cặp và {verdicts} đánh giá. Bản sao lưu không có bản đồ độ sâu và mặt nạ: hãy bấm Căn chỉnh ở trang Căn chỉnh để tính lại."
        ),
    ]];
    if let Some(copied) = &restored.copied
        && copied.files > 0
    {
        lines.push(copied_line(copied, restored.elsewhere == 0));
    }
    if restored.elsewhere > 0 {
        let elsewhere = grouped(restored.elsewhere);
        lines.push([
            format!("Scans and prints without a whole copy beside the backup: {elsewhere}. They are read at their old places: keep them there."),
            format!("Số bản quét và bản in không có bản sao nguyên vẹn bên cạnh bản sao lưu: {elsewhere}. Chúng được đọc từ chỗ cũ: hãy giữ chúng ở đó."),
        ]);
    }
    let missing = match (&restored.not_in_place, restored.missing.first()) {
        (Some(found), _) => Some(missing_line(
            found.missing,
            Some(found.looked_at),
            &found.first,
        )),
        (None, Some(first)) => Some(missing_line(restored.missing.len(), None, first)),
        (None, None) => None,
    };
    let is_complete = missing.is_none();
    lines.extend(missing);
    let removed = restored.settings.as_ref().map(|settings| &settings.removed);
    if let Some(removed) = removed.filter(|removed| !removed.is_empty()) {
        let removed = removed.join(", ");
        lines.push([
            format!("The new project uses only its own folder, so these settings were switched off: {removed}."),
            format!("Dự án mới chỉ dùng thư mục của nó nên các thiết lập sau đã được tắt: {removed}."),
        ]);
    }
    let failure = repaired.err().map(|error| Sentence::of_error(&error, dir));
    if let Some(failure) = &failure {
        lines.push(
            [Language::English, Language::Vietnamese]
                .map(|language| failure.text(language).to_owned()),
        );
    }
    let is_warning = !is_complete || failure.is_some() || restored.elsewhere > 0;
    FinishedTask::new(lines, is_warning)
}

/// Says how many files are not where the new project reads them, and of how many if only some were looked at.
fn missing_line(missing: usize, looked_at: Option<usize>, first: &str) -> [String; 2] {
    let (missing, first) = (grouped(missing as u64), one_line(first));
    let [of, of_vi] = match looked_at.map(|number| grouped(number as u64)) {
        Some(number) => [
            format!(" of {number} that were looked at"),
            format!(" trên {number} tệp đã kiểm tra"),
        ],
        None => [String::new(), String::new()],
    };
    [
        format!(
            "Scans and prints that were not found: {missing}{of}, first {first}. Put them at their places, or restore the backup again with their folder."
        ),
        format!(
            "Số bản quét và bản in không tìm thấy: {missing}{of_vi}, đầu tiên là {first}. Hãy đặt chúng vào đúng chỗ, hoặc khôi phục lại và chọn thư mục của chúng."
        ),
    ]
}

/// Says how much was copied into the project, and whether it needs no other folder.
fn copied_line(copied: &InputCopies, is_all: bool) -> [String; 2] {
    let files = grouped(copied.files);
    let [english, vietnamese] =
        [Language::English, Language::Vietnamese].map(|language| file_size(language, copied.bytes));
    let [needs, needs_vi] = if is_all {
        [
            ", which does not need the folder beside the backup",
            " nên dự án không cần thư mục bên cạnh bản sao lưu",
        ]
    } else {
        ["", ""]
    };
    [
        format!(
            "{} ({english}) {} copied into the project{needs}.",
            english_count(copied.files, ["scan or print", "scans and prints"]),
            english_form(copied.files, ["was", "were"])
        ),
        format!("Đã chép {files} bản quét và bản in ({vietnamese}) vào dự án{needs_vi}."),
    ]
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::{RestoreBackupBody, check_room, copied_line, missing_line, request};
    use crate::review::Language;
    use mocban_project::input_list::InputCopies;

    #[test]
    fn a_project_that_reads_files_elsewhere_is_not_said_to_need_no_folder() {
        let copied = InputCopies {
            folder: PathBuf::from("b.sqlite.inputs"),
            files: 3,
            bytes: 7_000,
        };
        for (is_all, parts) in [
            (true, ["does not need", "không cần thư mục"]),
            (false, ["copied into the project.", "vào dự án."]),
        ] {
            let line = copied_line(&copied, is_all);
            for (text, part) in line.iter().zip(parts) {
                assert!(text.contains(part), "{part}: {text}");
            }
        }
    }

    #[test]
    fn missing_files_are_counted_of_those_that_were_looked_at() {
        for (looked_at, parts) in [
            (
                Some(30),
                [
                    ": 4 of 30 that were looked at, first p/1.stl.",
                    ": 4 trên 30 tệp đã kiểm tra",
                ],
            ),
            (None, [": 4, first p/1.stl.", ": 4, đầu tiên là p/1.stl."]),
        ] {
            for (text, part) in missing_line(4, looked_at, "p/1.stl").iter().zip(parts) {
                assert!(text.contains(part), "{part}: {text}");
            }
        }
    }

    #[test]
    fn a_backup_that_does_not_fit_the_disk_is_refused_in_both_languages() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        check_room(dir.path(), 0, 0).expect("room for nothing");
        for (bytes, copied) in [(u64::MAX / 2, 0), (0, u64::MAX)] {
            if !cfg!(unix) {
                continue;
            }
            let why = check_room(dir.path(), bytes, copied).expect_err("no disk is so large");
            assert!(
                why.text(Language::English).contains("the disk has"),
                "{why:?}"
            );
            assert!(
                why.text(Language::Vietnamese).contains("đĩa còn"),
                "{why:?}"
            );
        }
    }

    #[test]
    fn nothing_is_restored_without_a_backup() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("notes.sqlite");
        std::fs::write(&file, "text").expect("written");
        for backup in [
            String::new(),
            file.display().to_string(),
            "/etc/passwd".to_owned(),
        ] {
            let (name, inputs) = ("new".to_owned(), String::new());
            let body = RestoreBackupBody {
                backup,
                name,
                inputs,
            };
            request(dir.path(), "new", &body).expect_err("no backup");
        }
        assert!(!dir.path().join("new").exists());
    }
}
