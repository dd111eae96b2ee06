//! The frequent messages of the program on blocks, scans, moved inputs, changed ids and damaged rows with their Vietnamese
//! texts.

/// Messages like those on pairs.
pub(super) const BLOCK_MESSAGES: &[(&str, &str)] = &[
    (
        "the page does not belong to this block: at the best position found, {} % of the places agree",
        "trang in không thuộc ván này: ở vị trí tốt nhất tìm được, {0#} % số chỗ khớp nhau",
    ),
    (
        "on the right page nearly all do",
        "với trang in đúng, hầu hết các chỗ đều khớp",
    ),
    (
        "the scan was taken to be {} x {} mm",
        "bản quét được coi là có cỡ {0#} x {1#} mm",
    ),
    (
        "check the file names and the unit",
        "hãy kiểm tra tên tệp và đơn vị",
    ),
    (
        "characters of about {} mm, but most have 6 to 30 mm",
        "các chữ khoảng {0#} mm, trong khi đa số có 6 đến 30 mm",
    ),
    (
        "with the unit {}, its carved surface is {} mm across, but most characters have 6 to 30 mm",
        "với đơn vị {0}, mặt khắc rộng {1#} mm, trong khi đa số chữ có 6 đến 30 mm",
    ),
    (
        "with the unit {}, the scan is {} m long",
        "với đơn vị {0}, bản quét dài {1#} m",
    ),
    (
        "with the unit {}, the scan is {} mm long",
        "với đơn vị {0}, bản quét dài {1#} mm",
    ),
    (
        "correct the unit (perhaps {}) in the list, and import it again",
        "hãy sửa đơn vị (có lẽ là {0}) trong danh sách rồi nhập lại",
    ),
    (
        "correct the unit in the list, and import it again",
        "hãy sửa đơn vị trong danh sách rồi nhập lại",
    ),
    (
        "correct the unit (perhaps {}), and import it again",
        "hãy sửa đơn vị (có lẽ là {0}) rồi nhập lại",
    ),
    (
        "correct the unit, and import it again",
        "hãy sửa đơn vị rồi nhập lại",
    ),
    (
        "its carving is {} mm deep, but most blocks are carved 0.3 to 5 mm deep",
        "nét khắc sâu {0#} mm, trong khi đa số ván được khắc sâu 0,3 đến 5 mm",
    ),
    (
        "if the unit is wrong, so are all lengths in mm",
        "nếu đơn vị sai thì mọi độ dài tính bằng mm đều sai",
    ),
    (
        "scanned_face_down says that the carved face points towards {}, but carving was found towards {}",
        "theo scanned_face_down, mặt khắc hướng về {0}, nhưng nét khắc được tìm thấy ở phía {1}",
    ),
    (
        "the image's colour profile ({}, for {} colours) cannot be applied, so its colours are read as sRGB",
        "không áp dụng được hồ sơ màu của hình ({0}, dành cho màu {1}) nên màu được đọc theo sRGB",
    ),
    (
        "the image's colour profile ({}) cannot be applied, so its colours are read as sRGB",
        "không áp dụng được hồ sơ màu của hình ({0}) nên màu được đọc theo sRGB",
    ),
    (
        "the box was moved away from the character of the truth",
        "khung đã được chuyển ra khỏi chữ của dữ liệu đối chứng",
    ),
    (
        "the box was moved, but the mask of its true stroke tops was not",
        "khung đã được chuyển, nhưng mặt nạ đúng của đỉnh nét thì không",
    ),
    (
        "the truth does not name the crop of the page that it is for",
        "dữ liệu đối chứng không nêu phần trang in mà nó thuộc về",
    ),
    ("store it again", "hãy lưu lại"),
    (
        "if they look wrong, convert the image to sRGB",
        "nếu màu trông không đúng, hãy chuyển hình sang sRGB",
    ),
    (
        "vertices without a position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside) were left out with their faces: {}",
        "số đỉnh không có vị trí (NaN, vô hạn, trên 1e15, 0 0 0 lặp lại hoặc một số lặp lại ở rất xa) đã bị bỏ cùng các mặt của chúng: {0#}",
    ),
    (
        "faces with fewer than three corners were left out: {}",
        "số mặt có ít hơn ba góc đã bị bỏ: {0#}",
    ),
    (
        "the labels would be saved in {}, where workers on other computers do not find them",
        "nhãn sẽ được lưu trong {0}, nơi các máy khác không tìm thấy",
    ),
    (
        "use a project folder below one of [storage.roots] that all of them have, or correct the labels in another program and import them",
        "hãy dùng thư mục dự án nằm dưới một thư mục của [storage.roots] mà mọi máy đều có, hoặc sửa nhãn bằng chương trình khác rồi nhập",
    ),
    // Inputs that are no longer at their places.
    (
        "{} of {} input files that were looked at are missing or have moved (pairs or blocks: {}), and so is the folder {}",
        "{0#} trong số {1#} tệp đầu vào đã kiểm tra bị thiếu hoặc đã chuyển chỗ (số cặp hoặc ván: {2#}), và cả thư mục {3}",
    ),
    (
        "{} of {} input files that were looked at are missing or have moved (pairs or blocks: {}), and so are the folders {}",
        "{0#} trong số {1#} tệp đầu vào đã kiểm tra bị thiếu hoặc đã chuyển chỗ (số cặp hoặc ván: {2#}), và cả các thư mục {3}",
    ),
    (
        "{} of {} input files that were looked at are missing or have moved, first {}",
        "{0#} trong số {1#} tệp đầu vào đã kiểm tra bị thiếu hoặc đã chuyển chỗ, tệp đầu tiên là {2}",
    ),
    (
        "put them back, or import them from their new place",
        "hãy đưa chúng về chỗ cũ, hoặc nhập lại từ chỗ mới",
    ),
    (
        "put them back, or write their new place below [storage.roots] in the settings",
        "hãy đưa chúng về chỗ cũ, hoặc ghi chỗ mới dưới [storage.roots] trong thiết lập",
    ),
    // Ids of a list.
    (
        "the id {} on line {} looks like a date or a power of ten: a spreadsheet program may have made it of a text such as 1-11 or 1E5",
        "mã {0} ở dòng {1} trông như ngày tháng hoặc lũy thừa của mười: có thể chương trình bảng tính đã đổi nó từ một văn bản như 1-11 hoặc 1E5",
    ),
    (
        "the block {} on line {} looks like a date or a power of ten: a spreadsheet program may have made it of a text such as 1-11 or 1E5",
        "ván {0} ở dòng {1} trông như ngày tháng hoặc lũy thừa của mười: có thể chương trình bảng tính đã đổi nó từ một văn bản như 1-11 hoặc 1E5",
    ),
    (
        "{} blocks look like dates or powers of ten, such as {} (lines {}): a spreadsheet program may have made them of texts such as 1-11 and 1E5",
        "{0#} ván trông như ngày tháng hoặc lũy thừa của mười, chẳng hạn {1} (dòng {2}): có thể chương trình bảng tính đã đổi chúng từ các văn bản như 1-11 và 1E5",
    ),
    (
        "{} ids look like dates or powers of ten, such as {} (lines {}): a spreadsheet program may have made them of texts such as 1-11 and 1E5",
        "{0#} mã trông như ngày tháng hoặc lũy thừa của mười, chẳng hạn {1} (dòng {2}): có thể chương trình bảng tính đã đổi chúng từ các văn bản như 1-11 và 1E5",
    ),
    (
        "give the column the format Text, correct its cells and save the list again, best as XLSX",
        "hãy đặt định dạng Văn bản cho cột, sửa lại các ô của cột rồi lưu lại danh sách, tốt nhất là XLSX",
    ),
    // Damaged rows of the catalog.
    (
        "row {} of the table {} (pair {}) differs from its checksum",
        "dòng {0} của bảng {1} (cặp {2}) khác với mã kiểm của nó",
    ),
    (
        "row {} of the table {} differs from its checksum",
        "dòng {0} của bảng {1} khác với mã kiểm của nó",
    ),
    (
        "row {} of the table {} is missing",
        "thiếu dòng {0} của bảng {1}",
    ),
    (
        "row {} of the table {} (pair {}) has no checksum",
        "dòng {0} của bảng {1} (cặp {2}) không có mã kiểm",
    ),
    (
        "row {} of the table {} has no checksum",
        "dòng {0} của bảng {1} không có mã kiểm",
    ),
    (
        "the last rows of the table {}, up to row {}, are missing",
        "thiếu các dòng cuối của bảng {0}, đến dòng {1}",
    ),
    (
        "row {} of the table {} (pair {}) has a value that this program did not store",
        "dòng {0} của bảng {1} (cặp {2}) có giá trị không do chương trình này lưu",
    ),
    (
        "row {} of the table {} has a value that this program did not store",
        "dòng {0} của bảng {1} có giá trị không do chương trình này lưu",
    ),
    ("is the unit {}?", "đơn vị có phải là {0} không?"),
    ("check the unit", "hãy kiểm tra đơn vị"),
    (
        "the scan shows no carved face: {}",
        "bản quét không có mặt khắc: {!0}",
    ),
    (
        "{} control points are too few: choose at least {}",
        "{0#} điểm là quá ít: hãy chọn ít nhất {1#} điểm",
    ),
    (
        "the control points lie within {} mm of each other: choose points that are at least {} mm apart, best near the corners of the text",
        "các điểm chỉ cách nhau {0#} mm: hãy chọn các điểm cách nhau ít nhất {1#} mm, tốt nhất gần các góc của phần chữ",
    ),
    (
        "the control points contradict each other: no common position is nearer than {} mm to all of them",
        "các điểm mâu thuẫn với nhau: không có vị trí chung nào gần tất cả các điểm hơn {0#} mm",
    ),
    (
        "choose them again on the same strokes of both images, or add a fourth one",
        "hãy chọn lại trên cùng các nét của hai hình, hoặc thêm điểm thứ tư",
    ),
    (
        "control point {} contradicts the others, which put it {} mm away: choose it again on the same stroke of both images",
        "điểm {0} mâu thuẫn với các điểm khác, vốn cho vị trí cách đó {1#} mm: hãy chọn lại điểm đó trên cùng một nét của hai hình",
    ),
    (
        "relief and ink do not agree at the control points: {} % of the places agree",
        "mặt khắc và mực không khớp tại các điểm: {0#} % số chỗ khớp nhau",
    ),
    (
        "choose points on the same strokes of both images",
        "hãy chọn các điểm trên cùng các nét của hai hình",
    ),
    (
        "the scans and prints need {} in {}, and the disk has {}",
        "bản quét và bản in cần {0#} trong {1}, đĩa còn {2#}",
    ),
    (
        "make room, or name another disk",
        "hãy giải phóng dung lượng",
    ),
    // The correction of a block.
    (
        "the points of this block were changed since this page was opened: reload the page to see them",
        "các điểm của ván này đã được thay đổi sau khi mở trang: hãy tải lại trang để xem",
    ),
    (
        "{} was replaced since this page was opened: reload the page, and choose the points again",
        "{0} đã được thay sau khi mở trang: hãy tải lại trang rồi chọn lại các điểm",
    ),
    (
        "the page was opened again, or other points were tried: try these again before saving them",
        "trang đã được mở lại, hoặc các điểm khác đã được thử: hãy thử lại các điểm này trước khi lưu",
    ),
    // The boxes of a block.
    (
        "the labels of this block were changed since this page was opened: reload the page",
        "nhãn của ván này đã được thay đổi sau khi mở trang: hãy tải lại trang",
    ),
    (
        "no box is left: keep at least one, or retire the pairs of the block",
        "không còn khung nào: hãy giữ ít nhất một khung, hoặc đưa các cặp của ván ra khỏi thống kê",
    ),
    (
        "box {} was not shown: reload the page",
        "trang chưa hiện khung {0}: hãy tải lại trang",
    ),
    (
        "box {} and box {} are both named {} (upper and lower case are equal)",
        "khung {0} và khung {1} cùng có tên {2} (không phân biệt chữ hoa và chữ thường)",
    ),
    ("rename one of them", "hãy đổi tên một trong hai"),
    ("the boxes", "các khung chữ"),
    ("correct or remove it", "hãy sửa hoặc bỏ đi"),
    (
        "1 box repeats another and was left out: {}",
        "có một khung trùng với khung khác và đã bị bỏ: {0}",
    ),
    (
        "{} boxes repeat others and were left out: {}",
        "có {0#} khung trùng với khung khác và đã bị bỏ: {1}",
    ),
    (
        "1 box repeats another: {}",
        "có một khung trùng với khung khác: {0}",
    ),
    (
        "{} boxes repeat others: {}",
        "có {0#} khung trùng với khung khác: {1}",
    ),
    (
        "1 box is smaller than a pixel, a point or a line and was left out: {}",
        "có một khung nhỏ hơn một điểm ảnh, là điểm hoặc đường kẻ, và đã bị bỏ: {0}",
    ),
    (
        "{} boxes are smaller than a pixel, a point or a line and were left out: {}",
        "có {0#} khung nhỏ hơn một điểm ảnh, là điểm hoặc đường kẻ, và đã bị bỏ: {1}",
    ),
    (
        "1 box is smaller than a pixel, a point or a line: {}",
        "có một khung nhỏ hơn một điểm ảnh, là điểm hoặc đường kẻ: {0}",
    ),
    (
        "{} boxes are smaller than a pixel, a point or a line: {}",
        "có {0#} khung nhỏ hơn một điểm ảnh, là điểm hoặc đường kẻ: {1}",
    ),
    (
        "{} of {} boxes lies outside the page and was left out: {}",
        "{0#} trong {1#} khung nằm ngoài trang in và đã bị bỏ: {2}",
    ),
    (
        "{} of {} boxes lie outside the page and were left out: {}",
        "{0#} trong {1#} khung nằm ngoài trang in và đã bị bỏ: {2}",
    ),
    (
        "{} of {} boxes lies outside the page: {}",
        "{0#} trong {1#} khung nằm ngoài trang in: {2}",
    ),
    (
        "{} of {} boxes lie outside the page: {}",
        "{0#} trong {1#} khung nằm ngoài trang in: {2}",
    ),
    (
        "1 box reaches over an edge of the page and was cut there: {}",
        "có một khung vượt ra ngoài mép trang in và đã được cắt ở mép: {0}",
    ),
    (
        "{} boxes reach over an edge of the page and were cut there: {}",
        "có {0#} khung vượt ra ngoài mép trang in và đã được cắt ở mép: {1}",
    ),
    (
        "1 box reaches over an edge of the page: {}",
        "có một khung vượt ra ngoài mép trang in: {0}",
    ),
    (
        "{} boxes reach over an edge of the page: {}",
        "có {0#} khung vượt ra ngoài mép trang in: {1}",
    ),
    (
        "the labels are for an image of {} x {} px, the page is {} x {} px",
        "nhãn là của hình {0#} x {1#} px, trang in có {2#} x {3#} px",
    ),
    (
        "the boxes were scaled",
        "các khung đã được co giãn theo trang in",
    ),
    ("nothing was saved", "chưa lưu gì"),
    (
        "is this the scan of a whole block?",
        "đây có phải bản quét của cả ván không?",
    ),
];
