//! Why stages of blocks refuse scans, pages and labels, and why ground truth is not used, with the Vietnamese texts.

/// Messages like those of the table of messages. An earlier row is preferred.
pub(super) const BLOCK_REFUSALS: &[(&str, &str)] = &[
    (
        "the scan is {} x {} m large if a unit of it is {} mm, more than the {} square metres of which height maps are computed",
        "bản quét rộng {0#} x {1#} m nếu một đơn vị là {2#} mm, hơn {3#} mét vuông là mức tính được bản đồ độ cao",
    ),
    (
        "no side has a large flat part",
        "không mặt nào có phần phẳng lớn",
    ),
    (
        "its front has no large flat part",
        "mặt trước không có phần phẳng lớn",
    ),
    (
        "its back has no large flat part",
        "mặt sau không có phần phẳng lớn",
    ),
    (
        "its face is only {} mm long, which is the size of a single character (with the unit {}: {} mm)",
        "mặt khắc chỉ dài {0#} mm, bằng cỡ một chữ (với đơn vị {1}: {2#} mm)",
    ),
    (
        "its face is only {} mm long, which is the size of a single character",
        "mặt khắc chỉ dài {0#} mm, bằng cỡ một chữ",
    ),
    (
        "the page image shows no ink: {}",
        "hình trang in không có mực: {!0}",
    ),
    (
        "its darkest parts take {} % of the light",
        "chỗ tối nhất chỉ hấp thụ {0#} % ánh sáng",
    ),
    (
        "no columns of characters were found",
        "không tìm thấy cột chữ nào",
    ),
    (
        "draw boxes around the characters, for example in the VGG Image Annotator, and give the file as labels",
        "hãy vẽ khung quanh các chữ, chẳng hạn bằng VGG Image Annotator, rồi dùng tệp đó làm nhãn",
    ),
    (
        "its box lies outside the page",
        "khung của chữ nằm ngoài trang in",
    ),
    (
        "the scan shows no surface at its box",
        "bản quét không có bề mặt ở khung của chữ",
    ),
    (
        "two characters have the label {}",
        "hai chữ có cùng nhãn {0}",
    ),
    ("rename one", "hãy đổi tên một chữ"),
    (
        "label {} cannot be part of an id: {}",
        "nhãn {0} không thể là một phần của mã: {!1}",
    ),
    (
        "there is a pair {} that was not cut from this block, and ids must differ in more than upper and lower case",
        "đã có cặp {0} không được cắt từ ván này, và các mã phải khác nhau không chỉ ở chữ hoa và chữ thường",
    ),
    (
        "import the block with another id",
        "hãy nhập ván với mã khác",
    ),
    (
        "the temporary file of the cut cannot be written or read",
        "không ghi hoặc đọc được tệp tạm của bước cắt",
    ),
    (
        "the temporary file of the cut: {}",
        "tệp tạm của bước cắt: {!0}",
    ),
    (
        "the mesh of a character cannot be written",
        "không ghi được lưới của một chữ",
    ),
    (
        "the result of {} is not usable",
        "kết quả của bước {0} không dùng được",
    ),
    (
        "the stage ended although it was not stopped",
        "bước này kết thúc dù không bị dừng",
    ),
    (
        "the block's thread ended without a result",
        "luồng của ván kết thúc mà không có kết quả",
    ),
    (
        "the system gave no thread: {}",
        "hệ thống không cấp luồng: {0}",
    ),
    (
        "truth is not of the form of truth.jsonl: {}",
        "dữ liệu đối chứng không đúng dạng của truth.jsonl: {0}",
    ),
    (
        "the true plane's normal {} is no direction",
        "pháp tuyến {0} của mặt phẳng đúng không phải là một hướng",
    ),
    (
        "the true print_from_mesh flattens the plane",
        "print_from_mesh đúng làm dẹt mặt phẳng",
    ),
    (
        "the truth has no landmarks",
        "dữ liệu đối chứng không có điểm mốc",
    ),
    (
        "the character's height is {} px",
        "chiều cao của chữ là {0#} px",
    ),
    (
        "the tops mask is {} px, the print {} px",
        "mặt nạ đỉnh nét có cỡ {0#} px, bản in {1#} px",
    ),
    ("the tops mask {}", "mặt nạ đỉnh nét {!0}"),
    // Paths of files. They are the last rows, because other messages with paths begin like them.
    ("there is {}.{}", "có tệp {0}.{1}"),
    ("there is {}/{}", "có tệp {0}/{1}"),
];
