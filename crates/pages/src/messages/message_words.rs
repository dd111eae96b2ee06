//! Frequent messages of the program in Vietnamese. They are stored or refuse something in English, so they are recognised
//! by their wording.

use super::block_messages::BLOCK_MESSAGES;
use super::block_refusals::BLOCK_REFUSALS;
use super::foreign_messages::FOREIGN_MESSAGES;
use super::form_messages::FORM_MESSAGES;
use super::held_messages::HELD_MESSAGES;
use super::import_messages::IMPORT_MESSAGES;
use super::label_messages::LABEL_MESSAGES;
use super::list_messages::LIST_MESSAGES;
use super::message_parts::{filled, place_text};
use super::message_patterns::parts_of;
use super::message_table::MESSAGES;
use super::pair_refusals::PAIR_REFUSALS;
use super::parser_messages::PARSER_MESSAGES;
use super::review_messages::REVIEW_MESSAGES;
use super::system_messages::{SYSTEM_MESSAGES, with_known_reasons};

/// A message with its Vietnamese text.
type MessageRow = (&'static str, &'static str);

/// The tables of messages. A row of an earlier one is preferred.
const TABLES: [&[MessageRow]; 12] = [
    MESSAGES,
    BLOCK_MESSAGES,
    LIST_MESSAGES,
    LABEL_MESSAGES,
    PARSER_MESSAGES,
    REVIEW_MESSAGES,
    IMPORT_MESSAGES,
    HELD_MESSAGES,
    FOREIGN_MESSAGES,
    PAIR_REFUSALS,
    BLOCK_REFUSALS,
    FORM_MESSAGES,
];

/// Messages that end with a reason that no table has.
const OPEN_ENDED: &[MessageRow] = &[
    (
        "cannot read settings from {}: {}",
        "không đọc được thiết lập từ {0}: {!1}",
    ),
    (
        "cannot read the temporary file of the list: {}",
        "không đọc được tệp tạm của danh sách: {!0}",
    ),
    ("cannot read {}: {}", "không đọc được {0}: {!1}"),
    ("cannot list {}: {}", "không liệt kê được {0}: {!1}"),
    (
        "cannot write {}, because the folder {} cannot be created: {}",
        "không ghi được {0} vì không tạo được thư mục {1}: {!2}",
    ),
    (
        "cannot write a temporary file for the list: {}",
        "không ghi được tệp tạm cho danh sách: {!0}",
    ),
    (
        "cannot write the backup {}: {}",
        "không ghi được bản sao lưu {0}: {!1}",
    ),
    ("cannot write to {}: {}", "không ghi được vào {0}: {!1}"),
    ("cannot write {}: {}", "không ghi được {0}: {!1}"),
    (
        "cannot copy {} to {}: {}",
        "không chép được {0} vào {1}: {!2}",
    ),
    (
        "cannot restore {} to {}: {}",
        "không khôi phục được {0} vào {1}: {!2}",
    ),
    (
        "the backup {} is complete, but not its scans and prints: {}",
        "bản sao lưu {0} đã xong, nhưng các bản quét và bản in thì chưa: {!1}",
    ),
    (
        "{} is complete, but the disk did not confirm its name: {}",
        "{0} đã ghi xong, nhưng ổ đĩa chưa xác nhận tên: {!1}",
    ),
    ("drawing stopped: {}", "việc vẽ bị dừng: {0}"),
    (
        "the stored heights of the face: {}",
        "độ cao đã lưu của mặt khắc: {0}",
    ),
];

/// Returns a message of the program in Vietnamese if its beginning is known. Parts that are not known stay as they are, without
/// the numbers of the system's errors.
pub(crate) fn vietnamese(text: &str) -> Option<String> {
    let text = with_known_reasons(text);
    let mut lines = text.lines();
    let first = line(lines.next()?)?;
    let rest = lines.map(|one| line(one).unwrap_or_else(|| one.to_owned()));
    let all: Vec<String> = std::iter::once(first).chain(rest).collect();
    Some(all.join("\n"))
}

fn line(text: &str) -> Option<String> {
    let inner = text.trim_start();
    let indent = &text[..text.len() - inner.len()];
    if let Some(whole) = clause(inner) {
        return Some(format!("{indent}{whole}"));
    }
    let mut clauses = inner.split("; ");
    let first = clause(clauses.next()?)?;
    let rest = clauses.map(|one| clause(one).unwrap_or_else(|| one.to_owned()));
    let all: Vec<String> = std::iter::once(first).chain(rest).collect();
    Some(format!("{indent}{}", all.join("; ")))
}

/// Returns a clause in Vietnamese, which may follow the path of a file, the name of a layer of settings, a line or another
/// clause.
fn clause(text: &str) -> Option<String> {
    clause_among(text, &TABLES)
        .or_else(|| clause_before_line(text))
        .or_else(|| clause_among(text, &[OPEN_ENDED]))
        .or_else(|| clause_among(text, &[SYSTEM_MESSAGES]))
}

/// Returns a clause of a parser in Vietnamese, which ends with the line, and perhaps the column, of the fault.
fn clause_before_line(text: &str) -> Option<String> {
    let (message, place) = text.rsplit_once(" at ")?;
    if !place.starts_with("line ") {
        return None;
    }
    let place = place_text(place)?;
    clause_among(message, &TABLES).map(|known| format!("{known}, {place}"))
}

fn clause_among(text: &str, tables: &[&[MessageRow]]) -> Option<String> {
    let starts = text.match_indices(": ").map(|(at, colon)| at + colon.len());
    let mut starts = std::iter::once(0).chain(starts);
    starts.find_map(|start| {
        let (before, message) = text.split_at(start);
        // A clause before this one or within a part would stay in English.
        if before.contains("; ") {
            return None;
        }
        let mut rows = tables.iter().copied().flatten();
        let found = rows.find_map(|(english, vietnamese)| {
            let parts = parts_of(message, english)?;
            let is_clean = parts.iter().all(|part| !part.contains("; "));
            // The first part of these may begin behind a colon, but not before it.
            let begins_here = !english.starts_with("{} ") || !parts[0].contains(": ");
            (is_clean && begins_here).then(|| filled(vietnamese, &parts, clause))
        })?;
        Some(match before.strip_suffix(": ") {
            Some(before) => format!("{}: {found}", before_text(before)),
            None => found,
        })
    })
}

/// Returns what stands before a message: clauses and places in Vietnamese, and all else as it is.
fn before_text(before: &str) -> String {
    let parts = before.split(": ").map(|part| {
        let known = clause(part).or_else(|| place_text(part));
        let known = known.or_else(|| beginning(part));
        known.unwrap_or_else(|| part.to_owned())
    });
    clause(before).unwrap_or_else(|| parts.collect::<Vec<_>>().join(": "))
}

/// Returns what failed, without the reason behind it, in Vietnamese.
fn beginning(text: &str) -> Option<String> {
    OPEN_ENDED.iter().find_map(|(english, vietnamese)| {
        let parts = parts_of(text, english.strip_suffix(": {}")?)?;
        let (vietnamese, _reason) = vietnamese.rsplit_once(": ")?;
        Some(filled(vietnamese, &parts, clause))
    })
}

#[cfg(test)]
mod fragments;
#[cfg(test)]
mod number_tests;
#[cfg(test)]
mod refusal_tests;
#[cfg(test)]
mod source_sentences;
#[cfg(test)]
mod system_tests;
#[cfg(test)]
mod tests;
