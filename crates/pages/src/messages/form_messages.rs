//! Refusals and warnings about forms of labels, cells and headings, with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const FORM_MESSAGES: &[(&str, &str)] = &[
    // Labels.
    (
        "the file has no boxes of this page, and the image_id of others is that of no image (boxes: {})",
        "tệp không có khung nào của trang này, còn image_id của các khung khác không phải của hình nào (số khung: {0})",
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
];
