//! Parts of sentences about labels.

use mocban_core::domain::{first_names, sanitize};

/// Maximum number of characters of a text from a file that a message shows.
const MAX_SHOWN: usize = 60;
/// Maximum number of boxes or pages that a message names.
const MAX_NAMED: usize = 8;

/// Returns a text from a file in quotation marks, cut and without hidden characters.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", sanitize(text, MAX_SHOWN))
}

/// Joins names with commas. Names after the first few are only counted.
pub(super) fn list(names: &[String]) -> String {
    first_names(names, MAX_NAMED)
}

/// Returns the line, from 1, of the byte at a position in a text.
pub(super) fn line_at(text: &str, at: usize) -> usize {
    let head = text.as_bytes().get(..at).unwrap_or(text.as_bytes());
    // The part behind the last line break is a line, too.
    head.split(|byte| *byte == b'\n').count()
}

/// Returns a number of boxes as text.
pub(super) fn boxes(count: usize) -> String {
    match count {
        1 => "1 box".to_owned(),
        _ => format!("{count} boxes"),
    }
}

/// Returns the singular or the plural of a verb or noun for a number of boxes.
pub(super) const fn for_count(
    count: usize,
    singular: &'static str,
    plural: &'static str,
) -> &'static str {
    if count == 1 { singular } else { plural }
}
