//! Refusals and warnings of lists and of their rows with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const LIST_MESSAGES: &[(&str, &str)] = &[
    // Text and header of a list.
    (
        "the text is UTF-16 and truncated or damaged",
        "văn bản UTF-16 bị cắt cụt hoặc bị hỏng",
    ),
    (
        "{} is the lock file of an open document",
        "{0} là tệp khóa của một tài liệu đang mở",
    ),
    (
        "name the document {} instead",
        "hãy chọn tài liệu {0} thay cho tệp này",
    ),
    ("save it as UTF-8", "hãy lưu lại ở dạng UTF-8"),
    (
        "this is a workbook of an old format or with a password, or an archive",
        "đây là bảng tính định dạng cũ hoặc có mật khẩu, hoặc là tệp nén",
    ),
    (
        "save the table as XLSX or as \"CSV UTF-8\" in the spreadsheet program",
        "hãy dùng chương trình bảng tính lưu bảng thành XLSX hoặc \"CSV UTF-8\"",
    ),
    (
        "save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "an encoding of Chinese, Japanese or Korean, such as GB 18030 or EUC-KR",
        "một bảng mã tiếng Trung, tiếng Nhật hoặc tiếng Hàn, chẳng hạn GB 18030 hoặc EUC-KR",
    ),
    (
        "it seems to be Windows-1258 (Vietnamese): save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "có vẻ là Windows-1258 (tiếng Việt): hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "it seems to be Windows-1252 (Western European): save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "có vẻ là Windows-1252 (Tây Âu): hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "it seems to be an encoding of Chinese, Japanese or Korean, such as GB 18030 or EUC-KR: save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "có vẻ là một bảng mã tiếng Trung, tiếng Nhật hoặc tiếng Hàn, chẳng hạn GB 18030 hoặc EUC-KR: hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "it seems to be EUC-JP (Japanese): save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "có vẻ là EUC-JP (tiếng Nhật): hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "it seems to be Big5 (Chinese): save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "có vẻ là Big5 (tiếng Trung): hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "it seems to be Shift-JIS (Japanese): save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")",
        "có vẻ là Shift-JIS (tiếng Nhật): hãy lưu danh sách ở dạng UTF-8 (trong Excel: Lưu thành, \"CSV UTF-8\")",
    ),
    (
        "it seems to be TCVN3 (Vietnamese): convert the list to UTF-8, such as with UniKey",
        "có vẻ là TCVN3 (tiếng Việt): hãy chuyển danh sách sang UTF-8, chẳng hạn bằng UniKey",
    ),
    ("the list is not UTF-8", "danh sách không phải là UTF-8"),
    (
        "the name of column {} is not UTF-8",
        "tên cột {0} không phải là UTF-8",
    ),
    (
        "the names of columns {} are not UTF-8",
        "tên các cột {0} không phải là UTF-8",
    ),
    (
        "the cell of column {} is not UTF-8",
        "ô của cột {0} không phải là UTF-8",
    ),
    ("byte {} is not UTF-8", "byte {0#} không phải là UTF-8"),
    (
        "a quote is opened here and never closed",
        "dấu ngoặc kép mở ở đây mà không được đóng",
    ),
    (
        "a quote is opened here, and the next one, on line {}, is followed by text",
        "dấu ngoặc kép mở ở đây, và ngay sau dấu ngoặc kép tiếp theo, ở dòng {0}, có chữ",
    ),
    (
        "close the quote on its line, and write a quote inside a quoted cell twice",
        "hãy đóng dấu ngoặc kép trên cùng dòng, và viết hai lần dấu ngoặc kép nằm trong ô",
    ),
    (
        "a quote is opened here and closed only on line {}",
        "dấu ngoặc kép mở ở đây mà đến dòng {0} mới đóng",
    ),
    (
        "a cell has at most {} lines",
        "một ô có nhiều nhất {0#} dòng",
    ),
    ("the row has more than {} bytes", "dòng dài hơn {0#} byte"),
    (
        "a closing quotation mark may be missing",
        "có thể thiếu dấu ngoặc kép đóng",
    ),
    (
        "the row has {} bytes, over the limit of {}",
        "dòng dài {0#} byte, vượt giới hạn {1#}",
    ),
    (
        "the name of column {} has {} bytes, over the limit of {}",
        "tên cột {0} dài {1#} byte, vượt giới hạn {2#}",
    ),
    (
        "{} has {} bytes, over the limit of {} ({})",
        "tệp {0} có {1#} byte, vượt giới hạn {2#} ({3})",
    ),
    (
        "{} has {} bytes, over the limit of {}",
        "giá trị của cột {0} dài {1#} byte, vượt giới hạn {2#}",
    ),
    ("this is no header", "đây không phải dòng tiêu đề"),
    ("line {} has these columns", "dòng {0} có các cột này"),
    (
        "line {} has the columns of a list of blocks",
        "dòng {0} có các cột của danh sách ván",
    ),
    ("remove the lines above it", "hãy xóa các dòng phía trên nó"),
    (
        "columns {} and {} are both named {}",
        "cột {0} và cột {1} cùng có tên {2}",
    ),
    (
        "columns {} and {}, {} and {}, have the same name (upper and lower case, accents and blanks do not count)",
        "cột {0} và cột {1}, {2} và {3}, trùng tên (không phân biệt chữ hoa, chữ thường, dấu và khoảng trắng)",
    ),
    ("column \"id\" is missing", "thiếu cột \"id\" (mã)"),
    (
        "column \"mesh\" is missing",
        "thiếu cột \"mesh\" (bản quét)",
    ),
    (
        "column \"print\" is missing",
        "thiếu cột \"print\" (bản in)",
    ),
    (
        "column \"page\" is missing",
        "thiếu cột \"page\" (trang in)",
    ),
    ("column \"block\" is missing", "thiếu cột \"block\" (ván)"),
    ("column {} is missing", "thiếu cột {0}"),
    (
        "the header has one column only, {}",
        "dòng tiêu đề chỉ có một cột: {0}",
    ),
    (
        "put a comma, semicolon or tab between columns",
        "hãy đặt dấu phẩy, dấu chấm phẩy hoặc dấu tab giữa các cột",
    ),
    (
        "rename {} to {} if it is meant",
        "nếu {0} là cột đó thì hãy đổi tên thành {1}",
    ),
    ("there is no column {} for {}", "không có cột {0} cho {1}"),
    (
        "column {} is chosen for two columns",
        "cột {0} được chọn cho hai cột",
    ),
    // Rows of a list.
    (
        "the row has {} cells, the header has {}",
        "dòng có {0#} ô, dòng tiêu đề có {1#}",
    ),
    ("id is empty", "ô mã (id) trống"),
    ("the id is empty", "mã trống"),
    ("mesh is empty", "ô bản quét (mesh) trống"),
    ("print is empty", "ô bản in (print) trống"),
    ("page is empty", "ô trang in (page) trống"),
    ("id names a file", "ô mã (id) ghi tên một tệp"),
    (
        "give each pair an id, or swap the columns if they are mixed up",
        "hãy đặt mã cho từng cặp, hoặc đổi chỗ các cột nếu bị nhầm",
    ),
    ("id {} is already on line {}", "mã {0} đã có ở dòng {1}"),
    ("block {} is already on line {}", "ván {0} đã có ở dòng {1}"),
    (
        "id {} differs from that on line {} only in upper and lower case, so their files would be one on Windows and macOS",
        "mã {0} chỉ khác mã ở dòng {1} ở chữ hoa và chữ thường, nên trên Windows và macOS tệp của chúng sẽ là một",
    ),
    (
        "block {} differs from that on line {} only in upper and lower case, so their files would be one on Windows and macOS",
        "ván {0} chỉ khác ván ở dòng {1} ở chữ hoa và chữ thường, nên trên Windows và macOS tệp của chúng sẽ là một",
    ),
    ("id {} holds {}", "mã {0} có ký tự {1}"),
    (
        "an id has no slashes, control or invisible characters",
        "mã không được có dấu gạch chéo, ký tự điều khiển hay ký tự ẩn",
    ),
    ("id {} begins with a dot", "mã {0} bắt đầu bằng dấu chấm"),
    (
        "id {} begins or ends with a space",
        "mã {0} bắt đầu hoặc kết thúc bằng dấu cách",
    ),
    (
        "an id of {} bytes is too long",
        "mã dài {0#} byte là quá dài",
    ),
    ("the limit is {}", "giới hạn là {0#}"),
    (
        "the id {} is the error of a formula",
        "mã {0} là lỗi của một công thức",
    ),
    (
        "correct it in the spreadsheet program",
        "hãy sửa trong chương trình bảng tính",
    ),
    (
        "mesh names an image and print names a mesh",
        "ô bản quét (mesh) ghi tệp hình, còn ô bản in (print) ghi tệp bản quét",
    ),
    (
        "mesh names an image and page names a mesh",
        "ô bản quét (mesh) ghi tệp hình, còn ô trang in (page) ghi tệp bản quét",
    ),
    ("swap the two", "hãy đổi chỗ hai mục này"),
    (
        "scanned_face_down is {}, not true, false, yes, no, 1 or 0",
        "scanned_face_down là {0}, không phải true, false, có, không, 1 hay 0",
    ),
    ("{} is not a unit ({})", "{0} không phải là đơn vị ({1})"),
    (
        "{} is not a side ({})",
        "{0} không phải là mặt của ván ({1}; hoặc mặt trước, mặt sau)",
    ),
    (
        "this is a line of an export with results",
        "đây là dòng của một bản xuất có kết quả",
    ),
    (
        "import your own list of blocks",
        "hãy nhập danh sách ván của bạn",
    ),
    ("the list contains no blocks", "danh sách không có ván nào"),
    (
        "column \"block\" has single characters and column \"character\" has none",
        "cột \"block\" có các chữ đơn còn cột \"character\" không có chữ nào",
    ),
    (
        "swap their names if they are mixed up, and import again",
        "nếu bị nhầm thì hãy đổi tên hai cột cho nhau rồi nhập lại",
    ),
    (
        "a value in a column without a name is left out, on line {}",
        "một giá trị trong cột không có tên bị bỏ qua, ở dòng {0}",
    ),
    ("name the column to keep it", "hãy đặt tên cột để giữ lại"),
    (
        "{} values in columns without a name are left out, the first on line {}",
        "{0#} giá trị trong các cột không có tên bị bỏ qua, giá trị đầu tiên ở dòng {1}",
    ),
    (
        "name the columns to keep them",
        "hãy đặt tên các cột để giữ lại",
    ),
    // Rows in JSON.
    (
        "a comma is missing before this row",
        "thiếu dấu phẩy trước dòng này",
    ),
    (
        "text follows the end of the list",
        "có văn bản sau chỗ kết thúc danh sách",
    ),
    ("the list ends early", "danh sách kết thúc sớm"),
    ("save or copy it again", "hãy lưu hoặc chép lại"),
    ("the key {} is given twice", "khóa {0} được ghi hai lần"),
    (
        "the keys {} and {} have the same name (upper and lower case, accents and blanks do not count)",
        "khóa {0} và khóa {1} trùng tên (không phân biệt chữ hoa, chữ thường, dấu và khoảng trắng)",
    ),
    ("leave one of them out", "hãy bỏ một trong hai"),
    (
        "the rows are in the list {} of an object",
        "các dòng nằm trong danh sách {0} của một đối tượng",
    ),
    ("save this list alone", "hãy lưu riêng danh sách này"),
    (
        "{} is not a number of JSON",
        "{0} không phải là số của JSON",
    ),
    ("write null or leave it out", "hãy viết null hoặc bỏ đi"),
    (
        "the number {} is too large to be exact",
        "số {0} quá lớn nên có thể không đúng từng chữ số",
    ),
    (
        "whole numbers that are written with {}: {}, the first in column {} on line {}",
        "số ô là số nguyên nhưng có phần {0}: {1#}, ô đầu tiên ở cột {2}, dòng {3}",
    ),
    (
        "they are read without it, as in JSON and XLSX",
        "phần này được bỏ khi đọc, như với JSON và XLSX",
    ),
    (
        "words for missing values beside whole numbers: {}, the first in column {} on line {}",
        "số ô có từ chỉ giá trị thiếu giữa các số nguyên: {0#}, ô đầu tiên ở cột {1}, dòng {2}",
    ),
    ("they are read as empty cells", "chúng được đọc như ô trống"),
    (
        "words for missing values: {}, the first in column {} on line {}",
        "số ô có từ chỉ giá trị thiếu: {0#}, ô đầu tiên ở cột {1}, dòng {2}",
    ),
    (
        "names that are words for missing values: {}, the first in column {} on line {}",
        "số ô tên có từ chỉ giá trị thiếu: {0#}, ô đầu tiên ở cột {1}, dòng {2}",
    ),
    (
        "they are kept, so clear these cells if there is no value",
        "chúng được giữ nguyên, vì vậy hãy xóa nội dung các ô này nếu không có giá trị",
    ),
    (
        "micrometres ({}) are not read",
        "không đọc được micrômét ({0})",
    ),
    (
        "divide the coordinates by 1000 and use mm",
        "hãy chia tọa độ cho 1000 và dùng mm",
    ),
    (
        "column {} has {}, a word for a missing value",
        "cột {0} có {1}, là từ chỉ giá trị thiếu",
    ),
    ("write the name", "hãy ghi tên"),
    (
        "ids that differ from another one only by {}: {}, the first {} on line {}",
        "số mã chỉ khác một mã khác ở phần {0}: {1#}, mã đầu tiên là {2}, ở dòng {3}",
    ),
    (
        "correct them if both mean one",
        "hãy sửa nếu cả hai chỉ là một",
    ),
    ("write it as text", "hãy viết nó dạng văn bản"),
    (
        "write it as text, in quotation marks",
        "hãy viết nó dạng văn bản, trong dấu ngoặc kép",
    ),
    ("{} is not an object", "{0} không phải là đối tượng"),
    ("{} is {}, not text", "{0} là {1}, không phải là văn bản"),
    // Errors of formulas.
    (
        "column {} has the error {} of a formula",
        "cột {0} có lỗi công thức {1}",
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
        "{0#} lỗi công thức bị bỏ qua, lỗi đầu tiên là {1} ở cột {2}, dòng {3}",
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
        "{0#} giá trị bị che dưới các ô gộp nên bị bỏ qua, giá trị đầu tiên ở ô {1}",
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
