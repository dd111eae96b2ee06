//! Messages of the parsers of JSON and XML and of the server of pages, which are other programs, with their Vietnamese
//! texts.

/// Messages without the line and column behind them. Pages that leave out commands leave out the marks around signs, too.
pub(super) const FOREIGN_MESSAGES: &[(&str, &str)] = &[
    ("expected value", "cần một giá trị"),
    ("expected ident", "cần true, false hoặc null"),
    ("expected `:`", "cần dấu hai chấm"),
    ("expected :", "cần dấu hai chấm"),
    (
        "expected `,` or `}`",
        "cần dấu phẩy hoặc dấu ngoặc nhọn đóng",
    ),
    ("expected , or }", "cần dấu phẩy hoặc dấu ngoặc nhọn đóng"),
    (
        "expected `,` or `]`",
        "cần dấu phẩy hoặc dấu ngoặc vuông đóng",
    ),
    ("expected , or ]", "cần dấu phẩy hoặc dấu ngoặc vuông đóng"),
    (
        "key must be a string",
        "khóa phải là văn bản trong ngoặc kép",
    ),
    ("trailing comma", "thừa dấu phẩy"),
    ("trailing characters", "thừa ký tự ở cuối"),
    ("invalid number", "số không hợp lệ"),
    ("number out of range", "số quá lớn"),
    ("invalid escape", "dấu gạch chéo ngược không hợp lệ"),
    ("invalid unicode code point", "mã ký tự không hợp lệ"),
    (
        "control character (\\u0000-\\u001F) found while parsing a string",
        "có ký tự điều khiển trong văn bản",
    ),
    ("recursion limit exceeded", "có quá nhiều tầng lồng nhau"),
    ("EOF while parsing an object", "kết thúc giữa một đối tượng"),
    ("EOF while parsing a list", "kết thúc giữa một danh sách"),
    ("EOF while parsing a string", "kết thúc giữa một văn bản"),
    ("EOF while parsing a value", "kết thúc trước một giá trị"),
    // XML.
    (
        "ill-formed document: expected `</{}>`, but `</{}>` was found",
        "cần `</{0}>` nhưng thấy `</{1}>`",
    ),
    (
        "ill-formed document: close tag `</{}>` does not match any open tag",
        "thẻ đóng `</{0}>` không khớp với thẻ mở nào",
    ),
    (
        "ill-formed document: start tag not closed: `</{}>` not found before end of input",
        "thẻ `{0}` không được đóng",
    ),
    (
        "ill-formed document: expected </{}>, but </{}> was found",
        "cần `</{0}>` nhưng thấy `</{1}>`",
    ),
    (
        "ill-formed document: close tag </{}> does not match any open tag",
        "thẻ đóng `</{0}>` không khớp với thẻ mở nào",
    ),
    (
        "ill-formed document: start tag not closed: </{}> not found before end of input",
        "thẻ `{0}` không được đóng",
    ),
    // Requests.
    (
        "Failed to buffer the request body: {}",
        "không nhận được yêu cầu: {0}",
    ),
    (
        "Failed to deserialize the JSON body into the target type: {}",
        "trang gửi dữ liệu không hợp lệ: {0}",
    ),
    (
        "Failed to parse the request body as JSON: {}",
        "trang gửi dữ liệu không hợp lệ: {0}",
    ),
];
