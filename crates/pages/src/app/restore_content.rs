//! What a backup holds, before a project is made of it, with the form that does it.

use std::path::Path;
use std::sync::Arc;

use axum::extract::State;
use axum::response::Html;
use maud::{Markup, html};

use super::backup_files::BACKUPS;
use super::components::{action_form, grouped};
use super::failure::{AppFailure, AppResult};
use super::folder_picker::PickerRoots;
use super::home::free_space;
use super::looked_part::{first_missing, looked_at_text};
use super::number_text::{english_count, english_form};
use super::project_name::{NAME_CHARS, new_project_dir};
use super::restore_action::{check_backup_file, check_room, restore_sentence};
use super::restore_page::chosen_path;
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::read_on_thread;
use mocban_core::domain::one_line;
use mocban_project::backup_content::{BackupContent, backup_content};
use mocban_project::input_list::inputs_folder;
use mocban_project::input_places::InputPlaces;
use mocban_project::{ProjectError, ProjectResult};
use mocban_system::platform;

/// Most names that are tried for a new project.
const MAX_NAMES: u32 = 100;

/// Responds with the content of the backup that the address names.
pub(super) async fn part(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let folder = state.options.folder.clone();
    let given = |name| visit.query.get(name).unwrap_or_default().to_owned();
    let (backup, inputs) = (given("backup"), given("inputs"));
    let read =
        read_on_thread(async move || Ok::<_, ProjectError>(read(&folder, &backup, &inputs).await));
    let read = read.await;
    let part = match read? {
        Ok((content, name)) => content_part(&visit, &state.options.folder, &content, &name),
        Err(failure) => html! { p.notice.bad role="alert" { (failure.text(visit.language)) } },
    };
    Ok(Html(part.into_string()))
}

/// Reads a backup. Returns its content, and a name for the new project. Refuses `inputs`, the folder in which files are looked
/// for, as the restore would.
async fn read(folder: &Path, given: &str, inputs: &str) -> AppResult<(BackupContent, String)> {
    let roots = PickerRoots::new(folder);
    let backup = chosen_path(&roots, given)?;
    check_backup_file(&backup)?;
    let chosen = if inputs.is_empty() {
        None
    } else {
        Some(roots.allowed(Path::new(inputs))?)
    };
    let name = free_name(folder, &backup);
    let dir = folder.join(&name);
    let content: ProjectResult<BackupContent> =
        backup_content(&backup, &dir, chosen.as_deref()).await;
    let content = content
        .map_err(|error| AppFailure::refused(restore_sentence(&error, &backup, folder, &name)))?;
    Ok((content, name))
}

/// Returns the name of a project that does not exist: that of the backup or of its project, or a similar one.
fn free_name(folder: &Path, backup: &Path) -> String {
    let parent = backup.parent().filter(|parent| parent.ends_with(BACKUPS));
    let of_project = parent.and_then(Path::parent).and_then(Path::file_name);
    let stem = of_project.or(backup.file_stem()).unwrap_or_default();
    let stem: String = stem
        .to_string_lossy()
        .chars()
        .take(NAME_CHARS - 4)
        .collect();
    let is_plain = new_project_dir(&stem, folder).is_ok();
    let stem = if is_plain { stem.trim() } else { "restored" };
    let others = (2..MAX_NAMES).map(|number| format!("{stem} {number}"));
    let mut names = std::iter::once(stem.to_owned()).chain(others);
    let free = names.find(|name| !folder.join(name).exists());
    free.unwrap_or_default()
}

