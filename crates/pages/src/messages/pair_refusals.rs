//! Why stages of pairs refuse scans and prints, with the Vietnamese texts.

/// Messages like those of the table of messages. An earlier row is preferred.
pub(super) const PAIR_REFUSALS: &[(&str, &str)] = &[
    (
        "mesh has {} vertices, a plane needs 3",
        "bản quét có {0#} đỉnh, cần ít nhất 3 đỉnh để có mặt phẳng",
    ),
    (
        "the coordinates of the {} vertices are too large to compute with",
        "tọa độ của {0#} đỉnh quá lớn để tính",
    ),
    (
        "all {} vertices lie at one point",
        "cả {0#} đỉnh nằm tại một điểm",
    ),
    (
        "all {} vertices lie on one line",
        "cả {0#} đỉnh nằm trên một đường thẳng",
    ),
    (
        "mesh has no faces, and {} points are too few to show a surface",
        "bản quét không có mặt tam giác, và {0#} điểm là quá ít để thấy bề mặt",
    ),
    (
        "mesh of {} vertices shows no surface from either side",
        "bản quét {0#} đỉnh không có bề mặt nhìn từ cả hai phía",
    ),
    (
        "no carving found: the likeliest side has a relief of {} on an extent of {} (mesh units), a share below fit.min_relief {}",
        "không tìm thấy nét khắc: phía khả dĩ nhất có độ nổi {0#} trên chiều dài {1#} (đơn vị của bản quét), tỉ lệ thấp hơn fit.min_relief {2#}",
    ),
    (
        "no other side or part resembles the print",
        "không có phía hay phần nào khác giống bản in",
    ),
    (
        "plane fit found {} inliers of {} selected points, needs {}",
        "khớp mặt phẳng chỉ được {0#} trong {1#} điểm đã chọn, cần {2#}",
    ),
    (
        "depth.resolution_by is px_per_mm but the unit of the mesh is not known",
        "depth.resolution_by là px_per_mm nhưng không biết đơn vị của bản quét",
    ),
    ("give it in the manifest", "hãy ghi đơn vị trong danh sách"),
    (
        "depth map would be {} px long, more than {}",
        "bản đồ độ sâu sẽ dài {0#} điểm ảnh, hơn {1#}",
    ),
    (
        "lower depth.px_per_mm or check the unit",
        "hãy giảm depth.px_per_mm hoặc kiểm tra đơn vị",
    ),
    (
        "no ray along the plane's normal meets the mesh",
        "không có tia nào vuông góc với mặt phẳng gặp bản quét",
    ),
    (
        "print has no ink: {} of it is beyond the grey threshold {}",
        "bản in không có mực: {0#} của hình vượt ngưỡng xám {1#}",
    ),
    (
        "print is ink all over: its lightest grey is {} of full white",
        "bản in toàn là mực: mức xám sáng nhất chỉ bằng {0#} của trắng hoàn toàn",
    ),
    (
        "normalize chose no threshold for {}",
        "bước tách nét không chọn được ngưỡng cho {0}",
    ),
    (
        "the depth map has no strokes at the threshold of {}",
        "bản đồ độ sâu không có nét ở ngưỡng của {0}",
    ),
    (
        "they agree in the left half of the print only: is the sheet folded, torn or covered there?",
        "chỉ khớp ở nửa trái của bản in: tờ giấy có bị gấp, rách hoặc bị che không?",
    ),
    (
        "they agree in the right half of the print only: is the sheet folded, torn or covered there?",
        "chỉ khớp ở nửa phải của bản in: tờ giấy có bị gấp, rách hoặc bị che không?",
    ),
    (
        "they agree in the upper half of the print only: is the sheet folded, torn or covered there?",
        "chỉ khớp ở nửa trên của bản in: tờ giấy có bị gấp, rách hoặc bị che không?",
    ),
    (
        "they agree in the lower half of the print only: is the sheet folded, torn or covered there?",
        "chỉ khớp ở nửa dưới của bản in: tờ giấy có bị gấp, rách hoặc bị che không?",
    ),
    (
        "this looks like a whole block ({} mm): import it with its page by {}",
        "trông như cả ván ({0#} mm): hãy nhập cùng trang in của nó bằng {1}",
    ),
    (
        "the stage took longer than {} s (run.stage_timeout_s)",
        "bước này mất hơn {0#} giây (run.stage_timeout_s)",
    ),
    (
        "{} took longer than {} s while it read {}",
        "bước {!0} mất hơn {1#} giây khi đọc {2}",
    ),
    (
        "its disk or network may hang",
        "ổ đĩa hoặc mạng có thể bị treo",
    ),
    ("{} took longer than {} s", "bước {!0} mất hơn {1#} giây"),
    (
        "{} workers died or hung over it at {}",
        "{0#} tiến trình đã chết hoặc treo vì nó ở bước {!1}",
    ),
    (
        "the stage returned a number that is not finite",
        "bước này trả về một số không hữu hạn",
    ),
    (
        "a stage finished before the mesh was read",
        "một bước kết thúc trước khi đọc bản quét",
    ),
    ("there are no vertices", "không có đỉnh nào"),
    ("there are {} vertices", "có {0#} đỉnh"),
    (
        "at most 4294967295 can be used",
        "chỉ dùng được nhiều nhất 4294967295 đỉnh",
    ),
    (
        "vertex {} (counted from 0) has the coordinate {}, which is not a finite number",
        "đỉnh {0#} (đếm từ 0) có tọa độ {1}, không phải số hữu hạn",
    ),
    (
        "remove such vertices and their faces",
        "hãy bỏ các đỉnh đó và các mặt của chúng",
    ),
    (
        "face {} refers to vertex {}, but there are {} vertices",
        "mặt {0#} dùng đỉnh {1#}, nhưng chỉ có {2#} đỉnh",
    ),
    ("both count from 0", "cả hai đếm từ 0"),
    (
        "the {} holds {}, but its header says {}",
        "tệp {0} chứa {1}, nhưng phần đầu tệp ghi {2}",
    ),
    (
        "save it again with the right count",
        "hãy lưu lại với số lượng đúng",
    ),
    (
        "save it again with the right counts",
        "hãy lưu lại với các số lượng đúng",
    ),
    (
        "the binary STL has {} bytes a triangle instead of 50",
        "tệp STL nhị phân có {0#} byte mỗi tam giác thay vì 50",
    ),
    (
        "save it again without attributes, or as PLY",
        "hãy lưu lại không kèm thuộc tính, hoặc thành PLY",
    ),
    (
        "the {} has {} bytes after the rows that its header counts",
        "tệp {0} còn {1#} byte sau các dòng mà phần đầu tệp ghi",
    ),
    (
        "{} of {} vertices have no position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside), and without them nothing is left",
        "{0#} trong {1#} đỉnh không có vị trí (NaN, vô hạn, trên 1e15, 0 0 0 lặp lại hoặc một số lặp lại ở rất xa), bỏ chúng đi thì không còn gì",
    ),
    (
        "a face refers to a vertex that the file does not have",
        "có mặt dùng một đỉnh mà tệp không có",
    ),
    ("the PLY header is wrong: {}", "phần đầu tệp PLY sai: {!0}"),
    ("{} of 3 coordinates", "chỉ có {0#} trong 3 tọa độ"),
    (
        "a coordinate is missing or not a number",
        "thiếu tọa độ hoặc tọa độ không phải là số",
    ),
    (
        "a corner is not the number of a vertex",
        "một góc không phải là số thứ tự của đỉnh",
    ),
    (
        "a corner refers to a vertex that the file does not have",
        "một góc dùng đỉnh mà tệp không có",
    ),
    (
        "the last line is a face with {}",
        "dòng cuối là một mặt chỉ có {0}",
    ),
    ("the file seems to be cut off", "tệp có vẻ bị cắt cụt"),
    (
        "it is the last line, so the file seems to be cut off",
        "đây là dòng cuối nên tệp có vẻ bị cắt cụt",
    ),
    ("it has more than {} bytes", "dòng có hơn {0#} byte"),
    ("a vertex outside of a facet", "có đỉnh nằm ngoài mặt"),
    (
        "{} is not a word of ascii STL",
        "{0} không phải là từ của STL dạng văn bản",
    ),
    ("{} stands where it must not", "{0} nằm sai chỗ"),
    (
        "its commas may separate numbers or be part of them",
        "dấu phẩy có thể ngăn cách các số hoặc thuộc về số",
    ),
    (
        "write spaces between numbers",
        "hãy viết dấu cách giữa các số",
    ),
    (
        "it names {} columns, but the first point has {}",
        "dòng này nêu {0#} cột, nhưng điểm đầu tiên có {1#}",
    ),
    ("no format line", "thiếu dòng format"),
    (
        "the file ends before end_header",
        "tệp hết trước end_header",
    ),
    ("it is longer than 1 MiB", "dài hơn 1 MiB"),
    (
        "limits.image.max_bytes is {}",
        "limits.image.max_bytes là {0#}",
    ),
    (
        "the image is {} x {} pixels: it has no pixels",
        "hình có cỡ {0#} x {1#}: không có điểm ảnh nào",
    ),
    (
        "the image is {} x {} pixels",
        "hình có {0#} x {1#} điểm ảnh",
    ),
    (
        "limits.image.max_pixels is {}",
        "limits.image.max_pixels là {0#}",
    ),
    (
        "the TIFF image has {} pages, {} of them of full size",
        "hình TIFF có {0#} trang, trong đó {1#} trang đủ cỡ",
    ),
    (
        "a print is one page: save it as its own file",
        "bản in là một trang: hãy lưu trang đó thành tệp riêng",
    ),
    (
        "the {} cannot be decoded: {}",
        "không giải mã được {0}: {!1}",
    ),
    ("the {} is damaged", "{0} bị hỏng"),
    (
        "copy it again, or open it in another program and save it as PNG (the decoder found: {})",
        "hãy chép lại, hoặc mở bằng chương trình khác rồi lưu thành PNG (bộ giải mã thấy: {!0})",
    ),
    ("the file has only zeros", "tệp chỉ có byte 0"),
    ("{} has only zeros", "{0} chỉ có byte 0"),
    (
        "was the copy interrupted? copy it again",
        "việc chép có bị gián đoạn không? hãy chép lại",
    ),
    (
        "line {} says that {} points follow, but {} do",
        "dòng {0} cho biết có {1#} điểm tiếp theo, nhưng chỉ có {2#}",
    ),
    (
        "copy the file again if it was cut, or correct the number",
        "hãy chép lại tệp nếu tệp bị cắt cụt, hoặc sửa lại con số",
    ),
    ("it has no image", "tệp không có hình"),
    ("one of its colours is missing", "thiếu một thành phần màu"),
    (
        "its colours are coded in several scans of different sizes",
        "màu được mã hóa trong nhiều lượt quét khác cỡ",
    ),
    (
        "save it as a usual JPEG or as PNG",
        "hãy lưu thành JPEG thông thường hoặc PNG",
    ),
    (
        "its chroma samples are shared by pixels in an unusual way",
        "các điểm ảnh dùng chung mẫu màu theo cách không thông dụng",
    ),
    ("save it as RGB", "hãy lưu thành RGB"),
    ("artifact {} is missing", "thiếu tệp kết quả {0}"),
    (
        "artifact {} was changed: its bytes do not match its name",
        "tệp kết quả {0} đã bị thay đổi: nội dung không khớp với tên",
    ),
    (
        "artifact {} is in an object store",
        "tệp kết quả {0} nằm trong kho đối tượng",
    ),
    (
        "set storage.artifacts to its address",
        "hãy đặt storage.artifacts thành địa chỉ của kho",
    ),
    ("artifact {}: {}", "tệp kết quả {0}: {1}"),
    (
        "{} is {}, where this program keeps {} of its own",
        "{0} là {1}, trong khi chương trình này giữ {2} ở đó",
    ),
    ("move it away", "hãy chuyển nó đi"),
    (
        "{} was renamed, moved or removed during this command, so nothing more was written there",
        "{0} đã bị đổi tên, chuyển hoặc xóa trong lúc chạy nên không ghi thêm gì vào đó",
    ),
    (
        "run the command again with the new path",
        "hãy chạy lại với đường dẫn mới",
    ),
    (
        "it has {} columns between tabs, but others have {}",
        "dòng này có {0#} cột giữa các dấu tab, nhưng các dòng khác có {1#}",
    ),
    (
        "write one tab between columns",
        "hãy viết một dấu tab giữa hai cột",
    ),
    (
        "it has {} columns, but most lines have {}",
        "dòng này có {0#} cột, nhưng hầu hết các dòng có {1#}",
    ),
    (
        "write numbers such as \"1 234\" without blanks",
        "hãy viết các số như \"1 234\" liền nhau, không có dấu cách",
    ),
    (
        "its first two numbers may be a row and a column, or x and y",
        "hai số đầu có thể là hàng và cột, hoặc x và y",
    ),
    (
        "name the columns in a line before the points, such as `row col x y z`",
        "hãy ghi tên các cột trên một dòng trước các điểm, chẳng hạn `row col x y z`",
    ),
    (
        "its first three numbers may be those of a scan or point, a row and a column",
        "ba số đầu có thể là số của bản quét hay điểm, hàng và cột",
    ),
    (
        "name the columns in a line before the points, such as `scan row col x y z`",
        "hãy ghi tên các cột trên một dòng trước các điểm, chẳng hạn `scan row col x y z`",
    ),
    (
        "it may begin with a number that the others lack",
        "có thể dòng này có ở đầu số thứ tự mà các dòng khác không có",
    ),
    (
        "a grid of heights begins here",
        "đây là lưới độ cao, không phải các điểm",
    ),
    (
        "save it as points, with x, y and z of each in a line",
        "hãy lưu thành các điểm, mỗi dòng có x, y và z của một điểm",
    ),
    (
        "its first number may be x, or that of a point or a scan",
        "số đầu có thể là x, hoặc số thứ tự của điểm hay của bản quét",
    ),
    (
        "its first number may be x or a time",
        "số đầu có thể là x hoặc thời gian",
    ),
    (
        "name the columns in a line before the points, such as `n x y z`",
        "hãy ghi tên các cột trên một dòng trước các điểm, chẳng hạn `n x y z`",
    ),
    (
        "name the columns in a line before the points, such as `t x y z`",
        "hãy ghi tên các cột trên một dòng trước các điểm, chẳng hạn `t x y z`",
    ),
    (
        "it may lack the number that the others begin with",
        "có thể dòng này thiếu số thứ tự mà các dòng khác có ở đầu",
    ),
    (
        "blanks may group the digits of its numbers or separate them",
        "dấu cách có thể tách nhóm chữ số hoặc tách các số",
    ),
    (
        "write numbers such as \"1 234.5\" without blanks",
        "hãy viết các số như \"1 234.5\" liền nhau, không có dấu cách",
    ),
    (
        "a cell has a blank, but is not a number such as \"1 234\"",
        "có ô chứa dấu cách nhưng không phải là số như \"1 234\"",
    ),
    (
        "{} has a point, but others have a comma",
        "{0} có dấu chấm, nhưng các số khác có dấu phẩy",
    ),
    (
        "{} has a comma, but others have a point",
        "{0} có dấu phẩy, nhưng các số khác có dấu chấm",
    ),
    (
        "write all numbers with the same decimal mark",
        "hãy viết mọi số với cùng một dấu thập phân",
    ),
    (
        "no header of a PTX scan begins here",
        "không có phần đầu của bản quét PTX ở dòng này",
    ),
    (
        "the scan before it may have more points than its header says",
        "bản quét trước đó có thể có nhiều điểm hơn phần đầu của nó ghi",
    ),
];
