//! The frequent messages of the program on pairs with their Vietnamese texts.

/// Messages, or clauses of them, with `{}` for each part that varies, and their Vietnamese texts, in which `{0}` is the
/// first part. An earlier row is preferred.
pub(super) const MESSAGES: &[(&str, &str)] = &[
    // Files of a list or of folders.
    (
        "{} files are missing, nothing was imported:",
        "thiếu {0#} tệp nên chưa nhập gì:",
    ),
    (
        "1 file is missing, nothing was imported:",
        "thiếu 1 tệp nên chưa nhập gì:",
    ),
    (
        "{} files are missing or a folder, nothing was imported:",
        "không dùng được {0#} tệp nên chưa nhập gì:",
    ),
    (
        "1 file is missing or a folder, nothing was imported:",
        "không dùng được 1 tệp nên chưa nhập gì:",
    ),
    (
        "{} is refused, nothing was imported:",
        "không dùng được {0} nên chưa nhập gì:",
    ),
    (
        "it is a path of a Windows computer: write paths relative to the list",
        "đây là đường dẫn của máy Windows: hãy viết đường dẫn tính từ danh sách",
    ),
    (
        "its path has a line break: write the cell on one line",
        "đường dẫn có ngắt dòng: hãy viết ô đó trên một dòng",
    ),
    (
        "cell {} of column {} has a line break",
        "ô {0} của cột {1} có ngắt dòng",
    ),
    ("id {} has a line break", "mã {0} có ngắt dòng"),
    ("block {} has a line break", "ván {0} có ngắt dòng"),
    ("id {} has a tab", "mã {0} có dấu tab"),
    ("its path has a tab", "đường dẫn có dấu tab"),
    ("remove it", "hãy xóa nó"),
    ("write it on one line", "hãy viết trên một dòng"),
    (
        "column {} is kept as metadata",
        "cột {0} được giữ làm thông tin thêm",
    ),
    (
        "rename it to {} if it is meant, and import again",
        "nếu đó là cột {0} thì hãy đổi tên rồi nhập lại",
    ),
    ("and {} more", "và {0#} mục khác"),
    ("the header has: {}", "dòng tiêu đề có: {0}"),
    ("the list contains no pairs", "danh sách không có cặp nào"),
    ("the list is empty", "danh sách trống"),
    (
        "no mesh has the same file name as a print",
        "không có bản quét nào trùng tên tệp với một bản in",
    ),
    (
        "{} holds no meshes and no images",
        "{0} không có bản quét và không có hình",
    ),
    ("{} holds no meshes", "{0} không có bản quét"),
    ("{} holds no images", "{0} không có hình"),
    (
        "pairs with the same mesh and print as an earlier one: {}, first {}, as on line {}",
        "số cặp có cùng bản quét và bản in với một cặp trước: {0#}, cặp đầu tiên là {1}, giống dòng {2}",
    ),
    (
        "blocks with the same scan and page as an earlier one: {}, first {}, as on line {}",
        "số ván có cùng bản quét và trang in với một ván trước: {0#}, ván đầu tiên là {1}, giống dòng {2}",
    ),
    (
        "pairs with the same mesh and print as one of the project: {}, first {}, as {}",
        "số cặp có cùng bản quét và bản in với một cặp của dự án: {0#}, cặp đầu tiên là {1}, giống {2}",
    ),
    // Formats that are not read.
    (
        "ignored, {} is not read: {} and {} more",
        "bỏ qua, không đọc được {0}: {1} và {2#} tệp khác",
    ),
    (
        "ignored, {} is not read: {}",
        "bỏ qua, không đọc được {0}: {1}",
    ),
    (
        "{} is not read: {} and {} more",
        "không đọc được {0}: {1} và {2#} tệp khác",
    ),
    ("{} is not read: {}", "không đọc được {0}: {1}"),
    (
        "unpack it, and import the files in it",
        "hãy giải nén rồi nhập các tệp bên trong",
    ),
    (
        "ignored, links to folders: {}",
        "bỏ qua, các liên kết đến thư mục: {0}",
    ),
    (
        "import the folders from their own place",
        "hãy nhập các thư mục đó từ chính chỗ của chúng",
    ),
    (
        "open them in {} and export them as PLY",
        "hãy mở chúng bằng {0} rồi xuất thành PLY",
    ),
    (
        "convert it, such as with ImageMagick: {}, and use the new file",
        "hãy chuyển đổi tệp, chẳng hạn bằng ImageMagick: {0}, rồi dùng tệp mới",
    ),
    (
        "open them in a program and save them as PNG",
        "hãy mở chúng bằng một chương trình rồi lưu thành PNG",
    ),
    (
        "open them in a program and save their pages as PNG",
        "hãy mở chúng bằng một chương trình rồi lưu các trang thành PNG",
    ),
    (
        "for many files, with ImageMagick: {}",
        "nếu có nhiều tệp, hãy dùng ImageMagick: {0}",
    ),
    ("for many files: {}", "nếu có nhiều tệp: {0}"),
    // Ids.
    ("there is no pair or block {}", "không có cặp hay ván {0}"),
    (
        "there is no pair {} to leave out",
        "không có cặp {0} để bỏ qua",
    ),
    ("there is no pair {}", "không có cặp {0}"),
    ("there is no block {}", "không có ván {0}"),
    ("similar ids: {}", "mã gần giống: {0}"),
    (
        "pair {} has no box any more in the labels of its block",
        "cặp {0} không còn khung trong nhãn của ván",
    ),
    (
        "it comes back with its box, when the block runs again",
        "cặp sẽ trở lại khi có lại khung và ván được chạy lại",
    ),
    (
        "pair {} was retired on {}, because a list that replaced the others does not have it",
        "cặp {0} đã được đưa ra khỏi thống kê lúc {1}, vì danh sách thay thế các danh sách khác không có cặp này",
    ),
    (
        "pair {} was retired on {}",
        "cặp {0} đã được đưa ra khỏi thống kê lúc {1}",
    ),
    (
        "pair {} is retired, because its box is gone from the labels of its block",
        "cặp {0} không có trong thống kê, vì khung của nó không còn trong nhãn của ván",
    ),
    ("its verdicts are kept", "các đánh giá của nó vẫn được giữ"),
    (
        "all pairs of block {} are retired",
        "mọi cặp của ván {0} đã được đưa ra khỏi thống kê",
    ),
    ("block {} has no pairs yet", "ván {0} chưa có cặp nào"),
    (
        "{} is a block with {}, and no pair",
        "{0} là ván, không phải là cặp",
    ),
    (
        "give the id of a pair, such as {}",
        "hãy nêu mã của một cặp, ví dụ {0}",
    ),
    (
        "none of these pairs is retired",
        "không có cặp nào trong số này đã được đưa ra khỏi thống kê",
    ),
    (
        "none of these has failed",
        "không có mục nào trong số này bị lỗi",
    ),
    (
        "no pair or block has failed with class {}",
        "không có cặp hay ván nào bị lỗi thuộc loại {0}",
    ),
    ("the export has no pairs", "bản xuất không có cặp nào"),
    (
        "all {} pairs of the project are retired",
        "cả {0#} cặp của dự án đã được đưa ra khỏi thống kê",
    ),
    (
        "the only pair of the project is retired",
        "cặp duy nhất của dự án đã được đưa ra khỏi thống kê",
    ),
    // Settings.
    ("there is no setting {}", "không có thiết lập {0}"),
    (
        "{} is saved, but an environment variable gives it another value",
        "đã lưu {0}, nhưng một biến môi trường cho nó giá trị khác",
    ),
    (
        "{} = {} is not a whole number from 0",
        "{0} = {1} không phải là số nguyên từ 0 trở lên",
    ),
    ("{} = {} is not a number", "{0} = {1} không phải là số"),
    (
        "{} = {} is not true or false",
        "{0} = {1} không phải là true hay false",
    ),
    (
        "{} = {} is not one of {}",
        "{0} = {1} không phải là một trong: {2}",
    ),
    (
        "{} = {} is outside the range {} to {}",
        "{0} = {1#} nằm ngoài khoảng {2#} đến {3#}",
    ),
    (
        "{} = {} is outside the range {} or more",
        "{0} = {1#} phải từ {2#} trở lên",
    ),
    (
        "{} = {}: must be above {} = {}",
        "{0} = {1#}: phải lớn hơn {2} = {3#}",
    ),
    (
        "{} = {}: must be below {} = {}",
        "{0} = {1#}: phải nhỏ hơn {2} = {3#}",
    ),
    ("{} = {} is not text", "{0} = {1} không phải là văn bản"),
    ("{} = {} is not a list", "{0} = {1} không phải là danh sách"),
    // Exports.
    (
        "the settings compute no {}",
        "với các thiết lập này, độ đo {0} không được tính",
    ),
    ("choose from {}", "hãy chọn trong: {0}"),
    (
        "no result is selected: {}",
        "không có kết quả nào được chọn: {0}",
    ),
    ("no result is selected", "không có kết quả nào được chọn"),
    (
        "none of the chosen pairs has a result to export: {}",
        "không có cặp nào đã chọn có kết quả để xuất: {0}",
    ),
    (
        "none of the chosen pairs has a result to export",
        "không có cặp nào đã chọn có kết quả để xuất",
    ),
    (
        "`run` computes results, and `status` says which pairs failed",
        "hãy chạy để tính kết quả, và xem các cặp lỗi trong danh sách",
    ),
    (
        "other values of --only and --min-confidence select more",
        "lựa chọn khác sẽ xuất nhiều cặp hơn",
    ),
    (
        "another value of --only selects more",
        "lựa chọn khác sẽ xuất nhiều cặp hơn",
    ),
    (
        "another value of --min-confidence selects more",
        "độ tin cậy thấp hơn sẽ xuất nhiều cặp hơn",
    ),
    ("nothing was written to {}", "chưa ghi gì vào {0}"),
    // Files of a pair.
    ("{} is not there", "không có tệp {0}"),
    (
        "{} may not be read: permission denied",
        "không có quyền đọc {0}",
    ),
    (
        "{} changed while it was read",
        "{0} thay đổi khi đang được đọc",
    ),
    ("the file is empty (0 bytes)", "tệp rỗng (0 byte)"),
    (
        "the file is complete, but the disk did not confirm its name: {}",
        "tệp đã ghi xong, nhưng ổ đĩa chưa xác nhận tên tệp: {!0}",
    ),
    (
        "the file is {} and does not hold the {}",
        "tệp là {0} và không chứa nội dung thật",
    ),
    (
        "no labels for {}: the file is about {}",
        "không có nhãn của {0}: tệp này nói về {1}",
    ),
    (
        "take the labels of this page, or rename it",
        "hãy dùng nhãn của trang này, hoặc đổi tên trang",
    ),
    ("the file is {}", "tệp là {0}"),
    (
        "PNG, JPEG and TIFF images are read",
        "chỉ đọc được hình PNG, JPEG và TIFF",
    ),
    (
        "OBJ, PLY and STL meshes and XYZ points are read: open them in {} and export them as PLY",
        "chỉ đọc được lưới OBJ, PLY, STL và điểm XYZ: hãy mở bằng {0} rồi xuất thành PLY",
    ),
    (
        "OBJ, PLY and STL meshes and XYZ points are read",
        "chỉ đọc được lưới OBJ, PLY, STL và điểm XYZ",
    ),
    (
        "the binary STL is truncated: it holds {} of {} triangles",
        "tệp STL nhị phân bị cắt cụt: chỉ có {0#} trong số {1#} tam giác",
    ),
    (
        "the {} is truncated: it holds {} of {} triangles",
        "tệp {0} bị cắt cụt: chỉ có {1#} trong số {2#} tam giác",
    ),
    (
        "the {} is truncated: it holds {} of {} vertices",
        "tệp {0} bị cắt cụt: chỉ có {1#} trong số {2#} đỉnh",
    ),
    (
        "the {} is truncated: it holds {} of {} {}",
        "tệp {0} bị cắt cụt: chỉ có {1#} trong số {2#} phần tử",
    ),
    (
        "the {} is truncated: it ends after {} facets without {}",
        "tệp {0} bị cắt cụt: hết sau {1#} mặt mà chưa có {2}",
    ),
    (
        "the {} is truncated: it ends before the image does",
        "tệp {0} bị cắt cụt: hết trước khi hết hình",
    ),
    (
        "face {} refers to vertex {}, but the file has {} vertices",
        "mặt {0#} dùng đỉnh {1#}, nhưng tệp chỉ có {2#} đỉnh",
    ),
    ("the mesh has no faces", "bản quét không có mặt tam giác"),
    ("the mesh has no vertices", "bản quét không có đỉnh"),
    (
        "the file has {} {}; limits.mesh.max_{} is {}",
        "tệp vượt giới hạn: có {0#} {1}, limits.mesh.max_{2} là {3#}",
    ),
    // Pairs that do not match.
    (
        "relief and print do not match: confidence {} in the pose is below register.min_confidence {}",
        "mặt khắc và bản in không khớp: độ tin cậy {0#} của tư thế thấp hơn register.min_confidence {1#}",
    ),
    (
        "relief and print have strokes that the other one lacks (confidence in the pose {}, in the same character {})",
        "mặt khắc và bản in có những nét mà bên kia không có (độ tin cậy của tư thế {0#}, của việc cùng một chữ {1#})",
    ),
    (
        "no pose of the relief matches the print: the best correlation is {}, needs {}",
        "không có tư thế nào của mặt khắc khớp với bản in: tương quan cao nhất là {0#}, cần {1#}",
    ),
    (
        "the relief matches the mirrored print better ({} as well as the print itself)",
        "mặt khắc khớp với bản in lật gương hơn (bằng {0#} so với chính bản in)",
    ),
    (
        "the print or the mesh may be mirrored, the print may be of another character, or the scan may show another side of the block",
        "bản in hoặc bản quét có thể bị lật gương, bản in có thể của chữ khác, hoặc bản quét là mặt khác của ván",
    ),
    (
        "the strokes of the print match the valleys of the relief, not its tops",
        "nét của bản in khớp với chỗ lõm của mặt khắc, không phải với đỉnh",
    ),
    (
        "was the mesh mirrored, or does it show the back of the scanned surface?",
        "bản quét có bị lật gương, hay là mặt sau của bề mặt được quét?",
    ),
    (
        "is it the print of another character, or is the sheet torn or folded?",
        "đây có phải bản in của chữ khác không, hay tờ giấy bị rách hoặc gấp?",
    ),
    (
        "the scan shows {} separate pieces: does one file hold several characters or pieces?",
        "bản quét có {0#} mảnh rời: một tệp có chứa nhiều chữ hoặc nhiều mảnh không?",
    ),
    (
        "the face of the scan is nearly flat (its relief is {} % of its length): does it show the back of the block?",
        "bề mặt bản quét gần như phẳng (độ nổi là {0#} % chiều dài): có phải là mặt sau của ván không?",
    ),
    (
        "print or relief has no strokes to register",
        "bản in hoặc mặt khắc không có nét để căn chỉnh",
    ),
    (
        "no threshold gives the depth map any strokes",
        "không ngưỡng nào cho bản đồ độ sâu có nét",
    ),
    (
        "print has no ink to tell from paper: their greys differ by {} of full white",
        "không phân biệt được mực với giấy trên bản in: mức xám chỉ chênh {0#} so với trắng hoàn toàn",
    ),
    (
        "if you see ink, raise the contrast of the image",
        "nếu bạn thấy mực, hãy tăng độ tương phản của hình",
    ),
    (
        "print shows the character with {} px, too few to tell its strokes, needs {} px",
        "chữ trên bản in chỉ có {0#} điểm ảnh, quá ít để phân biệt các nét, cần {1#} điểm ảnh",
    ),
    (
        "scan or photograph it at a higher resolution",
        "hãy quét hoặc chụp với độ phân giải cao hơn",
    ),
];