fn content_part(visit: &Visit, folder: &Path, content: &BackupContent, name: &str) -> Markup {
    let inputs = visit.query.get("inputs");
    // A folder that was chosen is used instead of that beside the backup.
    let copies = content.copies.as_ref().filter(|_| inputs.is_none());
    let copied = copies.map_or(0, |copies| copies.bytes);
    let room = check_room(folder, content.bytes, copied);
    // An interrupted restore may have copied already what the disk has no room for.
    let may_start = check_room(folder, content.bytes, 0).is_ok();
    let list_problem = content.list_problem.as_ref().filter(|_| inputs.is_none());
    html! {
        h2 { (visit.t("What is in the backup", "Bản sao lưu có gì")) }
        dl {
            dt { (visit.t("Pairs", "Các cặp")) } dd { b { (grouped(content.pairs)) } }
            @if content.blocks > 0 { dt { (visit.t("Blocks", "Các ván")) } dd { (grouped(content.blocks)) } }
            dt { (visit.t("Verdicts", "Đánh giá")) } dd { (grouped(content.verdicts)) }
            @if let Some(time) = content.written { dt { (visit.t("Written", "Thời điểm ghi")) } dd { (visit.time(time)) } }
            @if let Some(time) = content.last_activity { dt { (visit.t("Last result", "Kết quả mới nhất")) } dd { (visit.time(time)) } }
            dt { (visit.t("Size", "Dung lượng")) }
            dd { (visit.file_size(content.bytes)) @if let Some(free) = platform::free_bytes(folder) { " · " (free_space(visit, free)) } }
            dt { (visit.t("Scans and prints", "Bản quét và bản in")) } dd { (inputs_text(visit, content, inputs)) }
        }
        @if copies.is_some() && content.not_copied > 0 {
            @let named = content.first_not_copied.iter().map(|path| one_line(path).to_string()).collect::<Vec<_>>().join(", ");
            p.notice.warn #not-copied {
                (visit.t(
                    "Scans and prints that are not beside the backup, because they were missing or changed when it was made, or are in an object store",
                    "Số bản quét và bản in không có bên cạnh bản sao lưu, vì bị thiếu hoặc đã đổi khi sao lưu, hay nằm ở kho đối tượng",
                )) ": " b { (grouped(content.not_copied)) } " (" (named)
                @if content.not_copied > content.first_not_copied.len() as u64 { ", …" }
                "). "
                (visit.t("Their pairs fail in the new project until the files are at their places.", "Các cặp của chúng sẽ lỗi trong dự án mới cho đến khi các tệp có ở đúng chỗ."))
            }
        }
        @if let Err(why) = &room { p.notice.bad role="alert" { (why.text(visit.language)) } }
        @if let Some(problem) = list_problem {
            (list_problem_part(visit, problem))
        } @else if may_start {
            (action_form("actions/restore", "fields", &html! {
                input type="hidden" name="backup" value=(visit.query.get("backup").unwrap_or_default());
                @if let Some(inputs) = inputs { input type="hidden" name="inputs" value=(inputs); }
                label { span { (visit.t("Name of the new project", "Tên dự án mới")) }
                    input #restore-name name="name" value=(name) required maxlength=(NAME_CHARS);
                }
                button.primary #restore { (visit.t("Restore", "Khôi phục")) }
            }))
        }
    }
}

/// Says that the folder beside the backup is not copied, and offers to look for files in it.
fn list_problem_part(visit: &Visit, problem: &str) -> Markup {
    let backup = visit.query.get("backup").unwrap_or_default();
    let folder = inputs_folder(Path::new(backup));
    let query = visit.query.with("inputs", &folder.to_string_lossy());
    let why = Sentence::of_program(problem);
    html! {
        p.notice.bad role="alert" {
            (why.text(visit.language)) ". "
            (visit.t(
                "So the scans and prints beside the backup cannot be copied. They can be found by their paths and stay where they are.",
                "Vì vậy không chép được các bản quét và bản in bên cạnh bản sao lưu. Có thể tìm chúng theo đường dẫn và để nguyên chúng tại chỗ.",
            ))
        }
        p.row { a.button href={ "restore" (query.text()) } { (visit.t("Look for them there", "Tìm chúng ở đó")) } }
    }
}

/// Says where scans and prints will be read: copied from beside the backup, or at their places.
fn inputs_text(visit: &Visit, content: &BackupContent, inputs: Option<&str>) -> String {
    let copies = content.copies.as_ref().filter(|_| inputs.is_none());
    if let Some(copies) = copies {
        let (files, size) = (grouped(copies.files), visit.file_size(copies.bytes));
        let said = Sentence::new(
            format!(
                "Beside the backup: {}, {size}. {} copied into the new project.",
                english_count(copies.files, ["file", "files"]),
                english_form(copies.files, ["It is", "They are"])
            ),
            format!("Ở bên cạnh bản sao lưu: {files} tệp, {size}. Chúng được chép vào dự án mới."),
        );
        return said.text(visit.language).to_owned();
    }
    let said = match inputs {
        Some(inputs) => {
            let inputs = one_line(inputs);
            let [found, found_vi] = found_in_folder(&content.inputs);
            Sentence::new(
                format!(
                    "Not in a backup. Files that are not at their places are looked for in {inputs}. {found}"
                ),
                format!(
                    "Không có trong bản sao lưu. Các tệp không có ở đúng chỗ sẽ được tìm trong {inputs}. {found_vi}"
                ),
            )
        }
        None => places_sentence(&content.inputs),
    };
    said.text(visit.language).to_owned()
}

/// Says how many scans and prints are missing although they were looked for in a folder, too.
fn found_in_folder(places: &InputPlaces) -> [String; 2] {
    let [looked_at, looked_at_vi] = looked_at_text(places);
    if places.looked_at == 0 {
        return [format!("{looked_at}."), format!("{looked_at_vi}.")];
    }
    if places.missing == 0 {
        return [
            format!("{looked_at}. None of these is missing."),
            format!("{looked_at_vi}. Không thiếu tệp nào trong số này."),
        ];
    }
    let (missing, first) = (grouped(places.missing as u64), first_missing(places));
    [
        format!("{looked_at}. Missing: {missing} ({first})."),
        format!("{looked_at_vi}. Số tệp thiếu: {missing} ({first})."),
    ]
}

