//! Refusals of projects, outputs and blocks that cannot be used now with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const HELD_MESSAGES: &[(&str, &str)] = &[
    // Projects and outputs that others use.
    ("nothing was repaired", "chưa sửa gì"),
    (
        "the project is in use by pid {}",
        "dự án đang được dùng bởi tiến trình {0}",
    ),
    ("the project is in use", "dự án đang được dùng"),
    (
        "the run in progress has other settings ({})",
        "lần chạy đang diễn ra có thiết lập khác ({0})",
    ),
    (
        "the run in progress has other settings",
        "lần chạy đang diễn ra có thiết lập khác",
    ),
    (
        "use the same settings, or wait until it has ended",
        "hãy dùng cùng thiết lập, hoặc chờ đến khi chạy xong",
    ),
    (
        "{} was locked by another process for too long",
        "{0} bị một tiến trình khác khóa quá lâu",
    ),
    (
        "{} was locked by {} for too long",
        "{0} bị {1} khóa quá lâu",
    ),
    (
        "try again when that process has finished",
        "hãy thử lại khi tiến trình đó kết thúc",
    ),
    ("try again", "hãy thử lại"),
    (
        "{} is being written by another process (pid {})",
        "{0} đang được một tiến trình khác ghi (tiến trình {1})",
    ),
    (
        "{} is being written by another process",
        "{0} đang được một tiến trình khác ghi",
    ),
    (
        "wait until that process has ended, or choose another name",
        "hãy chờ tiến trình đó kết thúc, hoặc chọn tên khác",
    ),
    (
        "{} is not part of an export, so its folder is not replaced",
        "{0} không thuộc bản xuất nào nên thư mục chứa nó không bị thay thế",
    ),
    (
        "choose an empty or new folder",
        "hãy chọn thư mục trống hoặc thư mục mới",
    ),
    (
        "{} was changed after it was written, so its folder is not replaced",
        "{0} đã bị sửa sau khi ghi nên thư mục chứa nó không bị thay thế",
    ),
    (
        "move the file elsewhere, or choose another folder",
        "hãy chuyển tệp đó sang nơi khác, hoặc chọn thư mục khác",
    ),
    (
        "the earlier folder is {}, and the next call of this command restores it",
        "thư mục trước đó là {0}, và lần sau khi làm lại việc này, thư mục đó được khôi phục",
    ),
    (
        "free some space and try again, everything stored so far is safe",
        "hãy giải phóng chỗ trống rồi thử lại, mọi thứ đã lưu vẫn an toàn",
    ),
    (
        "{} was changed or replaced meanwhile",
        "{0} vừa bị thay đổi hoặc thay thế",
    ),
    ("download again", "hãy tải lại"),
    (
        "the folders in {} are nested too deeply",
        "các thư mục trong {0} lồng nhau quá sâu",
    ),
    ("remove it or export again", "hãy xóa nó hoặc xuất lại"),
    // Blocks without an alignment.
    (
        "block {} is not aligned with its page, so there is nothing to show",
        "ván {0} chưa được căn chỉnh với trang in nên không có gì để xem",
    ),
    ("it has not run yet", "ván chưa được chạy"),
    ("use `run` first", "hãy chạy ván trước"),
    (
        "block {} was removed while it was read",
        "ván {0} đã bị xóa trong lúc đang đọc",
    ),
    ("block {} was removed meanwhile", "ván {0} vừa bị xóa"),
    ("run the block again", "hãy chạy lại ván"),
    (
        "the stored result of {} cannot be read: {}",
        "không đọc được kết quả đã lưu của bước {0}: {1}",
    ),
    ("a new box has no edges", "khung mới không có cạnh"),
    // Chosen points.
    (
        "the front of the block shows no face",
        "mặt trước của ván không có mặt khắc",
    ),
    (
        "the back of the block shows no face",
        "mặt sau của ván không có mặt khắc",
    ),
    (
        "point {} lies beside the scanned face: choose a place on the relief",
        "điểm {0} nằm ngoài mặt được quét: hãy chọn một chỗ trên mặt khắc",
    ),
    (
        "point {} lies outside the page",
        "điểm {0} nằm ngoài trang in",
    ),
    (
        "{} points are too many: choose at most {}",
        "{0#} điểm là quá nhiều: hãy chọn nhiều nhất {1#} điểm",
    ),
    // Blocks that cannot be aligned.
    (
        "the scan is a point set ({} points without faces): a block needs a triangle mesh",
        "bản quét là đám mây điểm ({0#} điểm, không có mặt): ván cần lưới tam giác",
    ),
    ("export it with faces", "hãy xuất kèm các mặt"),
    (
        "the scan has no surface ({} triangles with an area of zero, or with coordinates that are too large to compute with): a block needs a triangle mesh",
        "bản quét không có bề mặt ({0#} tam giác có diện tích bằng không, hoặc có tọa độ quá lớn để tính): ván cần lưới tam giác",
    ),
    (
        "export it with faces, not as points",
        "hãy xuất kèm các mặt, không phải dạng điểm",
    ),
    (
        "its {} triangles overlap more than {} times, or most are slivers across the scan",
        "{0#} tam giác của nó chồng lên nhau hơn {1#} lần, hoặc phần lớn là tam giác rất mảnh chạy ngang bản quét",
    ),
    (
        "remove repeated faces or remesh the scan",
        "hãy bỏ các mặt lặp lại hoặc tạo lại lưới",
    ),
    (
        "check the unit, or remove what does not belong to the block",
        "hãy kiểm tra đơn vị, hoặc bỏ những gì không thuộc ván",
    ),
];
