//! The folder of a new project, by the name that a person gives it.

use std::path::{Path, PathBuf};

use super::components::grouped;
use super::failure::{AppFailure, AppResult};
use super::projects::is_project;
use super::sentence::Sentence;
use super::uploads::FOLDER as UPLOADS;
use mocban_core::domain::is_device;
use mocban_core::domain::spelling::quoted;

/// Longest name of a new project, characters.
pub(super) const NAME_CHARS: usize = 60;
/// Characters that the name of a folder on Windows may not have. A project may be copied there.
const FORBIDDEN: [char; 9] = ['/', '\\', ':', '*', '?', '"', '<', '>', '|'];

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
    match problem(name) {
        None => Ok(folder.join(name)),
        Some(why) => Err(AppFailure::refused(why)),
    }
}

/// Returns what is wrong with the name of a project and how to name it instead, or `None` if it can have this name.
fn problem(name: &str) -> Option<Sentence> {
    if name.is_empty() {
        return Some(Sentence::new(
            "the name of the project is empty: give it a name",
            "tên dự án đang để trống: hãy đặt tên cho dự án",
        ));
    }
    let [why, why_vi] = if name.starts_with('.') {
        [
            "begins with a dot: begin it with another character".to_owned(),
            "bắt đầu bằng dấu chấm: hãy bắt đầu bằng ký tự khác".to_owned(),
        ]
    } else if let Some(other) = name.chars().find(|c| FORBIDDEN.contains(c)) {
        let others = FORBIDDEN.map(String::from).join(" ");
        [
            format!("has \"{other}\": give a name without any of {others}"),
            format!("có ký tự \"{other}\": hãy đặt tên không có các ký tự {others}"),
        ]
    } else if is_device(name) {
        [
            "is that of a device on Windows, to which the project may be copied: give another name"
                .to_owned(),
            "là tên thiết bị của Windows, nơi dự án có thể được chép đến: hãy đặt tên khác"
                .to_owned(),
        ]
    } else if name.ends_with('.') {
        [
            "ends with a dot, which Windows leaves out: end it with another character".to_owned(),
            "kết thúc bằng dấu chấm, mà Windows sẽ bỏ đi: hãy kết thúc bằng ký tự khác".to_owned(),
        ]
    } else if name.contains(char::is_control) {
        [
            "has a line break or another control character: give a name without it".to_owned(),
            "có dấu xuống dòng hoặc ký tự điều khiển khác: hãy đặt tên không có ký tự đó"
                .to_owned(),
        ]
    } else {
        let chars = name.chars().count();
        if chars <= NAME_CHARS {
            return None;
        }
        let number = grouped(chars as u64);
        [
            format!("has {number} characters: give a name of at most {NAME_CHARS}"),
            format!("có {number} ký tự: hãy đặt tên tối đa {NAME_CHARS} ký tự"),
        ]
    };
    let name = quoted(name);
    Some(Sentence::new(
        format!("{name} cannot be the name of a project, because it {why}"),
        format!("{name} không thể là tên dự án vì {why_vi}"),
    ))
}

#[cfg(test)]
mod tests {
    use super::problem;
    use crate::review::Language;

    #[test]
    fn a_name_is_refused_for_what_is_wrong_with_it() {
        let longest = "x".repeat(60);
        for name in ["ván 04", "b.c", "a…", "con 1", "com10", longest.as_str()] {
            assert_eq!(problem(name), None, "{name}");
        }
        let long = "x".repeat(61);
        for (name, parts) in [
            ("", ["is empty", "để trống"]),
            (
                ".an",
                [
                    "\".an\" cannot be the name of a project, because it begins with a dot",
                    "bắt đầu bằng dấu chấm",
                ],
            ),
            ("..", ["begins with a dot", "bắt đầu bằng dấu chấm"]),
            ("a/b", ["because it has \"/\": ", "có ký tự \"/\": "]),
            ("a:b", ["because it has \":\": ", "có ký tự \":\": "]),
            ("a?", ["because it has \"?\": ", "có ký tự \"?\": "]),
            ("Con", ["it is that of a device", "là tên thiết bị"]),
            ("nul.1", ["it is that of a device", "là tên thiết bị"]),
            ("com1", ["it is that of a device", "là tên thiết bị"]),
            ("ván.", ["it ends with a dot", "kết thúc bằng dấu chấm"]),
            ("a\nb", ["has a line break", "có dấu xuống dòng"]),
            (long.as_str(), ["has 61 characters", "có 61 ký tự"]),
        ] {
            let why = problem(name).expect("refused");
            for (language, part) in Language::ALL.into_iter().zip(parts) {
                let said = why.text(language);
                assert!(said.contains(part), "{part}: {said}");
            }
        }
    }
}
