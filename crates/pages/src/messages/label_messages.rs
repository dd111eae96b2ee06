//! Refusals and warnings of labels with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const LABEL_MESSAGES: &[(&str, &str)] = &[
    // Formats of labels.
    ("save the labels again", "hãy lưu lại nhãn"),
    (
        "fetch the {} with `git lfs pull`",
        "hãy tải nội dung bằng `git lfs pull`",
    ),
    ("save or copy the file again", "hãy lưu hoặc chép lại tệp"),
    ("the file has {} bytes", "tệp có {0#} byte"),
    (
        "labels of at most {} bytes are read",
        "chỉ đọc được nhãn dài nhất {0#} byte",
    ),
    ("labels are {}, in UTF-8", "nhãn phải là {0}, mã UTF-8"),
    ("labels are {}", "nhãn phải là {0}"),
    (
        "the text begins with {}, as no known format does",
        "văn bản bắt đầu bằng {0}, không giống định dạng nào đã biết",
    ),
    (
        "JSON with {} is not a known format",
        "không biết định dạng JSON có {0}",
    ),
    (
        "this is a project of VIA 3, which is not read",
        "đây là dự án của VIA 3, không đọc được",
    ),
    (
        "draw the boxes in VIA 2, or export COCO",
        "hãy vẽ khung bằng VIA 2, hoặc xuất COCO",
    ),
    (
        "the root element of the XML is {}, not \"PcGts\"",
        "phần tử gốc của XML là {0}, không phải \"PcGts\"",
    ),
    (
        "of XML, only PAGE-XML is read",
        "trong các loại XML chỉ đọc được PAGE-XML",
    ),
    (
        "the {} is truncated: it ends early at line {}",
        "tệp {0} bị cắt cụt: kết thúc sớm ở dòng {1}",
    ),
    (
        "the file has no boxes for {}",
        "tệp không có khung nào của {0}",
    ),
    ("the file has no boxes", "tệp không có khung nào"),
    ("draw at least one", "hãy vẽ ít nhất một khung"),
    (
        "the page has more than {} boxes",
        "trang in có hơn {0#} khung",
    ),
    (
        "keep only the boxes of its characters",
        "hãy chỉ giữ khung của các chữ",
    ),
    (
        "the outline has more than {} corners",
        "đường viền có hơn {0#} góc",
    ),
    (
        "simplify it or draw a box",
        "hãy làm đơn giản hơn hoặc vẽ khung chữ nhật",
    ),
    (
        "reading the JSON would take more than {} MiB of memory",
        "đọc JSON này cần hơn {0#} MiB bộ nhớ",
    ),
    (
        "save fewer pages in one file",
        "hãy lưu ít trang hơn trong một tệp",
    ),
    (
        "the boxes together are {} times as large as the page, more than {} times",
        "tổng các khung lớn gấp {0#} lần trang in, hơn {1#} lần",
    ),
    (
        "{} entries of the file are about {}",
        "{0#} mục của tệp nói về {1}",
    ),
    ("keep one of them", "hãy giữ một mục"),
    (
        "the labels are for an image of {} x {} px, the page is {} x {} px (the labelled image was turned, perhaps by its EXIF orientation)",
        "nhãn là của hình {0#} x {1#} px, trang in có {2#} x {3#} px (hình được gán nhãn đã bị xoay, có thể do hướng EXIF)",
    ),
    (
        "take the image that was labelled",
        "hãy dùng hình đã được gán nhãn",
    ),
    (
        "{} of {} boxes lie outside the page of {} x {} px: {}",
        "{0#} trong {1#} khung nằm ngoài trang in {2#} x {3#} px: {!4}",
    ),
    (
        "{} of {} boxes lies outside the page of {} x {} px: {}",
        "{0#} trong {1#} khung nằm ngoài trang in {2#} x {3#} px: {!4}",
    ),
    (
        "{} of 1 box lies outside the page of {} x {} px: {}",
        "khung duy nhất nằm ngoài trang in {1#} x {2#} px: {!3}",
    ),
    (
        "labels of another page?",
        "có phải nhãn của trang khác không?",
    ),
    (
        "as two corners, their numbers fit the page",
        "nếu là hai góc thì các số này vừa với trang in",
    ),
    (
        "are they corners where this format has width and height?",
        "có phải đã ghi góc thay cho chiều rộng và chiều cao không?",
    ),
    // Values of labels.
    ("{} is not a number", "{0} không phải là số"),
    ("{} is {}, not a text", "{0} là {1}, không phải là văn bản"),
    (
        "a number of segmentation is {}, not a number",
        "một giá trị của segmentation là {0}, không phải là số",
    ),
    (
        "a number of segmentation is {}, not a coordinate in pixels",
        "một giá trị của segmentation là {0}, không phải là tọa độ tính bằng điểm ảnh",
    ),
    (
        "a number of bbox is {}, not a number",
        "một giá trị của bbox là {0}, không phải là số",
    ),
    (
        "a number of bbox is {}, not a coordinate in pixels",
        "một giá trị của bbox là {0}, không phải là tọa độ tính bằng điểm ảnh",
    ),
    (
        "a value of all_points_x is {}, not a number",
        "một giá trị của all_points_x là {0}, không phải là số",
    ),
    (
        "a value of all_points_x is {}, not a coordinate in pixels",
        "một giá trị của all_points_x là {0}, không phải là tọa độ tính bằng điểm ảnh",
    ),
    (
        "a value of all_points_y is {}, not a number",
        "một giá trị của all_points_y là {0}, không phải là số",
    ),
    (
        "a value of all_points_y is {}, not a coordinate in pixels",
        "một giá trị của all_points_y là {0}, không phải là tọa độ tính bằng điểm ảnh",
    ),
    ("{} is {}, not a number", "{0} là {1}, không phải là số"),
    (
        "{} is {}, not a coordinate in pixels",
        "{0} là {1}, không phải là tọa độ tính bằng điểm ảnh",
    ),
    ("it has the id of image {}", "có cùng mã với hình {0}"),
    ("image_id is missing", "thiếu image_id"),
    ("image_id is {}", "image_id là {0}"),
    (
        "1 box left out, whose image_id is that of no image",
        "đã bỏ 1 khung có image_id không phải của hình nào",
    ),
    (
        "{} boxes left out, whose image_id is that of no image",
        "đã bỏ {0#} khung có image_id không phải của hình nào",
    ),
    (
        "bbox is {}, not [x, y, width, height]",
        "bbox là {0}, không phải [x, y, chiều rộng, chiều cao]",
    ),
    (
        "bbox is missing, and segmentation is not one polygon",
        "thiếu bbox, và segmentation không phải là một đa giác",
    ),
    (
        "segmentation has {} numbers, an odd count",
        "segmentation có {0#} số, là số lẻ",
    ),
    (
        "a circle has {} points, not 2",
        "hình tròn có {0#} điểm, không phải 2",
    ),
    (
        "{} is not a shape of labelme",
        "{0} không phải là hình dạng của labelme",
    ),
    ("points are missing", "thiếu points"),
    ("shape_attributes are missing", "thiếu shape_attributes"),
    ("{} is not a point [x, y]", "{0} không phải là điểm [x, y]"),
    ("{} is not a point", "{0} không phải là điểm"),
    ("it has no element Page", "không có phần tử Page"),
    ("it has several elements Page", "có nhiều phần tử Page"),
    (
        "1 element is not divided as others are, and taken as a character: {}",
        "1 phần tử không được chia nhỏ như các phần tử khác và được coi là chữ: {0}",
    ),
    (
        "1 element is not divided as others are, and left out, because it holds several characters: {}",
        "1 phần tử không được chia nhỏ như các phần tử khác và đã bị bỏ vì chứa nhiều chữ: {0}",
    ),
    (
        "{} elements are not divided as others are, and taken as characters: {}",
        "{0#} phần tử không được chia nhỏ như các phần tử khác và được coi là chữ: {1}",
    ),
    (
        "{} elements are not divided as others are, and left out, because they hold several characters: {}",
        "{0#} phần tử không được chia nhỏ như các phần tử khác và đã bị bỏ vì chứa nhiều chữ: {1}",
    ),
    (
        "{} columns; the first line has {}; correct or remove it",
        "{0#} cột, trong khi dòng đầu có {1#}; hãy sửa hoặc bỏ đi",
    ),
    ("the column {} is missing", "thiếu cột {0}"),
    (
        "the JSON in column {} ends early",
        "JSON trong cột {0} kết thúc sớm",
    ),
    ("regions are missing", "thiếu regions"),
    ("regions are {}", "regions là {0}"),
    ("the shape has no name", "hình dạng không có tên"),
    (
        "{} is not a shape of VIA",
        "{0} không phải là hình dạng của VIA",
    ),
    ("{} is not a list", "{0} không phải là danh sách"),
    (
        "{} values in all_points_x, but {} in all_points_y",
        "có {0#} giá trị trong all_points_x, nhưng {1#} trong all_points_y",
    ),
    (
        "the file has more than {} numbers up to here",
        "đến đây tệp có hơn {0#} số",
    ),
    (
        "simplify its outlines or draw boxes",
        "hãy làm các đường viền đơn giản hơn hoặc vẽ khung chữ nhật",
    ),
    (
        "{} is not a fraction of the page from 0 to 1",
        "{0} không phải là tỉ lệ của trang in, từ 0 đến 1",
    ),
    (
        "the class is {}, not a whole number",
        "lớp là {0}, không phải số nguyên",
    ),
    (
        "{} numbers; a line has a class and at least 4 more; correct or remove it",
        "có {0#} số, trong khi mỗi dòng cần một lớp và ít nhất 4 số nữa; hãy sửa hoặc bỏ đi",
    ),
    (
        "column {} is {}, neither a confidence from 0 to 1 nor the id of a track",
        "cột {0} là {1}, không phải độ tin cậy từ 0 đến 1 cũng không phải mã theo dõi",
    ),
    (
        "{} columns are neither a box nor an outline beside the {} columns of line {}",
        "{0#} cột không phải là khung hay đường viền, so với {1#} cột của dòng {2}",
    ),
    (
        "7 columns may be a box with a confidence and an id, or a triangle (a box needs only 5)",
        "7 cột có thể là khung với độ tin cậy và mã, hoặc là tam giác (khung chỉ cần 5 cột)",
    ),
    (
        "the first 5 of {} columns are a box and the others neither corners nor a confidence and an id",
        "5 cột đầu trong {0#} cột là khung, còn các cột khác không phải góc cũng không phải độ tin cậy và mã",
    ),
    ("x is missing", "thiếu x"),
    ("y is missing", "thiếu y"),
    ("width is missing", "thiếu width"),
    ("height is missing", "thiếu height"),
    ("cx is missing", "thiếu cx"),
    ("cy is missing", "thiếu cy"),
    ("r is missing", "thiếu r"),
    ("rx is missing", "thiếu rx"),
    ("ry is missing", "thiếu ry"),
    ("x_min is missing", "thiếu x_min"),
    ("y_min is missing", "thiếu y_min"),
    ("x_max is missing", "thiếu x_max"),
    ("y_max is missing", "thiếu y_max"),
    // Labels and their page.
    (
        "the labels are of {}, the page is {}",
        "nhãn là của {0}, trang in là {1}",
    ),
    (
        "the labels were made for a file of {} bytes, the page has {}",
        "nhãn được tạo cho tệp {0#} byte, trang in có {1#} byte",
    ),
    (
        "the labels were drawn on the mirrored image: the outlines have {} % of the ink inside them, mirrored {} %",
        "nhãn được vẽ trên hình lật gương: các khung chứa {0#} % mực, lật lại thì {1#} %",
    ),
    (
        "mirror the image or the labels",
        "hãy lật gương hình hoặc nhãn",
    ),
    (
        "the labels were drawn on the image turned by 180 degrees: the outlines have {} % of the ink inside them, turned {} %",
        "nhãn được vẽ trên hình xoay 180 độ: các khung chứa {0#} % mực, xoay lại thì {1#} %",
    ),
    ("turn the image or the labels", "hãy xoay hình hoặc nhãn"),
    (
        "the labels seem to be those of another page: the outlines have {} % of the ink inside them (usually less than 35 %)",
        "có vẻ đây là nhãn của trang khác: các khung chứa {0#} % mực (thường là dưới 35 %)",
    ),
];
