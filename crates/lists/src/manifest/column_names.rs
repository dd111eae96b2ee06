//! Missing columns, and which names are similar.

use unicode_normalization::UnicodeNormalization as _;

/// Returns whether a name may be a misspelt or abbreviated name of a column: in short names one letter may be wrong,
/// missing or swapped with the next, in longer names two.
pub(super) fn similar_column(found: &str, name: &str) -> bool {
    let max_wrong = match name.len() {
        // Any word of two letters, such as the Vietnamese `in` (print), is similar to `id`.
        ..=2 if found.len() <= 2 => 0,
        ..=5 => 1,
        _ => 2,
    };
    let found: String = found.nfc().collect();
    OTHER_NAMES.contains(&(found.as_str(), name)) || strsim::osa_distance(&found, name) <= max_wrong
}

/// Other words for the columns, in English and Vietnamese, in lower case.
const OTHER_NAMES: [(&str, &str); 22] = [
    ("name", "id"),
    ("mã", "id"),
    ("tên", "id"),
    ("scan", "mesh"),
    ("model", "mesh"),
    ("stl", "mesh"),
    ("lưới", "mesh"),
    ("bản quét", "mesh"),
    ("quét", "mesh"),
    ("image", "print"),
    ("rubbing", "print"),
    ("bản in", "print"),
    ("ảnh", "print"),
    ("hình", "print"),
    ("in", "print"),
    ("char", "character"),
    ("chữ", "character"),
    ("ký tự", "character"),
    ("blk", "block"),
    ("ván", "block"),
    ("mộc bản", "block"),
    ("đơn vị", "unit"),
];

/// Describes a missing column. Suggests an unknown column with a similar name.
pub(super) fn missing_column(
    name: &str,
    record: &::csv::ByteRecord,
    is_known: impl Fn(&str) -> bool,
) -> String {
    let found: Vec<_> = record
        .iter()
        .take(12)
        .map(|field| String::from_utf8_lossy(field))
        .collect();
    let shown = found.join(", ");
    let is_similar = |field: &&std::borrow::Cow<'_, str>| {
        let field = field.trim().to_lowercase();
        !is_known(&field) && similar_column(&field, name)
    };
    let hint = found.iter().find(is_similar).map(|field| {
        let field = field.trim();
        format!("; rename {field:?} to {name:?} if it is meant")
    });
    format!(
        "column {name:?} is missing{}; the header has: {shown}",
        hint.unwrap_or_default()
    )
}
