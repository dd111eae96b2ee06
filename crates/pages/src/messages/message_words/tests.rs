//! Messages of the program with their Vietnamese texts.

use std::path::Path;

use mocban_core::raster::profile_warning;

use super::super::foreign_messages::FOREIGN_MESSAGES;
use super::super::source_texts::{crates, files, joined};
use super::{OPEN_ENDED, TABLES, parts_of, vietnamese};

/// Checks messages and their Vietnamese texts.
pub(super) fn assert_translated(messages: &[(&str, &str)]) {
    for (english, expected) in messages {
        assert_eq!(vietnamese(english).as_deref(), Some(*expected));
    }
}

#[test]
fn frequent_messages_are_translated_with_their_parts() {
    assert_translated(&[
        (
            "60 files are missing, nothing was imported:\n  pairs.csv: line 2: mesh m/0.stl of 0 does not exist\n  and 59 more",
            "thiếu 60 tệp nên chưa nhập gì:\n  pairs.csv: dòng 2: không có bản quét m/0.stl của 0\n  và 59 mục khác",
        ),
        (
            "60 files are missing or a folder, nothing was imported:\n  pairs.csv: line 3: print p/1 of 1 is a folder, not a file",
            "không dùng được 60 tệp nên chưa nhập gì:\n  pairs.csv: dòng 3: bản in p/1 của 1 là thư mục, không phải tệp",
        ),
        (
            "1 file is missing or a folder, nothing was imported:",
            "không dùng được 1 tệp nên chưa nhập gì:",
        ),
        (
            "ignored, a glTF scene is not read: m/b.glb and 1 more; open them in MeshLab, Blender or CloudCompare and export them as PLY",
            "bỏ qua, không đọc được cảnh 3D glTF: m/b.glb và 1 tệp khác; hãy mở chúng bằng MeshLab, Blender hoặc CloudCompare rồi xuất thành PLY",
        ),
        (
            "data/prints/1.png: relief and print do not match: confidence 0.20 in the pose is below register.min_confidence 0.3; is it the print of another character, or is the sheet torn or folded?",
            "data/prints/1.png: mặt khắc và bản in không khớp: độ tin cậy 0,20 của tư thế thấp hơn register.min_confidence 0,3; đây có phải bản in của chữ khác không, hay tờ giấy bị rách hoặc gấp?",
        ),
        (
            "m/1.stl: with the unit m, the scan is 12.7 m long; correct the unit (perhaps mm) in the list, and import it again",
            "m/1.stl: với đơn vị m, bản quét dài 12,7 m; hãy sửa đơn vị (có lẽ là mm) trong danh sách rồi nhập lại",
        ),
    ]);
}

