//! Why files from a browser are refused, in both languages.

use std::io::{self, ErrorKind};

use super::number_text::{english_form, file_size, grouped};
use super::sentence::{Sentence, system_reasons};
use crate::review::Language;
use mocban_core::domain::sanitize;
use mocban_core::domain::spelling::quoted;
use mocban_lists::relative_path::PathFault;
use mocban_lists::zip::ZipError;

/// Most files of an upload.
pub(super) const MAX_FILES: u64 = 50_000;
/// Bytes of the disk that an upload leaves free.
pub(super) const RESERVE_BYTES: u64 = 1_000_000_000;
/// Most bytes that an archive unpacks to, as a multiple of its own.
pub(super) const MAX_RATIO: u64 = 200;
/// Longest path in a sentence, in characters.
const MAX_SHOWN: usize = 120;

fn shown(path: &str) -> String {
    sanitize(path, MAX_SHOWN)
}

/// Says why the path of a file is refused.
pub(super) fn refused_path(path: &str, fault: &PathFault) -> Sentence {
    let path = shown(path);
    let why = match fault {
        PathFault::Outside => "đường dẫn dẫn đến thư mục khác".to_owned(),
        PathFault::TooLong => "tên quá dài".to_owned(),
        PathFault::TooDeep => "nằm trong quá nhiều thư mục lồng nhau".to_owned(),
        PathFault::Character(c) => format!("tên có ký tự {c:?}"),
        PathFault::Ends => {
            "tên bắt đầu hoặc kết thúc bằng dấu cách, hoặc kết thúc bằng dấu chấm".to_owned()
        }
        PathFault::Device => "tên là tên thiết bị của Windows".to_owned(),
        PathFault::Twice => "tệp này xuất hiện hai lần".to_owned(),
        PathFault::Folder(other) => format!("{} vừa là tệp vừa là thư mục", shown(other)),
        PathFault::Similar(other) => {
            format!("tên chỉ khác {} ở chữ hoa và chữ thường", shown(other))
        }
    };
    let path = quoted(&path);
    Sentence::new(
        format!("{path} is refused, because {fault}: rename it and choose the files again"),
        format!("{path} bị từ chối vì {why}: hãy đổi tên rồi chọn lại các tệp"),
    )
}

/// Says why a file cannot be written.
pub(super) fn not_written(error: &io::Error) -> Sentence {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Sentence::new(
            format!(
                "the disk is full, or less than {} of it would stay free, so nothing of the files was kept: make room and choose them again",
                file_size(Language::English, RESERVE_BYTES)
            ),
            format!(
                "đĩa đã đầy, hoặc sẽ còn trống ít hơn {}, nên không tệp nào được giữ lại: hãy giải phóng dung lượng rồi chọn lại các tệp",
                file_size(Language::Vietnamese, RESERVE_BYTES)
            ),
        ),
        _ => {
            let [english, vietnamese] = system_reasons(error);
            Sentence::new(
                format!(
                    "the files cannot be written ({english}), so nothing of them was kept: check the folder and its disk, and choose them again"
                ),
                format!(
                    "không ghi được các tệp ({vietnamese}), nên không tệp nào được giữ lại: hãy kiểm tra thư mục và ổ đĩa, rồi chọn lại các tệp"
                ),
            )
        }
    }
}

/// Says that files need more room than the disk has.
pub(super) fn no_room(bytes: u64, free: u64) -> Sentence {
    let sizes = |language| [bytes, free, RESERVE_BYTES].map(|size| file_size(language, size));
    let [english, vietnamese] = [Language::English, Language::Vietnamese].map(sizes);
    let [bytes, free, reserve] = english;
    let english = format!(
        "the files need {bytes}, the disk has {free}, and {reserve} must stay free: make room or choose fewer files"
    );
    let [bytes, free, reserve] = vietnamese;
    let vietnamese = format!(
        "các tệp cần {bytes}, đĩa còn {free}, và phải để trống {reserve}: hãy giải phóng dung lượng hoặc chọn ít tệp hơn"
    );
    Sentence::new(english, vietnamese)
}

/// Says that there are too many files.
pub(super) fn too_many() -> Sentence {
    let most = grouped(MAX_FILES);
    Sentence::new(
        format!("more than {most} files were chosen: choose fewer at once"),
        format!("đã chọn hơn {most} tệp: hãy chọn ít tệp hơn mỗi lần"),
    )
}

/// Says that files with their folders are too many.
pub(super) fn too_many_names() -> Sentence {
    let most = grouped(MAX_FILES);
    Sentence::new(
        format!("there are more than {most} files and folders: choose fewer at once"),
        format!("có hơn {most} tệp và thư mục: hãy chọn ít hơn mỗi lần"),
    )
}

