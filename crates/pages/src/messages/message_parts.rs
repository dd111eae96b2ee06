//! The parts of messages that vary, and the places that stand before them, in Vietnamese.

use super::left_out_words::left_out_reasons;
use super::message_numbers::number_text;
use super::message_patterns::{day_first, filled_by, parts_of};
use super::stage_words::stage_text;
use super::system_messages::SYSTEM_MESSAGES;
use crate::digit_groups::grouped;

/// Places before a message with their Vietnamese texts. What stands for `{}` is a number, a list of lines, one word or a
/// quoted name.
const PLACES: &[(&str, &str)] = &[
    ("line {}", "dòng {0}"),
    ("line {} column {}", "dòng {0} cột {1}"),
    ("lines {}", "các dòng {0}"),
    ("box {}", "khung {0}"),
    ("image {}", "hình {0}"),
    ("annotation {}", "chú thích {0}"),
    ("the name of box {}", "tên của khung {0}"),
    ("the coordinates", "tọa độ"),
    ("the coordinates of {} {}", "tọa độ của {0} {1}"),
    ("the element {}", "phần tử {0}"),
    ("the image of the page", "hình của trang in"),
    ("face failed", "bước tìm mặt khắc bị lỗi"),
    ("align failed", "bước căn chỉnh với trang in bị lỗi"),
    ("boxes failed", "bước tìm vị trí các chữ bị lỗi"),
    ("cut failed", "bước cắt thành các cặp bị lỗi"),
];

/// Kinds of files as messages name them, by the last words of the English name.
const KINDS: [(&str, &str); 8] = [
    (" image", "hình "),
    (" mesh", "lưới "),
    (" scene", "cảnh 3D "),
    (" model", "mô hình "),
    (" point cloud", "đám mây điểm "),
    (" document", "tài liệu "),
    (" archive", "tệp nén "),
    (" database", "cơ sở dữ liệu "),
];

/// Other parts with their Vietnamese texts.
const PARTS: &[(&str, &str)] = &[
    ("text", "văn bản"),
    ("a string", "văn bản"),
    ("triangles", "tam giác"),
    ("vertices", "đỉnh"),
    ("a list", "danh sách"),
    ("an object", "một đối tượng"),
    ("a mesh", "bản quét"),
    ("a directory", "thư mục"),
    ("an archive", "tệp nén"),
    ("a binary workbook (XLSB)", "bảng tính nhị phân (XLSB)"),
    (
        "a sheet or text of OpenDocument",
        "bảng hoặc văn bản OpenDocument",
    ),
    ("a text document", "tài liệu văn bản"),
    ("the table", "bảng"),
    ("text in another encoding", "văn bản dùng bảng mã khác"),
    ("UTF-16 text", "văn bản UTF-16"),
    ("XML or HTML text", "văn bản XML hoặc HTML"),
    (
        "binary data of unknown kind",
        "dữ liệu nhị phân không rõ loại",
    ),
    ("a pointer of Git LFS", "con trỏ của Git LFS"),
    (
        "an ICC profile that cannot be read",
        "hồ sơ ICC không đọc được",
    ),
    ("without a name", "không có tên"),
    ("TIFF transfer function", "hàm truyền của TIFF"),
    ("id or print", "id hoặc print"),
    ("other metadata", "khác"),
    (
        "MeshLab, Blender or CloudCompare",
        "MeshLab, Blender hoặc CloudCompare",
    ),
];

/// Returns a pattern with `{0}` replaced by the first part, and so on. `{0#}` is the same for a number, which is written as in
/// Vietnamese: other parts may be ids, names of files and values of settings, which stay. `{!0}` is for a message of its own, which
/// `message` translates, or the name of a stage. Braces in a part stay as they are.
pub(super) fn filled(
    pattern: &str,
    parts: &[&str],
    message: impl Fn(&str) -> Option<String>,
) -> String {
    filled_by(pattern, |place| {
        let (number, inner) = (place.strip_suffix('#'), place.strip_prefix('!'));
        let index = number.or(inner).unwrap_or(place).parse::<usize>().ok()?;
        let part = parts.get(index)?;
        let number = number.and_then(|_| number_text(part));
        let stage = || stage_text(part).map(str::to_owned);
        let known = inner.and_then(|_| message(part).or_else(stage));
        Some(known.or(number).unwrap_or_else(|| part_text(part)))
    })
}

/// Returns a place before a message, such as a line or a list of files, in Vietnamese. `None` if it is something else.
pub(super) fn place_text(place: &str) -> Option<String> {
    let of_row = PLACES.iter().find_map(|(english, vietnamese)| {
        let parts = parts_of(place, english)?;
        let are_short = parts.iter().all(|part| is_of_place(part));
        are_short.then(|| filled(vietnamese, &parts, |_| None))
    });
    of_row.or_else(|| with_more(place, "mục khác"))
}