#[test]
fn messages_about_files_are_translated_with_their_parts() {
    assert_translated(&[
        (
            "data/prints/1.jpg: the file is a BMP image",
            "data/prints/1.jpg: tệp là hình BMP",
        ),
        (
            "a.jpg: the file is a GIF image; PNG, JPEG and TIFF images are read: convert it, such as with ImageMagick: x FILE, and use the new file",
            "a.jpg: tệp là hình GIF; chỉ đọc được hình PNG, JPEG và TIFF: hãy chuyển đổi tệp, chẳng hạn bằng ImageMagick: x FILE, rồi dùng tệp mới",
        ),
        (
            "no labels for b04.jpg: the file is about b05.jpg; take the labels of this page, or rename it",
            "không có nhãn của b04.jpg: tệp này nói về b05.jpg; hãy dùng nhãn của trang này, hoặc đổi tên trang",
        ),
        (
            "there is no pair b4; similar ids: b04",
            "không có cặp b4; mã gần giống: b04",
        ),
        (
            "pair b 4 was retired on 2026-11-21 11:10:03 +07:00",
            "cặp b 4 đã được đưa ra khỏi thống kê lúc 21/11/2026 11:10:03 +07:00",
        ),
        (
            "pair b4 was retired on 2026-11-21, because a list that replaced the others does not have it",
            "cặp b4 đã được đưa ra khỏi thống kê lúc 2026-11-21, vì danh sách thay thế các danh sách khác không có cặp này",
        ),
        (
            "pair b4 is retired, because its box is gone from the labels of its block; its verdicts are kept",
            "cặp b4 không có trong thống kê, vì khung của nó không còn trong nhãn của ván; các đánh giá của nó vẫn được giữ",
        ),
        (
            "b04 is a block with 2 pairs, and no pair; give the id of a pair, such as b04-1",
            "b04 là ván, không phải là cặp; hãy nêu mã của một cặp, ví dụ b04-1",
        ),
        (
            "p/mocban.toml: fit.seed = 7 is outside the range 0 to 1; new words",
            "p/mocban.toml: fit.seed = 7 nằm ngoài khoảng 0 đến 1; new words",
        ),
        (
            "run.stage_timeout_s = 1000000 is outside the range 1 to 86400",
            "run.stage_timeout_s = 1\u{202f}000\u{202f}000 nằm ngoài khoảng 1 đến 86\u{202f}400",
        ),
        (
            "storage.catalog = 2.5 is not text",
            "storage.catalog = 2.5 không phải là văn bản",
        ),
        (
            "the control points contradict each other: no common position is nearer than 12 mm to all of them; choose them again on the same strokes of both images, or add a fourth one",
            "các điểm mâu thuẫn với nhau: không có vị trí chung nào gần tất cả các điểm hơn 12 mm; hãy chọn lại trên cùng các nét của hai hình, hoặc thêm điểm thứ tư",
        ),
        (
            "control point 2 contradicts the others, which put it 31 mm away: choose it again on the same stroke of both images",
            "điểm 2 mâu thuẫn với các điểm khác, vốn cho vị trí cách đó 31 mm: hãy chọn lại điểm đó trên cùng một nét của hai hình",
        ),
        (
            "there is no pair b4; similar ids: b04, b14 and 3 more",
            "không có cặp b4; mã gần giống: b04, b14 và 3 mục khác",
        ),
        (
            "p/data/meshes/0.ply is not there",
            "không có tệp p/data/meshes/0.ply",
        ),
        (
            "no labels for x: y is not there",
            "no labels for x: không có tệp y",
        ),
        (
            "b1: p/1.ply may not be read: permission denied",
            "b1: không có quyền đọc p/1.ply",
        ),
        (
            "a{1}.csv: line 2: mesh m/{3}.stl of {x{0} does not exist",
            "a{1}.csv: dòng 2: không có bản quét m/{3}.stl của {x{0}",
        ),
    ]);
    for other in ["", "a = 7 is too large", " is not there", "line 3: bad"] {
        assert_eq!(vietnamese(other), None, "{other:?}");
    }
}

#[test]
fn truncated_files_are_explained() {
    assert_translated(&[
        (
            "1.stl: the ascii STL is truncated: it ends after 0 facets without endsolid",
            "1.stl: tệp ascii STL bị cắt cụt: hết sau 0 mặt mà chưa có endsolid",
        ),
        (
            "1.ply: the binary PLY is truncated: it holds 3 of 9 vertices",
            "1.ply: tệp binary PLY bị cắt cụt: chỉ có 3 trong số 9 đỉnh",
        ),
        (
            "1.stl: the binary STL is truncated: it holds 1 of 2 triangles",
            "1.stl: tệp STL nhị phân bị cắt cụt: chỉ có 1 trong số 2 tam giác",
        ),
        (
            "1.stl: the binary STL is truncated: it holds 12345 of 1234567 triangles",
            "1.stl: tệp STL nhị phân bị cắt cụt: chỉ có 12\u{202f}345 trong số 1\u{202f}234\u{202f}567 tam giác",
        ),
    ]);
}