/// Says how many scans and prints were looked at, and which of these the new project would not find.
fn places_sentence(places: &InputPlaces) -> Sentence {
    let [looked_at, looked_at_vi] = looked_at_text(places);
    let (not, not_vi) = ("Not in a backup.", "Không có trong bản sao lưu.");
    if places.looked_at == 0 {
        return Sentence::new(
            format!(
                "{not} The new project reads them from their places. It is not known whether they are there. {looked_at}."
            ),
            format!(
                "{not_vi} Dự án mới sẽ đọc chúng từ chỗ của chúng. Không rõ chúng có ở đó không. {looked_at_vi}."
            ),
        );
    }
    if places.missing == 0 {
        return Sentence::new(
            format!(
                "{not} {looked_at}. These are at their places, from which the new project reads them."
            ),
            format!(
                "{not_vi} {looked_at_vi}. Các tệp này đều có ở đúng chỗ, và dự án mới sẽ đọc chúng từ đó."
            ),
        );
    }
    let [missing, inside] = [places.missing, places.missing_inside].map(|n| grouped(n as u64));
    let first = first_missing(places);
    let [of_project, of_project_vi] = if places.missing_inside > 0 {
        [
            format!(
                " The old project had {inside} of them in its own folder, and the new one looks for them in its own."
            ),
            format!(
                " Trong đó {inside} tệp nằm trong thư mục của dự án cũ, còn dự án mới sẽ tìm chúng trong thư mục của chính nó."
            ),
        ]
    } else {
        [String::new(), String::new()]
    };
    Sentence::new(
        format!(
            "{not} {looked_at}. Missing: {missing} ({first}).{of_project} Choose their folder below."
        ),
        format!(
            "{not_vi} {looked_at_vi}. Số tệp thiếu: {missing} ({first}).{of_project_vi} Hãy chọn thư mục của chúng ở bên dưới."
        ),
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{found_in_folder, free_name, places_sentence};
    use crate::review::Language;
    use mocban_project::input_places::InputPlaces;

    #[test]
    fn a_new_project_is_named_like_the_one_that_was_backed_up() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let name = |backup: &str| free_name(dir.path(), Path::new(backup));
        assert_eq!(name("/x/ván 04/backups/backup.sqlite"), "ván 04");
        assert_eq!(name("/x/old blocks.sqlite"), "old blocks");
        std::fs::create_dir(dir.path().join("ván 04")).expect("a folder");
        assert_eq!(name("/x/ván 04/backups/backup.sqlite"), "ván 04 2");
        assert_eq!(name("/x/uploads.sqlite"), "restored");
        assert_eq!(name("/x/a:b.sqlite"), "restored");
    }

    #[test]
    fn only_files_that_were_looked_at_are_said_to_be_there() {
        let of = |looked_at: usize, missing: usize, missing_inside: usize| {
            let places = InputPlaces {
                known: 9,
                has_more: looked_at > 8,
                looked_at,
                missing,
                missing_inside,
                first: (0..missing).map(|i| format!("scans/{i}.stl")).collect(),
            };
            let sentence = places_sentence(&places);
            Language::ALL.map(|language| sentence.text(language).to_owned())
        };
        for (said, parts) in [
            (
                of(0, 0, 0),
                [
                    "not known whether they are there. Files that were looked at: 0 of 9.",
                    "Không rõ chúng có ở đó không. Số tệp đã kiểm tra: 0 trên 9.",
                ],
            ),
            (
                of(8, 0, 0),
                [
                    "Files that were looked at: 8 of 9. These are at their places",
                    "Số tệp đã kiểm tra: 8 trên 9. Các tệp này đều có ở đúng chỗ",
                ],
            ),
            (
                of(9, 2, 1),
                [
                    "9 of more than 9. Missing: 2 (scans/0.stl, scans/1.stl). The old project had 1 of them",
                    "9 trên hơn 9. Số tệp thiếu: 2 (scans/0.stl, scans/1.stl). Trong đó 1 tệp nằm trong thư mục của dự án cũ",
                ],
            ),
            (
                of(8, 1, 0),
                [
                    "Missing: 1 (scans/0.stl). Choose their folder below.",
                    "Số tệp thiếu: 1 (scans/0.stl). Hãy chọn thư mục của chúng",
                ],
            ),
        ] {
            for (text, part) in said.iter().zip(parts) {
                assert!(text.contains(part), "{part}: {text}");
            }
        }
    }

    #[test]
    fn files_that_a_chosen_folder_lacks_are_counted() {
        let mut places = InputPlaces {
            known: 4,
            looked_at: 4,
            missing: 1,
            first: vec!["scans/2.stl".to_owned()],
            ..InputPlaces::default()
        };
        let [english, vietnamese] = found_in_folder(&places);
        assert!(english.ends_with("4 of 4. Missing: 1 (scans/2.stl)."));
        assert!(vietnamese.ends_with("4 trên 4. Số tệp thiếu: 1 (scans/2.stl)."));
        places.missing = 0;
        let [english, vietnamese] = found_in_folder(&places);
        assert!(english.ends_with("4 of 4. None of these is missing."));
        assert!(vietnamese.ends_with("4 trên 4. Không thiếu tệp nào trong số này."));
        places.looked_at = 0;
        let [english, _] = found_in_folder(&places);
        assert!(english.ends_with("0 of 4."), "{english}");
    }
}
