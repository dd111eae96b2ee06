//! Reasons that operating systems give, with their Vietnamese texts.

/// What Linux, macOS and the standard library say, without the numbers of errors.
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
];
