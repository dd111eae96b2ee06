//! Every refusal of a stage has a Vietnamese text.

use super::super::source_texts::{code_of, literals};
use super::tests::assert_translated;
use super::{TABLES, parts_of, vietnamese};

/// Sources with the errors that become failures of pairs and blocks, or say why ground truth is not used.
const SOURCES: [&str; 16] = [
    "align/src/block/control_start.rs",
    "align/src/block/cut.rs",
    "align/src/block/error.rs",
    "align/src/block/label_fit.rs",
    "align/src/stages/binarize/ink.rs",
    "align/src/stages/depth.rs",
    "align/src/stages/fit/params.rs",
    "align/src/stages/normalize/params.rs",
    "align/src/stages/register/params.rs",
    "core/src/mesh/arrays.rs",
    "core/src/mesh/error.rs",
    "core/src/raster/decode/error.rs",
    "lists/src/labels/error.rs",
    "results/src/ground_truth.rs",
    "store/src/artifact_error.rs",
    "store/src/input_error.rs",
];

/// Errors that are put together of parts with words, which [`refusals_that_are_put_together_are_translated`] has.
const PUT_TOGETHER: [&str; 3] = [
    "line 7: 7",
    "the file 7",
    "7 of 7 7 outside the page of 7 x 7 px: 7?",
];

/// Returns the texts of the errors in a source, as `thiserror` has them.
fn error_texts(source: &str) -> Vec<String> {
    let attributes = source.split("#[error(").skip(1).map(str::trim_start);
    let with_texts = attributes.filter(|attribute| attribute.starts_with('"'));
    with_texts
        .filter_map(|attribute| literals(attribute).into_iter().next())
        .collect()
}

/// Returns a text with a number in each place. A place behind a letter or a number may be empty, and is.
fn filled_in(text: &str) -> String {
    let (mut said, mut rest) = (String::new(), text);
    while let Some((before, place)) = rest.split_once('{') {
        said += before;
        let (_, after) = place.split_once('}').expect("the end of a place");
        if !said.ends_with(char::is_alphanumeric) {
            said.push('7');
        }
        rest = after;
    }
    said + rest
}

/// Returns whether all clauses of a message with words have a Vietnamese text.
fn is_translated(message: &str) -> bool {
    let is_row = TABLES
        .iter()
        .copied()
        .flatten()
        .any(|(english, _)| parts_of(message, english).is_some());
    let mut clauses = message.split("; ");
    let is_known =
        |clause: &str| !clause.contains(char::is_alphabetic) || vietnamese(clause).is_some();
    is_row || clauses.all(is_known)
}

#[test]
fn every_error_of_a_stage_is_translated() {
    for path in SOURCES {
        let texts = error_texts(&code_of(&[path]).concat());
        assert!(!texts.is_empty(), "{path}");
        for text in texts {
            let message = filled_in(&text);
            let is_put_together = PUT_TOGETHER.contains(&message.as_str());
            assert!(
                is_put_together || is_translated(&message),
                "{path}: {message}"
            );
        }
    }
}

#[test]
fn refusals_that_are_put_together_are_translated() {
    assert_translated(&[
        (
            "a.json: the file is a pointer of Git LFS and does not hold the labels",
            "a.json: tệp là con trỏ của Git LFS và không chứa nội dung thật",
        ),
        (
            "a.json: 3 of 5 boxes lie outside the page of 100 x 50 px: labels of another page?",
            "a.json: 3 trong 5 khung nằm ngoài trang in 100 x 50 px: có phải nhãn của trang khác không?",
        ),
        (
            "a.json: the file has no boxes for \"b.jpg\"; draw at least one",
            "a.json: tệp không có khung nào của \"b.jpg\"; hãy vẽ ít nhất một khung",
        ),
        (
            "m.ply: line 6: 2 of 3 coordinates; it is the last line, so the file seems to be cut off",
            "m.ply: dòng 6: chỉ có 2 trong 3 tọa độ; đây là dòng cuối nên tệp có vẻ bị cắt cụt",
        ),
        (
            "m.xyz: line 6: it has 4 columns, but most lines have 3; write numbers such as \"1 234\" without blanks",
            "m.xyz: dòng 6: dòng này có 4 cột, nhưng hầu hết các dòng có 3; hãy viết các số như \"1 234\" liền nhau, không có dấu cách",
        ),
        (
            "m.xyz: line 1: \"2.5\" has a point, but others have a comma; write all numbers with the same decimal mark",
            "m.xyz: dòng 1: \"2.5\" có dấu chấm, nhưng các số khác có dấu phẩy; hãy viết mọi số với cùng một dấu thập phân",
        ),
        (
            "m.xyz: line 6: it has 3 columns, but most lines have 4; it may lack the number that the others begin with",
            "m.xyz: dòng 6: dòng này có 3 cột, nhưng hầu hết các dòng có 4; có thể dòng này thiếu số thứ tự mà các dòng khác có ở đầu",
        ),
        (
            "m.ply: the PLY header is wrong: the file ends before end_header",
            "m.ply: phần đầu tệp PLY sai: tệp hết trước end_header",
        ),
        (
            "b.ply: the scan shows no carved face: its front has no large flat part; is this the scan of a whole block?",
            "b.ply: bản quét không có mặt khắc: mặt trước không có phần phẳng lớn; đây có phải bản quét của cả ván không?",
        ),
        (
            "b.png: the page image shows no ink: its darkest parts take 3 % of the light",
            "b.png: hình trang in không có mực: chỗ tối nhất chỉ hấp thụ 3 % ánh sáng",
        ),
        (
            "a.stl: no carving found: the likeliest side has a relief of 0.1 on an extent of 9.5 (mesh units), a share below \
             fit.min_relief 0.02; no other side or part resembles the print",
            "a.stl: không tìm thấy nét khắc: phía khả dĩ nhất có độ nổi 0,1 trên chiều dài 9,5 (đơn vị của bản quét), tỉ lệ thấp \
             hơn fit.min_relief 0,02; không có phía hay phần nào khác giống bản in",
        ),
    ]);
}

