//! The part of the page of imports with which a browser sends files.

use maud::{Markup, html};

use super::components::grouped;
use super::home::free_space;
use super::read_only::ReadOnlyPlace;
use super::received_files::{ARCHIVE, importable_extensions};
use super::upload_sentence::{MAX_FILES, RESERVE_BYTES};
use super::uploads::Uploads;
use super::visit::Visit;
use mocban_core::domain::one_line;
use mocban_lists::relative_path::SYSTEM_FOLDERS;
use mocban_system::platform;

/// Returns the part. The files will be imported into `project`, which may be empty.
pub(super) fn upload_part(visit: &Visit, uploads: &Uploads, project: &str) -> Markup {
    let extensions: Vec<&str> = importable_extensions().chain([ARCHIVE]).collect();
    let free = uploads.folder().parent().and_then(platform::free_bytes);
    html! {
        h2 { (visit.t("Files from this browser", "Tệp từ trình duyệt này")) }
        @if visit.read_only != Some(ReadOnlyPlace::Folder) && !uploads.may_write() {
            p.notice.warn { (ReadOnlyPlace::Folder.sentence().text(visit.language)) }
        }
        @if let Some(problem) = uploads.problem(project) {
            p #upload-last.notice.bad role="status" { (visit.t("The last upload did not end well: ", "Lần gửi trước không thành công: ")) (problem.text(visit.language)) }
        }
        form #upload.card.upload
            data-project=(project)
            data-extensions=(extensions.join(" "))
            data-system-folders=(SYSTEM_FOLDERS.join(" "))
            data-files=(visit.t("files", "tệp"))
            data-sending=(visit.t("Receiving the files", "Đang nhận các tệp"))
            data-unpacking=(visit.t("Unpacking", "Đang giải nén"))
            data-storing=(visit.t("Storing", "Đang lưu"))
            data-cancelled=(visit.t("The upload was cancelled. Nothing of it was kept.", "Đã hủy. Không tệp nào được giữ lại."))
            data-cut=(visit.t("The program did not take all files. Choose them again.", "Chương trình không nhận hết các tệp. Hãy chọn lại."))
            data-gone=(visit.t("The program does not answer, so it has not taken all files. Start it again, and choose them again on its page.", "Chương trình không trả lời nên chưa nhận hết các tệp. Hãy mở lại chương trình rồi chọn lại các tệp trên trang của nó."))
            data-arrived=(visit.t("Files that had arrived before and are not sent again", "Số tệp đã đến nơi từ trước và không phải gửi lại"))
            data-nothing=(visit.t("None of the files is a scan, an image, a list or a ZIP.", "Không có tệp nào là bản quét, hình ảnh, danh sách hay ZIP."))
        {
            div #upload-choice {
                p { (visit.t("Drag files, a folder or a ZIP here, or choose them:", "Kéo tệp, thư mục hoặc ZIP vào đây, hoặc chọn:")) }
                div.fields {
                    label { span { (visit.t("Files or a ZIP", "Các tệp hoặc ZIP")) } input #upload-files type="file" multiple; }
                    label { span { (visit.t("A folder", "Một thư mục")) } input #upload-folder type="file" webkitdirectory; }
                }
                p.muted {
                    (visit.t("They are copied to a new folder in", "Chúng được chép vào một thư mục mới trong")) " "
                    code { (one_line(&uploads.folder().to_string_lossy())) }
                    (visit.t(", from which the project reads them, so keep it. ", ", nơi dự án sẽ đọc chúng, vì vậy hãy giữ thư mục đó. "))
                    (visit.t("At most", "Tối đa")) " " (grouped(MAX_FILES)) " " (visit.t("files", "tệp")) "; "
                    (visit.file_size(RESERVE_BYTES)) " " (visit.t("of the disk stays free", "của đĩa được để trống"))
                    @if let Some(free) = free { " (" (free_space(visit, free)) ")" }
                    "."
                }
            }
            div #upload-state hidden {
                p #upload-phase role="status" {}
                p #upload-arrived role="status" hidden {}
                progress aria-label=(visit.t("Files that were received", "Các tệp đã nhận")) {}
                p #upload-done {}
                button #upload-cancel type="button" { (visit.t("Cancel", "Hủy")) }
            }
            p #upload-problem.problem role="alert" hidden {}
            button #upload-take-over.primary type="button" hidden { (visit.t("Take over", "Gửi tiếp ở đây")) }
        }
        script type="module" src={ (visit.root) "assets/upload.js" } {}
    }
}
