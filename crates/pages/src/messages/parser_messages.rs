//! Refusals of workbooks, archives, XML and JSON with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const PARSER_MESSAGES: &[(&str, &str)] = &[
    // Damaged files, with a reason that may have a row of its own.
    ("the workbook is damaged: {}", "bảng tính bị hỏng: {!0}"),
    (
        "the JSON in column {} is damaged: {}",
        "JSON trong cột {0} bị hỏng: {!1}",
    ),
    ("the {} is damaged: {}", "tệp {0} bị hỏng: {!1}"),
    (
        "not a JSON object, column {}: {}",
        "không phải đối tượng JSON, cột {0}: {!1}",
    ),
    (
        "not a JSON object, line {}: {}",
        "không phải đối tượng JSON, dòng {0}: {!1}",
    ),
    // Workbooks.
    (
        "this is {}, not an XLSX workbook",
        "đây là {0}, không phải bảng tính XLSX",
    ),
    (
        "save the table as XLSX or as \"CSV UTF-8\"",
        "hãy lưu bảng thành XLSX hoặc \"CSV UTF-8\"",
    ),
    (
        "{} is not an XLSX workbook, so it has no sheet {}",
        "{0} không phải bảng tính XLSX nên không có trang tính {1}",
    ),
    ("{} is an HTML table", "{0} là bảng HTML"),
    ("save it again", "hãy lưu lại"),
    (
        "{} of the workbook has more than {} MiB",
        "{0} của bảng tính lớn hơn {1#} MiB",
    ),
    ("save the sheet alone", "hãy lưu riêng trang tính đó"),
    ("there is no sheet {}", "không có trang tính {0}"),
    ("the workbook has: {}", "bảng tính có: {0}"),
    (
        "cell {} of column {} is a date, {}",
        "ô {0} của cột {1} là ngày tháng, {2}",
    ),
    (
        "cell {} of column {} is a power of ten, {}",
        "ô {0} của cột {1} là lũy thừa của mười, {2}",
    ),
    (
        "the spreadsheet program may have made it of a text such as {}",
        "có thể chương trình bảng tính đã đổi nó từ một văn bản như {0}",
    ),
    (
        "give the column the format Text and write the cell again",
        "hãy đặt định dạng Văn bản cho cột rồi ghi lại ô",
    ),
    (
        "cell {} has more than {} bytes of text",
        "ô {0} có hơn {1#} byte văn bản",
    ),
    ("shorten it", "hãy rút ngắn"),
    (
        "cell {} has a formula without its result",
        "ô {0} có công thức chưa được tính",
    ),
    (
        "open the workbook in a spreadsheet program and save it",
        "hãy mở bảng tính bằng chương trình bảng tính rồi lưu lại",
    ),
    ("cell {} has the error {}", "ô {0} có lỗi {1}"),
    (
        "correct it, or clear the cell",
        "hãy sửa, hoặc xóa nội dung ô",
    ),
    (
        "cells {} are merged over several columns",
        "các ô {0} được gộp qua nhiều cột",
    ),
    (
        "unmerge them, and write each value into its own cell",
        "hãy bỏ gộp, và ghi mỗi giá trị vào ô của nó",
    ),
    ("{} cells cannot be read:", "không đọc được {0#} ô:"),
    ("there are no cells {}", "không có các ô {0}"),
    (
        "it has more than {} areas of merged cells",
        "có hơn {0#} vùng ô gộp",
    ),
    ("it has more than {} files", "có hơn {0#} tệp"),
    ("it has more than {} sheets", "có hơn {0#} trang tính"),
    ("it has more than {} styles", "có hơn {0#} kiểu"),
    (
        "it has more than {} shared strings",
        "có hơn {0#} chuỗi dùng chung",
    ),
    ("a row has the number {}", "có dòng mang số {0}"),
    ("a row has more than {} cells", "có dòng nhiều hơn {0#} ô"),
    ("there is no cell {}", "không có ô {0}"),
    ("there is no string {}", "không có chuỗi {0}"),
    ("it ends early", "kết thúc sớm"),
    ("{} ends early", "{0} kết thúc sớm"),
    ("{} is not UTF-8", "{0} không phải là UTF-8"),
    // Archives.
    ("its end is missing", "thiếu phần cuối"),
    ("it has too many files", "có quá nhiều tệp"),
    ("the names of its files are too long", "tên các tệp quá dài"),
    ("its directory is incomplete", "mục lục không đầy đủ"),
    (
        "it is an archive of more than 4 GiB",
        "tệp nén lớn hơn 4 GiB",
    ),
    (
        "{} is not where its directory says",
        "{0} không ở vị trí ghi trong mục lục",
    ),
    (
        "{} is compressed in an unusual way",
        "{0} được nén theo cách không được hỗ trợ",
    ),
    ("{} is encrypted", "{0} có mật khẩu"),
    (
        "{} is larger than its directory says",
        "{0} lớn hơn kích thước ghi trong mục lục",
    ),
    ("{} cannot be unpacked", "không giải nén được {0}"),
    (
        "the unpacked bytes cannot be written: {}",
        "không ghi được phần đã giải nén: {0}",
    ),
    // XML.
    (
        "more than {} elements are nested",
        "có hơn {0#} phần tử lồng nhau",
    ),
    (
        "an element ends that did not begin",
        "có phần tử kết thúc mà không bắt đầu",
    ),
    ("the entity {} is unknown", "không biết thực thể {0}"),
];