#[test]
fn one_or_several_boxes_are_explained() {
    assert_translated(&[
        (
            "b.json: 1 box repeats another and was left out: box 3 \"c\" as box 1",
            "b.json: có một khung trùng với khung khác và đã bị bỏ: khung 3 \"c\" giống khung 1",
        ),
        (
            "b.json: 2 boxes repeat others and were left out: box 3 as box 1, box 4 as box 2",
            "b.json: có 2 khung trùng với khung khác và đã bị bỏ: khung 3 giống khung 1, khung 4 giống khung 2",
        ),
        (
            "b.json: 2 of 5 boxes lie outside the page and were left out: box 2, box 4",
            "b.json: 2 trong 5 khung nằm ngoài trang in và đã bị bỏ: khung 2, khung 4",
        ),
        (
            "the boxes: 1 of 3 boxes lies outside the page: box 3; nothing was saved",
            "các khung chữ: 1 trong 3 khung nằm ngoài trang in: khung 3; chưa lưu gì",
        ),
        (
            "b.json: the labels are for an image of 100 x 50 px, the page is 200 x 100 px; the boxes were scaled",
            "b.json: nhãn là của hình 100 x 50 px, trang in có 200 x 100 px; các khung đã được co giãn theo trang in",
        ),
        (
            "the boxes: 1 box reaches over an edge of the page: box 3; nothing was saved",
            "các khung chữ: có một khung vượt ra ngoài mép trang in: khung 3; chưa lưu gì",
        ),
        ("box 1.ply is not there", "không có tệp box 1.ply"),
    ]);
}

#[test]
fn lists_of_spreadsheets_are_explained() {
    assert_translated(&[
        (
            "cell B2 of column \"page\" has a line break; write it on one line",
            "ô B2 của cột \"page\" có ngắt dòng; hãy viết trên một dòng",
        ),
        (
            "id \"a b\" has a line break; write it on one line",
            "mã \"a b\" có ngắt dòng; hãy viết trên một dòng",
        ),
        (
            "a.csv: line 2: mesh a b of 1 does not exist; its path has a line break: write the cell on one line",
            "a.csv: dòng 2: không có bản quét a b của 1; đường dẫn có ngắt dòng: hãy viết ô đó trên một dòng",
        ),
        (
            "column \"units\" is kept as metadata; rename it to \"unit\" if it is meant, and import again",
            "cột \"units\" được giữ làm thông tin thêm; nếu đó là cột \"unit\" thì hãy đổi tên rồi nhập lại",
        ),
        (
            "line 2: column mesh has the error #REF! of a formula; correct it in the spreadsheet program, or clear the cell",
            "dòng 2: cột mesh có lỗi công thức #REF!; hãy sửa trong chương trình bảng tính, hoặc xóa nội dung ô",
        ),
        (
            "an error of a formula is left out, #N/A in column \"year\" on line 2; correct it in the spreadsheet program, and import again",
            "một lỗi công thức bị bỏ qua: #N/A ở cột \"year\", dòng 2; hãy sửa trong chương trình bảng tính rồi nhập lại",
        ),
        (
            "x.csv: this is read as a list of blocks, because it has the column page and no column print; column \"id\" is kept as metadata",
            "x.csv: tệp này được đọc là danh sách ván, vì có cột trang in và không có cột print; cột \"id\" được giữ làm thông tin thêm",
        ),
        (
            "6 values are hidden below merged cells and are left out, the first in cell B1; unmerge the cells to see them",
            "6 giá trị bị che dưới các ô gộp nên bị bỏ qua, giá trị đầu tiên ở ô B1; hãy bỏ gộp các ô để thấy các giá trị đó",
        ),
    ]);
}

#[test]
fn values_that_an_import_empties_are_explained() {
    assert_translated(&[
        (
            "1 known block loses its unit, empty or missing in this import: b2; if that was not meant, import again with these values",
            "1 ván đã có trong dự án bị mất giá trị ở cột unit vì cột này trống hoặc không có trong lần nhập này: b2; nếu không chủ ý thì hãy nhập lại với các giá trị này",
        ),
        (
            "2 known pairs lose their other metadata, empty or missing in this import, first a1",
            "2 cặp đã có trong dự án bị mất giá trị ở cột khác vì cột này trống hoặc không có trong lần nhập này, cặp đầu tiên là a1",
        ),
        (
            "12 known pairs lose their character, empty or missing in this import, first a1; if that was not meant, import again with these values",
            "12 cặp đã có trong dự án bị mất giá trị ở cột character vì cột này trống hoặc không có trong lần nhập này, cặp đầu tiên là a1; nếu không chủ ý thì hãy nhập lại với các giá trị này",
        ),
    ]);
}

