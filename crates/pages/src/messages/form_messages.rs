//! Refusals and warnings about forms of labels, cells and headings, with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const FORM_MESSAGES: &[(&str, &str)] = &[
    // Labels.
    (
        "the file has no boxes of this page, and the image_id of others is that of no image (boxes: {})",
        "tệp không có khung nào của trang này, còn image_id của các khung khác không phải của hình nào (số khung: {0#})",
    ),
    (
        "write the id of their image there",
        "hãy ghi mã của hình vào đó",
    ),
    (
        "all numbers of its boxes are from 0 to 1: they look like fractions of the page, and this format has pixels",
        "mọi số của các khung đều từ 0 đến 1: có vẻ là tỉ lệ của trang in, trong khi định dạng này dùng điểm ảnh",
    ),
    (
        "multiply them by width and height of the page",
        "hãy nhân với chiều rộng và chiều cao của trang",
    ),
    // Cells of CSV.
    ("column {} has a line break", "cột {0} có ngắt dòng"),
    (
        "cells that begin with an apostrophe: {}, the first in column {} on line {}",
        "số ô bắt đầu bằng dấu nháy đơn: {0#}, ô đầu tiên ở cột {1}, dòng {2}",
    ),
    (
        "it is kept, so remove it if it only marks text",
        "dấu này được giữ lại, hãy xóa nếu nó chỉ đánh dấu văn bản",
    ),
    (
        "cells in quotation marks with a line break and what seems to be another row: {}, the first in column {} on line {}",
        "số ô trong ngoặc kép có ngắt dòng và có vẻ chứa một dòng khác của danh sách: {0#}, ô đầu tiên ở cột {1}, dòng {2}",
    ),
    (
        "close the quotation marks on their line if it is one",
        "nếu đúng vậy, hãy đóng ngoặc kép ngay trên dòng của nó",
    ),
    (
        "column {} has {}, which begins like a formula",
        "cột {0} có {1}, bắt đầu như một công thức",
    ),
    ("write the text itself", "hãy ghi chính nội dung cần dùng"),
    (
        "cells that begin with = like formulas: {}, the first in column {} on line {}",
        "số ô bắt đầu bằng dấu = như công thức: {0#}, ô đầu tiên ở cột {1}, dòng {2}",
    ),
    ("they are kept as they are", "chúng được giữ nguyên"),
    (
        "column {} is kept as metadata, because another column is read as {}",
        "cột {0} được giữ làm thông tin thêm, vì một cột khác được đọc là {1}",
    ),
    // Workbooks.
    (
        "cell {} of column {} shows its number in the format {}, which is not read",
        "ô {0} của cột {1} hiện số theo định dạng {2} không đọc được",
    ),
    (
        "cell {} of column {} shows its text in the format {}, which is not read",
        "ô {0} của cột {1} hiện văn bản theo định dạng {2} không đọc được",
    ),
    (
        "cell {} of column {} is the number {}, and spreadsheet programs keep only 15 digits of a number",
        "ô {0} của cột {1} là số {2}, mà chương trình bảng tính chỉ giữ 15 chữ số của một số",
    ),
    (
        "hidden rows are read, too: {}, the first is row {}",
        "số dòng bị ẩn vẫn được đọc: {0#}, dòng đầu tiên là {1}",
    ),
    (
        "remove them if they are not meant",
        "hãy xóa các dòng đó nếu không cần",
    ),
    // Files that a list names and no run can use.
    (
        "pairs with one file as mesh and print: {}, the first {} on line {}",
        "số cặp dùng một tệp cho cả bản quét và bản in: {0#}, cặp đầu tiên là {1}, ở dòng {2}",
    ),
    (
        "name a scan and an image",
        "hãy ghi một bản quét và một hình",
    ),
    (
        "files that are empty: {}, the first {}",
        "số tệp trống: {0#}, tệp đầu tiên là {1}",
    ),
    (
        "replace them before the run",
        "hãy thay chúng trước khi chạy",
    ),
    (
        "files that are archives: {}, the first {}",
        "số tệp là tệp nén: {0#}, tệp đầu tiên là {1}",
    ),
    (
        "unpack them, and import the files in them",
        "hãy giải nén rồi nhập các tệp bên trong",
    ),
    (
        "files that may not be read: {}, the first {}",
        "số tệp không được phép đọc: {0#}, tệp đầu tiên là {1}",
    ),
    (
        "allow reading them before the run",
        "hãy cho phép đọc chúng trước khi chạy",
    ),
    (
        "files that have only zeros, as interrupted copies may: {}, the first {}",
        "số tệp chỉ có byte 0, như khi việc chép bị gián đoạn: {0#}, tệp đầu tiên là {1}",
    ),
    (
        "copy them again before the run",
        "hãy chép lại các tệp đó trước khi chạy",
    ),
    (
        "files that are pointers of Git LFS and do not hold scans, prints or labels: {}, the first {}",
        "số tệp là con trỏ của Git LFS, không chứa bản quét, bản in hay nhãn: {0#}, tệp đầu tiên là {1}",
    ),
    (
        "fetch them with `git lfs pull` before the run",
        "hãy tải nội dung bằng `git lfs pull` trước khi chạy",
    ),
];