#[test]
fn places_behind_messages_of_parsers_are_translated() {
    assert_translated(&[
        (
            "b.json: the JSON is damaged: the key \"a\" is given twice at line 3 column 14; save the labels again",
            "b.json: tệp JSON bị hỏng: khóa \"a\" được ghi hai lần, dòng 3 cột 14; hãy lưu lại nhãn",
        ),
        (
            "b.xml: the PAGE-XML is damaged: an element ends that did not begin at line 1200; save the labels again",
            "b.xml: tệp PAGE-XML bị hỏng: có phần tử kết thúc mà không bắt đầu, dòng 1200; hãy lưu lại nhãn",
        ),
        (
            "expected value at line 3, column 14",
            "cần một giá trị, dòng 3, cột 14",
        ),
    ]);
    assert_eq!(vietnamese("new words at line 3"), None);
}

#[test]
fn files_that_cannot_be_read_or_written_are_named_with_the_reason_of_the_system() {
    assert_translated(&[
        (
            "/x/p/exports: Permission denied (os error 13)",
            "/x/p/exports: không có quyền",
        ),
        (
            "cannot write /x/p/backups/b.sqlite, because the folder /x/p/backups cannot be created: Read-only file system",
            "không ghi được /x/p/backups/b.sqlite vì không tạo được thư mục /x/p/backups: ổ đĩa chỉ đọc được",
        ),
        (
            "cannot write the backup /x/b: the file is complete, but the disk did not confirm its name: Input/output error",
            "không ghi được bản sao lưu /x/b: tệp đã ghi xong, nhưng ổ đĩa chưa xác nhận tên tệp: ổ đĩa báo lỗi",
        ),
        (
            "the backup /x/b is complete, but not its scans and prints: cannot copy 1.ply to /y/1.ply: No space left on device; \
             free some space and try again, everything stored so far is safe",
            "bản sao lưu /x/b đã xong, nhưng các bản quét và bản in thì chưa: không chép được 1.ply vào /y/1.ply: đĩa đã đầy; \
             hãy giải phóng chỗ trống rồi thử lại, mọi thứ đã lưu vẫn an toàn",
        ),
        (
            "the temporary file of the cut cannot be written or read: No space left on device",
            "không ghi hoặc đọc được tệp tạm của bước cắt: đĩa đã đầy",
        ),
        (
            "cannot read settings from p/mocban.toml: Permission denied",
            "không đọc được thiết lập từ p/mocban.toml: không có quyền",
        ),
    ]);
    assert_eq!(vietnamese("Permission denied by odd"), None);
}

#[test]
fn failures_of_a_run_are_translated() {
    assert_translated(&[
        (
            "register took longer than 600 s",
            "bước căn chỉnh với bản in mất hơn 600 giây",
        ),
        (
            "fit took longer than 600 s while it read m/a.stl; its disk or network may hang",
            "bước khớp mặt khắc mất hơn 600 giây khi đọc m/a.stl; ổ đĩa hoặc mạng có thể bị treo",
        ),
        (
            "the stage took longer than 600 s (run.stage_timeout_s)",
            "bước này mất hơn 600 giây (run.stage_timeout_s)",
        ),
        (
            "3 workers died or hung over it at depth",
            "3 tiến trình đã chết hoặc treo vì nó ở bước bản đồ độ sâu",
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
            "page.jpg: no columns of characters were found; draw boxes around the characters, for example in the VGG Image \
             Annotator, and give the file as labels",
            "page.jpg: không tìm thấy cột chữ nào; hãy vẽ khung quanh các chữ, chẳng hạn bằng VGG Image Annotator, rồi dùng tệp \
             đó làm nhãn",
        ),
    ]);
}

#[test]
fn refusals_of_edited_exports_are_translated() {
    assert_translated(&[
        (
            "/x/p/exports/excel/pairs.csv was changed after it was written, so its folder is not replaced; move the file elsewhere, or choose another folder",
            "/x/p/exports/excel/pairs.csv đã bị sửa sau khi ghi nên thư mục chứa nó không bị thay thế; hãy chuyển tệp đó sang nơi khác, hoặc chọn thư mục khác",
        ),
        (
            "/x/p/exports/excel/notes.txt is not part of an export, so its folder is not replaced; choose an empty or new folder",
            "/x/p/exports/excel/notes.txt không thuộc bản xuất nào nên thư mục chứa nó không bị thay thế; hãy chọn thư mục trống hoặc thư mục mới",
        ),
    ]);
}
