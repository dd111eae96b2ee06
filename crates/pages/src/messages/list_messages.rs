//! The messages of the program on the cells and columns of lists with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const LIST_MESSAGES: &[(&str, &str)] = &[
    // Errors of formulas.
    (
        "line {}: column {} has the error {} of a formula",
        "dòng {0}: cột {1} có lỗi công thức {2}",
    ),
    (
        "lines {}: column {} has the error {} of a formula",
        "các dòng {0}: cột {1} có lỗi công thức {2}",
    ),
    (
        "correct it in the spreadsheet program, or clear the cell",
        "hãy sửa trong chương trình bảng tính, hoặc xóa nội dung ô",
    ),
    (
        "an error of a formula is left out, {} in column {} on line {}",
        "một lỗi công thức bị bỏ qua: {0} ở cột {1}, dòng {2}",
    ),
    (
        "{} errors of formulas are left out, the first {} in column {} on line {}",
        "{0} lỗi công thức bị bỏ qua, lỗi đầu tiên là {1} ở cột {2}, dòng {3}",
    ),
    (
        "correct it in the spreadsheet program, and import again",
        "hãy sửa trong chương trình bảng tính rồi nhập lại",
    ),
    (
        "correct them in the spreadsheet program, and import again",
        "hãy sửa trong chương trình bảng tính rồi nhập lại",
    ),
    // Lists of pairs and of blocks.
    (
        "this is read as a list of pairs, because several rows have the block {}",
        "tệp này được đọc là danh sách cặp, vì nhiều dòng có cùng ván {0}",
    ),
    (
        "this is read as a list of pairs, because its prints have names of images",
        "tệp này được đọc là danh sách cặp, vì các bản in có tên tệp hình",
    ),
    (
        "this is read as a list of pairs, because its pages have no names of images",
        "tệp này được đọc là danh sách cặp, vì các trang in không có tên tệp hình",
    ),
    (
        "a list of blocks has one row for each block, with the columns block, mesh and page",
        "danh sách ván có một dòng cho mỗi ván, với các cột ván, bản quét và trang in",
    ),
    (
        "this is read as a list of blocks, because it has the column page and no column {}",
        "tệp này được đọc là danh sách ván, vì có cột trang in và không có cột {0}",
    ),
    (
        "columns {} are kept as metadata",
        "các cột {0} được giữ làm thông tin thêm",
    ),
    // Merged cells.
    (
        "the value of cell {} is hidden below merged cells and is left out",
        "giá trị của ô {0} bị che dưới các ô gộp nên bị bỏ qua",
    ),
    (
        "{} values are hidden below merged cells and are left out, the first in cell {}",
        "{0} giá trị bị che dưới các ô gộp nên bị bỏ qua, giá trị đầu tiên ở ô {1}",
    ),
    (
        "unmerge the cells to see it",
        "hãy bỏ gộp các ô để thấy giá trị đó",
    ),
    (
        "unmerge the cells to see them",
        "hãy bỏ gộp các ô để thấy các giá trị đó",
    ),
];
