//! Says that an address names a project, a pair or a block that is not there.

use std::path::Path;

use super::failure::AppFailure;
use super::sentence::Sentence;
use mocban_core::domain::one_line;

/// Says that the folder of the app has no such project, or that the folder itself is not there.
pub(super) fn no_project(key: &str, folder: &Path) -> AppFailure {
    let (name, at) = (one_line(key), folder.display().to_string());
    let place = one_line(&at);
    AppFailure::missing(if folder.is_dir() {
        Sentence::new(
            format!(
                "The folder of the project {name} is not in {place}: it was moved, renamed or deleted. Move it back or give it its name again, and try again. If it was renamed, open it from All projects."
            ),
            format!(
                "Thư mục của dự án {name} không có trong {place}: thư mục đã bị chuyển, đổi tên hoặc xóa. Hãy đưa nó về chỗ cũ hoặc đặt lại tên cũ rồi thử lại. Nếu đã đổi tên, hãy mở dự án từ Tất cả dự án."
            ),
        )
    } else {
        Sentence::new(
            format!(
                "The folder {place} is not there: it was moved, renamed or deleted, or its disk is not connected. Put it back and try again, or start the program in the folder where the projects are now."
            ),
            format!(
                "Không có thư mục {place}: thư mục đã bị chuyển, đổi tên hoặc xóa, hoặc ổ đĩa chưa được nối. Hãy đưa nó về chỗ cũ rồi thử lại, hoặc mở chương trình trong thư mục hiện chứa các dự án."
            ),
        )
    })
}

/// Says that a project has no pair of a name.
pub(super) fn no_pair(name: &str) -> AppFailure {
    let name = one_line(name);
    AppFailure::missing(Sentence::new(
        format!("This project has no pair {name}. Search for it on the page Pairs."),
        format!("Dự án này không có cặp {name}. Hãy tìm ở trang Các cặp."),
    ))
}

/// Says that a project has no whole block of a name.
pub(super) fn no_block(name: &str) -> AppFailure {
    let name = one_line(name);
    AppFailure::missing(Sentence::new(
        format!("This project has no block {name}. Choose one on the page Blocks."),
        format!("Dự án này không có ván {name}. Hãy chọn một ván ở trang Các ván."),
    ))
}

#[cfg(test)]
mod tests {
    use super::{no_block, no_pair, no_project};
    use crate::review::Language;

    #[test]
    fn what_is_missing_is_named_in_both_languages() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let lost = dir.path().join("lost");
        for (failure, parts) in [
            (
                no_project("kho ván", dir.path()),
                ["project kho ván is not in", "dự án kho ván không có trong"],
            ),
            (
                no_project("kho ván", &lost),
                ["/lost is not there", "/lost: thư mục đã bị chuyển"],
            ),
            (no_pair("b1/a"), ["has no pair b1/a.", "không có cặp b1/a."]),
            (no_block("b1"), ["has no block b1.", "không có ván b1."]),
        ] {
            assert_eq!(failure.status(), 404);
            for (language, part) in Language::ALL.into_iter().zip(parts) {
                let text = failure.text(language);
                assert!(text.contains(part), "{part}: {text}");
            }
        }
    }
}
