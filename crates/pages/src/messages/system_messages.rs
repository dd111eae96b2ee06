//! Reasons that operating systems give, with their Vietnamese texts.

use std::io;

use mocban_project::error::without_error_numbers;

/// What Linux, macOS, Windows and the standard library say, without the numbers of errors. Every kind of errors that the
/// standard library names has a row with its words.
pub(super) const SYSTEM_MESSAGES: &[(&str, &str)] = &[
    // Rights and disks.
    ("Permission denied", "không có quyền"),
    ("permission denied", "không có quyền"),
    ("Operation not permitted", "không được phép làm việc này"),
    ("Read-only file system", "ổ đĩa chỉ đọc được"),
    (
        "read-only filesystem or storage medium",
        "ổ đĩa chỉ đọc được",
    ),
    ("No space left on device", "đĩa đã đầy"),
    ("no storage space", "đĩa đã đầy"),
    ("Disk quota exceeded", "đã hết dung lượng đĩa được cấp"),
    ("Disc quota exceeded", "đã hết dung lượng đĩa được cấp"),
    ("quota exceeded", "đã hết dung lượng đĩa được cấp"),
    ("File too large", "tệp quá lớn đối với ổ đĩa này"),
    ("file too large", "tệp quá lớn đối với ổ đĩa này"),
    ("Input/output error", "ổ đĩa báo lỗi"),
    ("No such device", "ổ đĩa đã bị ngắt"),
    ("No such device or address", "ổ đĩa đã bị ngắt"),
    ("Device not configured", "ổ đĩa đã bị ngắt"),
    ("No locks available", "ổ đĩa không hỗ trợ khóa tệp"),
    ("Operation not supported", "ổ đĩa không hỗ trợ thao tác này"),
    (
        "Invalid argument",
        "ổ đĩa không cho phép tên hoặc thao tác này",
    ),
    // Files and folders.
    ("No such file or directory", "không có tệp hoặc thư mục này"),
    ("File exists", "đã có tệp hoặc thư mục này"),
    ("Is a directory", "đó là thư mục"),
    ("Not a directory", "đó không phải là thư mục"),
    ("Directory not empty", "thư mục không trống"),
    ("File name too long", "tên tệp quá dài"),
    (
        "Invalid or incomplete multibyte or wide character",
        "ổ đĩa không cho phép tên này",
    ),
    ("Illegal byte sequence", "ổ đĩa không cho phép tên này"),
    (
        "Too many levels of symbolic links",
        "có quá nhiều liên kết nối tiếp nhau",
    ),
    (
        "Device or resource busy",
        "đang được chương trình khác dùng",
    ),
    ("Resource busy", "đang được chương trình khác dùng"),
    ("Text file busy", "đang được chương trình khác dùng"),
    (
        "Invalid cross-device link",
        "hai vị trí nằm trên hai ổ đĩa khác nhau",
    ),
    (
        "Cross-device link",
        "hai vị trí nằm trên hai ổ đĩa khác nhau",
    ),
    ("unexpected end of file", "tệp kết thúc sớm"),
    ("failed to fill whole buffer", "tệp kết thúc sớm"),
    ("failed to write whole buffer", "không ghi được hết dữ liệu"),
    // Limits of the computer.
    ("Too many open files", "có quá nhiều tệp đang mở"),
    (
        "Too many open files in system",
        "hệ thống có quá nhiều tệp đang mở",
    ),
    ("Cannot allocate memory", "máy không đủ bộ nhớ"),
    (
        "Resource temporarily unavailable",
        "máy tạm thời không đủ tài nguyên",
    ),
    // Networks and disks of other computers.
    ("Stale file handle", "tệp không còn trên máy chủ"),
    ("Stale NFS file handle", "tệp không còn trên máy chủ"),
    (
        "Transport endpoint is not connected",
        "ổ đĩa mạng bị ngắt kết nối",
    ),
    ("Host is down", "máy chủ không hoạt động"),
    ("No route to host", "không có đường đến máy chủ"),
    ("Network is unreachable", "không kết nối được mạng"),
    ("Connection refused", "máy chủ từ chối kết nối"),
    ("Connection reset by peer", "kết nối bị ngắt"),
    ("Broken pipe", "kết nối bị ngắt"),
    ("broken pipe", "kết nối bị ngắt"),
    ("Connection timed out", "hết thời gian chờ"),
    ("Operation timed out", "hết thời gian chờ"),
    ("timed out", "hết thời gian chờ"),
    (
        "Address already in use",
        "địa chỉ đang được chương trình khác dùng",
    ),
    (
        "Cannot assign requested address",
        "máy này không có địa chỉ đó",
    ),
    (
        "Can't assign requested address",
        "máy này không có địa chỉ đó",
    ),
    // Other kinds of errors as the standard library names them.
    ("address in use", "địa chỉ đang được chương trình khác dùng"),
    ("address not available", "máy này không có địa chỉ đó"),
    ("argument list too long", "lệnh quá dài"),
    ("connection aborted", "kết nối bị ngắt"),
    ("connection refused", "máy chủ từ chối kết nối"),
    ("connection reset", "kết nối bị ngắt"),
    (
        "cross-device link or rename",
        "hai vị trí nằm trên hai ổ đĩa khác nhau",
    ),
    ("deadlock", "hai chương trình chờ lẫn nhau"),
    ("directory not empty", "thư mục không trống"),
    ("entity already exists", "đã có tệp hoặc thư mục này"),
    ("entity not found", "không có tệp hoặc thư mục này"),
    ("executable file busy", "đang được chương trình khác dùng"),
    ("host unreachable", "không có đường đến máy chủ"),
    ("invalid data", "dữ liệu không hợp lệ"),
    ("invalid filename", "ổ đĩa không cho phép tên này"),
    (
        "invalid input parameter",
        "ổ đĩa không cho phép tên hoặc thao tác này",
    ),
    ("is a directory", "đó là thư mục"),
    ("network down", "không kết nối được mạng"),
    ("network unreachable", "không kết nối được mạng"),
    ("not a directory", "đó không phải là thư mục"),
    ("not connected", "kết nối bị ngắt"),
    ("operation interrupted", "thao tác bị gián đoạn"),
    ("operation would block", "máy tạm thời không đủ tài nguyên"),
    ("out of memory", "máy không đủ bộ nhớ"),
    ("resource busy", "đang được chương trình khác dùng"),
    ("seek on unseekable file", "đó không phải là tệp thường"),
    ("stale network file handle", "tệp không còn trên máy chủ"),
    ("too many links", "tệp có quá nhiều tên"),
    ("unsupported", "ổ đĩa không hỗ trợ thao tác này"),
    ("write zero", "không ghi được hết dữ liệu"),
    // Windows in English.
    (
        "The system cannot find the file specified.",
        "không có tệp này",
    ),
    (
        "The system cannot find the path specified.",
        "không có thư mục này",
    ),
    (
        "The system cannot open the file.",
        "có quá nhiều tệp đang mở",
    ),
    ("Access is denied.", "không có quyền"),
    (
        "Not enough memory resources are available to process this command.",
        "máy không đủ bộ nhớ",
    ),
    (
        "Not enough memory resources are available to complete this operation.",
        "máy không đủ bộ nhớ",
    ),
    ("The media is write protected.", "ổ đĩa chỉ đọc được"),
    ("The device is not ready.", "ổ đĩa chưa sẵn sàng"),
    (
        "The process cannot access the file because it is being used by another process.",
        "đang được chương trình khác dùng",
    ),
    (
        "The process cannot access the file because another process has locked a portion of the file.",
        "đang được chương trình khác dùng",
    ),
    ("The disk is full.", "đĩa đã đầy"),
    ("There is not enough space on the disk.", "đĩa đã đầy"),
    (
        "The network path was not found.",
        "không có đường đến máy chủ",
    ),
    (
        "The specified network name is no longer available.",
        "ổ đĩa mạng bị ngắt kết nối",
    ),
    ("The file exists.", "đã có tệp này"),
    (
        "Cannot create a file when that file already exists.",
        "đã có tệp hoặc thư mục này",
    ),
    (
        "The parameter is incorrect.",
        "ổ đĩa không cho phép tên hoặc thao tác này",
    ),
    (
        "The filename, directory name, or volume label syntax is incorrect.",
        "ổ đĩa không cho phép tên này",
    ),
    ("The filename or extension is too long.", "tên tệp quá dài"),
    ("The directory is not empty.", "thư mục không trống"),
    (
        "The system cannot move the file to a different disk drive.",
        "hai vị trí nằm trên hai ổ đĩa khác nhau",
    ),
    (
        "The requested operation cannot be performed on a file with a user-mapped section open.",
        "đang được chương trình khác dùng",
    ),
    (
        "The request could not be performed because of an I/O device error.",
        "ổ đĩa báo lỗi",
    ),
    (
        "The file or directory is corrupted and unreadable.",
        "ổ đĩa báo lỗi",
    ),
];