/// Returns whether a text can be a part of a place. `1.ply` cannot, because `box 1.ply` is the name of a file.
fn is_of_place(part: &str) -> bool {
    let is_of_lines = |word: &str| {
        let mut bytes = word.bytes();
        word == "and" || bytes.all(|byte| byte.is_ascii_digit() || b",-".contains(&byte))
    };
    let mut words = part.strip_suffix(" more").unwrap_or(part).split(' ');
    part.starts_with('"')
        || words.all(is_of_lines)
        || part.bytes().all(|byte| byte.is_ascii_alphabetic())
}

/// Returns a part of a message: kinds of files and values by their Vietnamese names, and all else as it is.
fn part_text(part: &str) -> String {
    let mut known = PARTS.iter().chain(SYSTEM_MESSAGES);
    if let Some((_, vietnamese)) = known.find(|(english, _)| *english == part) {
        return (*vietnamese).to_owned();
    }
    // A day without a time may be the id of a pair.
    if let Some(time) = day_first(part).filter(|_| part.contains(' ')) {
        return time;
    }
    let number = part.strip_prefix("a list of ");
    if let Some(number) = number.and_then(number_text) {
        return format!("danh sách {number} phần tử");
    }
    // All formats of labels.
    if part.starts_with("VIA (JSON or CSV)") {
        return part.replace(" or ", " hoặc ");
    }
    let keys = part.strip_prefix("the keys ");
    if let Some(keys) = keys.filter(|keys| keys.starts_with('"')) {
        return format!("các khóa {}", names_text(keys));
    }
    let listed = kind_text(part).or_else(|| left_out_reasons(part));
    listed.unwrap_or_else(|| names_text(part))
}

/// Returns a kind of files, such as `a GIF image`, in Vietnamese. `None` if it is something else.
fn kind_text(part: &str) -> Option<String> {
    let name = part
        .strip_prefix("a ")
        .or_else(|| part.strip_prefix("an "))?;
    let mut kinds = KINDS.iter();
    kinds.find_map(|(end, vietnamese)| {
        let name = name.strip_suffix(end)?;
        Some(format!("{vietnamese}{name}"))
    })
}

/// Returns a list of names or boxes in Vietnamese, which may end in words such as `and 3 more`.
fn names_text(list: &str) -> String {
    let (names, more) = match split_more(list) {
        Some((names, count)) => (names, format!(" và {} mục khác", grouped(count))),
        None => (list, String::new()),
    };
    let pages = names.split(", ").map(|page| match page {
        "a page without name" => "trang không có tên",
        page => page,
    });
    let shown = boxes_text(names).unwrap_or_else(|| pages.collect::<Vec<_>>().join(", "));
    shown + &more
}

/// Returns the names of a list that ends in words such as `and 3 more`, and the number of the others.
fn split_more(list: &str) -> Option<(&str, u64)> {
    let (names, count) = list.strip_suffix(" more")?.rsplit_once(" and ")?;
    Some((names, count.parse().ok()?))
}

/// Returns a list that ends in words such as `and 3 more` in Vietnamese, where `others` names the rest. `None` if it
/// does not end like this.
pub(crate) fn with_more(list: &str, others: &str) -> Option<String> {
    let (names, count) = split_more(list)?;
    Some(format!("{names} và {} {others}", grouped(count)))
}

/// Returns a list of boxes of labels, such as `box 3 "c" as box 1` or `Word box 2`, in Vietnamese. `None` if it is something
/// else.
fn boxes_text(list: &str) -> Option<String> {
    let one = |text: &str| {
        let (level, shown) = match text.strip_prefix("box ") {
            Some(shown) => ("", shown),
            None => text.split_once(" box ")?,
        };
        let (number, name) = shown.split_once(' ').unwrap_or((shown, ""));
        let is_level = level.bytes().all(|byte| byte.is_ascii_alphabetic());
        let is_box = number.parse::<u64>().is_ok() && (name.is_empty() || name.starts_with('"'));
        let space = if level.is_empty() { "" } else { " " };
        (is_level && is_box).then(|| format!("{level}{space}khung {shown}"))
    };
    let each = list.split(", ").map(|item| match item.split_once(" as ") {
        Some((repeat, first)) => Some(format!("{} giống {}", one(repeat)?, one(first)?)),
        None => one(item),
    });
    Some(each.collect::<Option<Vec<String>>>()?.join(", "))
}