/// Says that there is nothing to import.
pub(super) fn nothing() -> Sentence {
    Sentence::new(
        "none of the files is a scan, an image or a list: choose other files",
        "không có tệp nào là bản quét, hình ảnh hay danh sách: hãy chọn các tệp khác",
    )
}

/// Says that a file has an extension that an import does not know.
pub(super) fn other_file(path: &str) -> Sentence {
    let path = quoted(&shown(path));
    Sentence::new(
        format!("{path} is no scan, image or list: leave it out"),
        format!("{path} không phải là bản quét, hình ảnh hay danh sách: hãy bỏ tệp này ra"),
    )
}

/// Says that the browser stopped sending.
pub(super) fn cut() -> Sentence {
    Sentence::new(
        "the connection was cut before all files had arrived, so nothing of them was kept: choose them again",
        "kết nối bị ngắt trước khi mọi tệp đến nơi, nên không tệp nào được giữ lại: hãy chọn lại các tệp",
    )
}

/// Says that the browser stopped sending, and how many files need not be sent again.
pub(super) fn cut_with_rest(arrived: u64) -> Sentence {
    let [have, are] = [["has", "have"], ["is", "are"]].map(|forms| english_form(arrived, forms));
    let arrived = grouped(arrived);
    Sentence::new(
        format!(
            "the connection was cut before all files had arrived: choose the same files again within an hour; {arrived} of them {have} arrived and {are} not sent again"
        ),
        format!(
            "kết nối bị ngắt trước khi mọi tệp đến nơi: hãy chọn lại đúng các tệp đó trong vòng một giờ; {arrived} tệp đã đến nơi và không phải gửi lại"
        ),
    )
}

/// Says that not all files of an upload have arrived.
pub(super) fn incomplete(arrived: u64, announced: u64) -> Sentence {
    let have = english_form(arrived, ["has", "have"]);
    let [arrived, announced] = [arrived, announced].map(grouped);
    Sentence::new(
        format!(
            "only {arrived} of {announced} files {have} arrived, so nothing of them was kept: choose them again"
        ),
        format!(
            "mới nhận được {arrived} trên {announced} tệp, nên không tệp nào được giữ lại: hãy chọn lại các tệp"
        ),
    )
}

/// Says that an earlier program ended during an upload.
pub(super) fn left_over() -> Sentence {
    Sentence::new(
        "the program ended before the last upload was stored; what had arrived was removed: choose the files again",
        "chương trình dừng trước khi lần gửi trước được lưu; phần đã nhận đã được xóa: hãy chọn lại các tệp",
    )
}

/// Says that an upload is not known any more.
pub(super) fn ended() -> Sentence {
    Sentence::new(
        "this upload has ended: choose the files again",
        "lần gửi tệp này đã kết thúc: hãy chọn lại các tệp",
    )
}

/// Says that files of the same upload are still arriving.
pub(super) fn busy() -> Sentence {
    Sentence::new(
        "another file of this upload is still arriving: wait for its end",
        "một tệp khác của lần gửi này vẫn đang đến: hãy chờ đến khi xong",
    )
}

/// Says that another page has begun to send the same files, and seems to have lost its connection.
pub(super) fn silent() -> Sentence {
    Sentence::new(
        "another page has begun to send the same files, and nothing more of them arrives: press \"Take over\" to go on here; what has arrived is not sent again",
        "một trang khác đã bắt đầu gửi chính các tệp này, nhưng không còn nhận thêm được gì: hãy bấm \"Gửi tiếp ở đây\"; phần đã đến nơi không phải gửi lại",
    )
}

/// Says that another page is sending the same files.
pub(super) fn same_files() -> Sentence {
    Sentence::new(
        "another page is sending the same files: wait for their end, or cancel them there",
        "một trang khác đang gửi chính các tệp này: hãy chờ đến khi xong, hoặc hủy ở trang đó",
    )
}

/// Returns the message for a page whose upload another page has taken over.
pub(super) fn taken_over() -> Sentence {
    Sentence::new(
        "another page has taken over this upload: follow it there",
        "một trang khác đã tiếp nhận lần gửi này: hãy theo dõi ở trang đó",
    )
}

/// Says that an upload is already being stored.
pub(super) fn storing() -> Sentence {
    Sentence::new(
        "all files have arrived and are being stored: wait for the end",
        "mọi tệp đã đến nơi và đang được lưu: hãy chờ đến khi xong",
    )
}