/// Returns the Vietnamese text of a kind of errors, for errors with words of other systems or languages.
pub(crate) fn reason_of_kind(kind: io::ErrorKind) -> Option<&'static str> {
    row(&kind.to_string())
}

fn row(words: &str) -> Option<&'static str> {
    let mut rows = SYSTEM_MESSAGES.iter();
    rows.find_map(|(english, vietnamese)| (*english == words).then_some(*vietnamese))
}

/// Returns a text without the numbers of the system's errors. If no row has the words of such an error, because the system
/// speaks another language, those of its kind stand in their place.
pub(super) fn with_known_reasons(text: &str) -> String {
    const START: &str = " (os error ";
    let mut known = text.to_owned();
    // From the end, so that the places before a replaced one stay right.
    for (at, start) in text.rmatch_indices(START) {
        let number = text[at + start.len()..].split(')').next();
        let Some(number) = number.and_then(|number| number.parse::<i32>().ok()) else {
            continue;
        };
        let error = io::Error::from_raw_os_error(number);
        let words = without_error_numbers(&error.to_string());
        let kind = error.kind().to_string();
        if text[..at].ends_with(&words) && row(&words).is_none() && row(&kind).is_some() {
            known.replace_range(at - words.len()..at, &kind);
        }
    }
    without_error_numbers(&known)
}
