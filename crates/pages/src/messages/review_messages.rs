//! Refusals of reviews and of the work of the server with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const REVIEW_MESSAGES: &[(&str, &str)] = &[
    // Requests of reviews.
    (
        "cannot read the review queue: {}",
        "không đọc được danh sách cần đánh giá: {!0}",
    ),
    (
        "cannot plant an attention check: {}",
        "không tạo được hình kiểm tra: {!0}",
    ),
    ("there is no such item", "không có hình này"),
    ("answer it first", "hãy trả lời hình này trước"),
    ("answer every image first", "hãy trả lời mọi hình trước"),
    (
        "the disk with the catalog is full",
        "đĩa chứa danh mục đã đầy",
    ),
    (
        "free some space there",
        "hãy giải phóng chỗ trống trên đĩa đó",
    ),
    (
        "the database server of the catalog is not available",
        "máy chủ cơ sở dữ liệu của danh mục không trả lời",
    ),
    (
        "check that it runs, then try again: nothing stored is lost",
        "hãy kiểm tra máy chủ rồi thử lại: không mất gì đã lưu",
    ),
    (
        "too many requests use the catalog at the moment",
        "hiện có quá nhiều yêu cầu đang dùng danh mục",
    ),
    ("this pair has a new result", "cặp này có kết quả mới"),
    ("the pair has a new result", "cặp có kết quả mới"),
    ("reload the page", "hãy tải lại trang"),
    (
        "this pair has no complete result at the moment",
        "hiện cặp này chưa có kết quả đầy đủ",
    ),
    (
        "try again when a run has computed it",
        "hãy thử lại sau khi chạy xong",
    ),
    (
        "the catalog has not confirmed this in time",
        "danh mục không xác nhận kịp",
    ),
    ("it is sent again", "yêu cầu sẽ được gửi lại"),
    (
        "the map is singular, or its scale or shift is out of range",
        "phép căn chỉnh không hợp lệ, hoặc tỉ lệ hay độ dời vượt quá giới hạn",
    ),
    (
        "the project cannot be read now: tell the person who invited you, and keep this page open",
        "hiện không đọc được dự án: hãy báo người đã mời bạn, và để nguyên trang này",
    ),
    (
        "pair {} has no result to judge yet",
        "cặp {0} chưa có kết quả để đánh giá",
    ),
    (
        "pair {} has no result of {} to judge yet",
        "cặp {0} chưa có kết quả của {1} để đánh giá",
    ),
    (
        "there is no verdict by {} to undo",
        "không có đánh giá nào của {0} để hoàn tác",
    ),
    (
        "there is no verdict to undo",
        "không có đánh giá nào để hoàn tác",
    ),
    (
        "the reviewer's name must be one line of 1 to {} visible characters",
        "tên người đánh giá phải nằm trên một dòng, từ 1 đến {0#} ký tự nhìn thấy được",
    ),
    (
        "NAME and TÊN stand for a name",
        "NAME và TÊN chỉ là chỗ để ghi tên",
    ),
    (
        "give the name of the reviewer",
        "hãy ghi tên người đánh giá",
    ),
    (
        "only a fail has a reason",
        "chỉ kết quả không đạt mới có lý do",
    ),
    (
        "a note is text of at most {} characters",
        "ghi chú là văn bản dài nhất {0#} ký tự",
    ),
    (
        "an event is 1 to {} letters, digits and hyphens",
        "mã sự kiện gồm 1 đến {0#} chữ cái, chữ số và gạch nối",
    ),
    (
        "an angle is from -180 to 180 degrees",
        "góc phải từ -180 đến 180 độ",
    ),
    (
        "the display time is too long",
        "thời gian hiện hình quá dài",
    ),
    (
        "the time of a verdict is from 1970 to now",
        "thời điểm đánh giá phải từ năm 1970 đến nay",
    ),
    // Work of the server.
    (
        "a fault of the program ended this work",
        "một lỗi của chương trình đã làm dừng việc này",
    ),
    (
        "the terminal in which it runs shows more",
        "cửa sổ dòng lệnh đang chạy chương trình cho biết thêm",
    ),
    (
        "the run ended without a message",
        "lần chạy kết thúc mà không có thông báo",
    ),
];