/// Says that too many uploads are in progress.
pub(super) fn too_many_uploads() -> Sentence {
    Sentence::new(
        "other uploads are in progress: wait for their end, or cancel one on its page",
        "đang có các lần gửi tệp khác: hãy chờ đến khi xong, hoặc hủy một lần ở trang của nó",
    )
}

/// Says why an archive cannot be unpacked.
pub(super) fn refused_archive(archive: &str, error: &ZipError) -> Sentence {
    let archive = shown(archive);
    let because = |english: &str, vietnamese: &str| {
        Sentence::new(
            format!("{archive} cannot be unpacked: {english}"),
            format!("không giải nén được {archive}: {vietnamese}"),
        )
    };
    let damaged = |english: &str, vietnamese: &str| {
        because(
            &format!("the archive is damaged: {english}; pack the files again"),
            &format!("tệp nén bị hỏng: {vietnamese}; hãy nén lại"),
        )
    };
    match error {
        ZipError::Write(error) => not_written(error),
        ZipError::Io(error) => {
            let [english, vietnamese] = system_reasons(error);
            because(
                &format!("it cannot be read ({english}); choose it again"),
                &format!("không đọc được ({vietnamese}); hãy chọn lại"),
            )
        }
        ZipError::TooManyFiles => because(
            &format!("it has more than {} files; pack fewer", grouped(MAX_FILES)),
            &format!("có hơn {} tệp; hãy nén ít tệp hơn", grouped(MAX_FILES)),
        ),
        ZipError::LongNames => because(
            "the names of its files are too long; pack fewer files",
            "tên các tệp quá dài; hãy nén ít tệp hơn",
        ),
        ZipError::Large => because(
            "it has more than 4 GiB or more than 65,535 files (ZIP64); unpack it yourself and choose the folder",
            "tệp lớn hơn 4 GiB hoặc có hơn 65\u{202f}535 tệp (ZIP64); hãy tự giải nén rồi chọn thư mục",
        ),
        ZipError::Encrypted(name) => because(
            &format!("{} has a password; pack the files without one", shown(name)),
            &format!(
                "{} có mật khẩu; hãy nén lại không dùng mật khẩu",
                shown(name)
            ),
        ),
        ZipError::Method(name) => because(
            &format!(
                "{} is compressed in an unusual way; pack the files as an ordinary ZIP",
                shown(name)
            ),
            &format!(
                "{} được nén theo phương thức không được hỗ trợ; hãy nén lại thành ZIP thông thường",
                shown(name)
            ),
        ),
        ZipError::NoEnd => damaged("its end is missing", "thiếu phần cuối"),
        ZipError::Directory => damaged("its directory is incomplete", "mục lục không đầy đủ"),
        ZipError::Truncated => damaged("it ends early", "bị cắt ngắn"),
        ZipError::Misplaced(name) => damaged(
            &format!("{} is not where its directory says", shown(name)),
            &format!("{} không ở vị trí ghi trong mục lục", shown(name)),
        ),
        ZipError::TooLarge(name) => damaged(
            &format!("{} is larger than its directory says", shown(name)),
            &format!("{} lớn hơn kích thước ghi trong mục lục", shown(name)),
        ),
        ZipError::Damaged(name) => damaged(
            &format!("the bytes of {} are wrong", shown(name)),
            &format!("nội dung của {} bị sai", shown(name)),
        ),
    }
}

/// Says that a file in an archive is a link.
pub(super) fn link(archive: &str, path: &str) -> Sentence {
    let [archive, path] = [archive, path].map(shown);
    Sentence::new(
        format!("{archive} cannot be unpacked: {path} is a link; pack the file that it leads to"),
        format!("không giải nén được {archive}: {path} là một liên kết; hãy nén chính tệp đó"),
    )
}

/// Says that the name of a file in an archive is not UTF-8.
pub(super) fn not_utf8(archive: &str, path: &str) -> Sentence {
    let [archive, path] = [archive, path].map(shown);
    Sentence::new(
        format!(
            "{archive} cannot be unpacked: the name {path} is not UTF-8; pack the files with another program, or choose the folder"
        ),
        format!(
            "không giải nén được {archive}: tên {path} không phải UTF-8; hãy nén bằng chương trình khác hoặc chọn thư mục"
        ),
    )
}

/// Says that an archive would unpack to far more bytes than it has.
pub(super) fn bomb(archive: &str) -> Sentence {
    let archive = shown(archive);
    Sentence::new(
        format!(
            "{archive} is refused, because it would unpack to more than {MAX_RATIO} times its size: unpack it yourself and choose the folder"
        ),
        format!(
            "{archive} bị từ chối vì sẽ giải nén thành hơn {MAX_RATIO} lần dung lượng: hãy tự giải nén rồi chọn thư mục"
        ),
    )
}
