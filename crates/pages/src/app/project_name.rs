//! The folder of a new project, by the name that a person gives it.

use std::path::{Path, PathBuf};

use super::failure::{AppFailure, AppResult};
use super::projects::is_project;
use super::sentence::Sentence;
use super::uploads::FOLDER as UPLOADS;
use mocban_core::domain::spelling::quoted;

/// Longest name of a new project, characters.
pub(super) const NAME_CHARS: usize = 60;

/// Returns the folder of a new project in the folder of the app.
///
/// # Errors
/// Refuses a name that leads elsewhere, and any name if the folder of the app is a project itself.
pub(super) fn new_project_dir(given: &str, folder: &Path) -> AppResult<PathBuf> {
    if is_project(folder) {
        return Err(AppFailure::refused(Sentence::new(
            "the folder of the app is a project itself: start the app in the folder above it for a new one",
            "thư mục của ứng dụng đã là một dự án: hãy mở ứng dụng ở thư mục bên trên để tạo dự án mới",
        )));
    }
    let name = given.trim();
    if name.eq_ignore_ascii_case(UPLOADS) {
        let name = quoted(name);
        return Err(AppFailure::refused(Sentence::new(
            format!("{name} is the folder of files from browsers: give the project another name"),
            format!("{name} là thư mục của các tệp từ trình duyệt: hãy đặt tên khác cho dự án"),
        )));
    }
    let is_plain = !name.starts_with('.') && !name.contains(['/', '\\', ':']);
    let is_short = name.chars().count() <= NAME_CHARS && !name.is_empty();
    if is_plain && is_short && !name.contains(char::is_control) {
        return Ok(folder.join(name));
    }
    let given = quoted(given);
    Err(AppFailure::refused(Sentence::new(
        format!(
            "{given} cannot be the name of a project: give a name of at most {NAME_CHARS} characters without / and :"
        ),
        format!(
            "{given} không thể là tên dự án: hãy đặt tên tối đa {NAME_CHARS} ký tự, không có / và :"
        ),
    )))
}