#[test]
fn moved_inputs_are_explained() {
    let english = "4 of 4 input files that were looked at are missing or have moved (pairs or blocks: 2), and so is the \
                   folder q/data; put them back, or import them from their new place";
    let expected = "4 trong số 4 tệp đầu vào đã kiểm tra bị thiếu hoặc đã chuyển chỗ (số cặp hoặc ván: 2), và cả thư mục \
                    q/data; hãy đưa chúng về chỗ cũ, hoặc nhập lại từ chỗ mới";
    assert_translated(&[(english, expected)]);
}

#[test]
fn ids_that_a_spreadsheet_changed_are_explained() {
    let english = "3 ids look like dates or powers of ten, such as \"1-Nov\" (lines 2, 4, 5): a spreadsheet program may \
                   have made them of texts such as 1-11 and 1E5; give the column the format Text, correct its cells and \
                   save the list again, best as XLSX";
    let expected = "3 mã trông như ngày tháng hoặc lũy thừa của mười, chẳng hạn \"1-Nov\" (dòng 2, 4, 5): có thể chương \
                    trình bảng tính đã đổi chúng từ các văn bản như 1-11 và 1E5; hãy đặt định dạng Văn bản cho cột, sửa \
                    lại các ô của cột rồi lưu lại danh sách, tốt nhất là XLSX";
    assert_translated(&[(english, expected)]);
}

#[test]
fn doubts_about_a_scan_are_explained() {
    assert_translated(&[
        (
            "with the unit mm, its carved surface is 0.50 mm across, but most characters have 6 to 30 mm; is the unit in?",
            "với đơn vị mm, mặt khắc rộng 0,50 mm, trong khi đa số chữ có 6 đến 30 mm; đơn vị có phải là in không?",
        ),
        (
            "scanned_face_down says that the carved face points towards -z, but carving was found towards +z",
            "theo scanned_face_down, mặt khắc hướng về -z, nhưng nét khắc được tìm thấy ở phía +z",
        ),
        (
            "faces with fewer than three corners were left out: 12",
            "số mặt có ít hơn ba góc đã bị bỏ: 12",
        ),
    ]);
}

#[test]
fn colour_profiles_that_cannot_be_applied_are_explained() {
    for (profile, expected) in [
        ("Coated, for CMYK colours", "Coated, dành cho màu CMYK"),
        ("Old, of a scanner", "Old, of a scanner"),
        (
            "an ICC profile that cannot be read",
            "hồ sơ ICC không đọc được",
        ),
    ] {
        let expected = format!(
            "a.png: không áp dụng được hồ sơ màu của hình ({expected}) nên màu được đọc theo sRGB; nếu màu trông không đúng, \
             hãy chuyển hình sang sRGB"
        );
        let said = format!("a.png: {}", profile_warning(profile));
        assert_eq!(vietnamese(&said), Some(expected));
    }
}

#[test]
fn an_export_of_nothing_is_explained() {
    assert_translated(&[
        (
            "no result is selected: 12 without a verdict, 3 below confidence 0.5; nothing was written to out",
            "không có kết quả nào được chọn: 12 chưa có đánh giá, 3 có độ tin cậy dưới 0,5; chưa ghi gì vào out",
        ),
        (
            "none of the chosen pairs has a result to export: 1 without a result",
            "không có cặp nào đã chọn có kết quả để xuất: 1 chưa có kết quả",
        ),
    ]);
}

#[test]
fn reasons_and_paths_of_messages_are_translated() {
    assert_translated(&[
        (
            "there is no directory data/scans",
            "không có thư mục data/scans",
        ),
        ("there is no file a/b.csv", "không có tệp a/b.csv"),
        (
            "a.csv: line 2: mesh c.stl of 1 does not exist; there is m/c.STL",
            "a.csv: dòng 2: không có bản quét c.stl của 1; có tệp m/c.STL",
        ),
        (
            "a.csv: line 2: mesh 7.stl of 1 does not exist; there is 007.stl, 07.stl, 7.ply and 2 more",
            "a.csv: dòng 2: không có bản quét 7.stl của 1; có tệp 007.stl, 07.stl, 7.ply và 2 mục khác",
        ),
        (
            "a.xlsx: the workbook is damaged: xl/workbook.xml ends early; save it again",
            "a.xlsx: bảng tính bị hỏng: xl/workbook.xml kết thúc sớm; hãy lưu lại",
        ),
        (
            "a.xlsx: the workbook is damaged: new words; save it again",
            "a.xlsx: bảng tính bị hỏng: new words; hãy lưu lại",
        ),
    ]);
}

