//! Names of columns: which are similar, which are missing, and how messages show them.

use crate::columns::{KnownColumns, plain_name};
use mocban_core::domain::sanitize;
use mocban_core::domain::spelling::{composed, quoted};

/// Longest name of a column in a message, in characters.
const MAX_NAME_CHARS: usize = 60;

/// Returns the name of a column as written, as a message shows it.
pub(super) fn shown_column(written: &str) -> String {
    quoted(&sanitize(written, MAX_NAME_CHARS))
}

/// Returns whether a name may be a misspelt or abbreviated name of a column: in short names one letter may be wrong,
/// missing or swapped with the next, in longer names two.
pub(super) fn similar_column(found: &str, name: &str) -> bool {
    let max_wrong = match name.len() {
        // Any word of two letters, such as the Vietnamese `in` (print), is similar to `id`.
        ..=2 if found.len() <= 2 => 0,
        ..=5 => 1,
        _ => 2,
    };
    let found = composed(found).replace(['_', '-'], " ");
    OTHER_NAMES.contains(&(found.as_str(), name))
        || strsim::osa_distance(&found, &name.replace('_', " ")) <= max_wrong
}

/// Returns whether a name may be a misspelt one of the other names of a column, such as `Ảnh inn`. Short names are left out,
/// because too many words are similar to them.
fn is_near_other_name(found: &str, name: &str, known: &KnownColumns) -> bool {
    let plain = plain_name(found);
    known.other_names.iter().any(|(other, of)| {
        let max_wrong = match other.len() {
            0..=4 => return false,
            5..=8 => 1,
            _ => 2,
        };
        *of == name
            && plain.len().abs_diff(other.len()) <= max_wrong
            && strsim::osa_distance(&plain, other) <= max_wrong
    })
}

/// Other words for the columns, in English and Vietnamese, in lower case.
const OTHER_NAMES: [(&str, &str); 34] = [
    ("name", "id"),
    ("no", "id"),
    ("no.", "id"),
    ("number", "id"),
    ("mã", "id"),
    ("tên", "id"),
    ("scan", "mesh"),
    ("mesh file", "mesh"),
    ("scan file", "mesh"),
    ("model", "mesh"),
    ("stl", "mesh"),
    ("lưới", "mesh"),
    ("bản quét", "mesh"),
    ("quét", "mesh"),
    ("image", "print"),
    ("print file", "print"),
    ("image file", "print"),
    ("rubbing", "print"),
    ("bản in", "print"),
    ("ảnh", "print"),
    ("hình", "print"),
    ("in", "print"),
    ("char", "character"),
    ("character name", "character"),
    ("chữ", "character"),
    ("ký tự", "character"),
    ("blk", "block"),
    ("block id", "block"),
    ("block name", "block"),
    ("ván", "block"),
    ("mộc bản", "block"),
    ("đơn vị", "unit"),
    ("face down", "scanned_face_down"),
    ("facedown", "scanned_face_down"),
];

/// Largest number of columns that are shown and compared.
const MAX_SHOWN: usize = 12;
/// Largest number of characters that are shown of a header without separators.
const MAX_SHOWN_CHARS: usize = 100;

/// Describes a missing one of the known columns of a header. Suggests a column that is not known and has a similar name.
pub(super) fn missing_column(
    name: &str,
    known_columns: &KnownColumns,
    header: &[&str],
    columns: &[Option<&'static str>],
) -> String {
    let found = &header[..header.len().min(MAX_SHOWN)];
    let shown = composed(&found.join(", ")).into_owned();
    let unknown = found
        .iter()
        .zip(columns)
        .filter(|(_, known)| known.is_none());
    if let [alone] = header
        && columns == [None]
    {
        let shown: String = composed(alone).chars().take(MAX_SHOWN_CHARS).collect();
        let hint = if alone.contains(['|', ',', ';', '\t', ':']) {
            "; put a comma, semicolon or tab between columns"
        } else {
            ""
        };
        return format!(
            "column {name:?} is missing; the header has one column only, {shown}{hint}"
        );
    }
    let mut similar = unknown.filter(|(field, _)| {
        similar_column(&field.to_lowercase(), name)
            || is_near_other_name(field, name, known_columns)
    });
    let hint = similar
        .next()
        .map(|(field, _)| format!("; rename {} to {name:?} if it is meant", quoted(field)));
    format!(
        "column {name:?} is missing{}; the header has: {shown}",
        hint.unwrap_or_default()
    )
}