#[test]
fn no_row_is_hidden_by_an_earlier_one() {
    for row in TABLES.into_iter().flatten() {
        for part in ["7", "a/b"] {
            let message = row.0.replace("{}", part);
            let mut rows = TABLES.into_iter().flatten();
            let first = rows.find(|(english, _)| parts_of(&message, english).is_some());
            assert_eq!(first, Some(row), "{message:?}");
        }
    }
}

/// Parts of messages that the program joins with the words beside them, so that no source has both.
const COMPOSED: [&str; 41] = [
    "half of the print only: is the sheet folded, torn or covered there?",
    "has no large flat part",
    "which is the size of a single character",
    "no result is selected",
    "none of the chosen pairs has a result to export",
    "cannot be applied, so its colours are read as sRGB",
    "in the list, and import it again",
    "input files that were looked at are missing or have moved",
    "has a value that this program did not store",
    "repeat others",
    "smaller than a pixel, a point or a line",
    "lies outside the page",
    "lie outside the page",
    "reaches over an edge of the page",
    "reach over an edge of the page",
    "it seems to be",
    "the file has no boxes",
    "the labelled image was turned, perhaps by its EXIF orientation",
    "as two corners, their numbers fit the page",
    "are they corners where this format has width and height",
    "a number of segmentation",
    "a number of bbox",
    "a value of all_points_x",
    "a value of all_points_y",
    "left out, whose image_id is that of no image",
    "regions are",
    "a line has a class and at least 4 more",
    "a date",
    "a power of ten",
    "element is not divided as others are",
    "elements are nested",
    "an element ends that did not begin",
    "is unknown",
    "is given twice",
    "are paired by stem",
    "rename one of the",
    "of the block shows no face",
    "the page image shows no ink",
    "is missing",
    ", and import it again",
    "there is no verdict",
];

/// Returns the sources of all crates and tests as one text, without the translated messages and their tests.
fn sources() -> String {
    let folders = [crates(), crates().join("../tests/it")];
    let files = folders.into_iter().flat_map(|folder| files(folder, "rs"));
    // The tables and their tests have every message, even one that the program does not say any more.
    let is_of_tables = |path: &Path| {
        let mut folders = path.ancestors();
        folders.any(|folder| folder.ends_with("pages/src/messages"))
    };
    let others = files.filter(|path| !is_of_tables(path));
    let all: String = others
        .map(|path| std::fs::read_to_string(path).expect("a source"))
        .collect();
    joined(&all).replace("\\\"", "\"")
}

#[test]
fn the_program_still_says_what_is_translated() {
    let sources = sources();
    // The parser of JSON is another program.
    let own = TABLES.into_iter().flatten().chain(OPEN_ENDED);
    let own = own.filter(|row| !FOREIGN_MESSAGES.contains(row));
    for (english, vietnamese) in own {
        let pieces = english.split("{}");
        let pieces = pieces.map(|piece| piece.trim().trim_end_matches(':'));
        let longest = pieces.max_by_key(|piece| piece.len()).expect("a piece");
        let mut composed = COMPOSED.into_iter();
        let said = composed.find(|part| longest.contains(*part));
        let said = said.unwrap_or(longest);
        assert!(sources.contains(said), "{english:?}: {said:?}");
        let count = english.matches("{}").count();
        for index in count..10 {
            for part in [
                format!("{{{index}}}"),
                format!("{{{index}#}}"),
                format!("{{!{index}}}"),
            ] {
                assert!(!vietnamese.contains(&part), "{vietnamese:?}");
            }
        }
    }
}
