//! Frequent messages of the program in Vietnamese. They are stored or refuse something in English, so they are recognised
//! by their wording.

use super::block_messages::BLOCK_MESSAGES;
use super::left_out_words::left_out_reasons;
use super::list_messages::LIST_MESSAGES;
use super::message_table::{KINDS, MESSAGES};

/// Returns the messages with their Vietnamese texts. An earlier one is preferred.
fn all_messages() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    let others = BLOCK_MESSAGES.iter().chain(LIST_MESSAGES);
    MESSAGES.iter().chain(others)
}

/// Returns a message of the program in Vietnamese if its beginning is known. Parts that are not known stay as they are.
pub(crate) fn vietnamese(text: &str) -> Option<String> {
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

/// Returns a clause in Vietnamese, which may follow the path of a file, the name of a layer of settings or another clause.
fn clause(text: &str) -> Option<String> {
    let starts = text.match_indices(": ").map(|(at, colon)| at + colon.len());
    let mut starts = std::iter::once(0).chain(starts);
    starts.find_map(|start| {
        let (before, message) = text.split_at(start);
        // A clause before this one or within a part would stay in English.
        if before.contains("; ") {
            return None;
        }
        let found = all_messages().find_map(|(english, vietnamese)| {
            let parts = parts_of(message, english)?;
            let is_clean = parts.iter().all(|part| !part.contains("; "));
            // The first part of these may begin behind a colon, but not before it.
            let begins_here = !english.starts_with("{} ") || !parts[0].contains(": ");
            (is_clean && begins_here).then(|| filled(vietnamese, &parts))
        })?;
        let known = before.strip_suffix(": ").and_then(clause);
        let before = known.map_or_else(|| before.to_owned(), |known| format!("{known}: "));
        Some(before + &found)
    })
}

/// Returns what stands in a text in place of the `{}` of a pattern, or `None` if the text does not match.
pub(super) fn parts_of<'t>(text: &'t str, pattern: &str) -> Option<Vec<&'t str>> {
    let mut pieces = pattern.split("{}");
    let mut rest = text.strip_prefix(pieces.next()?)?;
    let mut parts = Vec::new();
    let mut pieces = pieces.peekable();
    while let Some(piece) = pieces.next() {
        let is_last = pieces.peek().is_none();
        let at = if is_last {
            rest.strip_suffix(piece)?.len()
        } else {
            rest.find(piece)?
        };
        if at == 0 {
            return None;
        }
        parts.push(&rest[..at]);
        rest = &rest[at + piece.len()..];
    }
    rest.is_empty().then_some(parts)
}

/// Returns a pattern with `{0}` replaced by the first part, and so on. Braces in a part stay as they are.
fn filled(pattern: &str, parts: &[&str]) -> String {
    filled_by(pattern, |index| {
        let part = parts.get(index.parse::<usize>().ok()?)?;
        Some(part_text(part))
    })
}

/// Returns a pattern with `{0}` and so on replaced by the texts of what stands in the braces. Braces without a text stay as
/// they are.
pub(super) fn filled_by(pattern: &str, text_of: impl Fn(&str) -> Option<String>) -> String {
    let mut pieces = pattern.split('{');
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let filled = piece.split_once('}').and_then(|(index, rest)| {
            let part = text_of(index)?;
            Some([part.as_str(), rest].concat())
        });
        text += &filled.unwrap_or_else(|| format!("{{{piece}"));
    }
    text
}

/// Returns a list that ends in words such as `and 3 more` in Vietnamese, where `others` names the rest. `None` if it
/// does not end like this.
pub(crate) fn with_more(list: &str, others: &str) -> Option<String> {
    let (names, count) = list.strip_suffix(" more")?.rsplit_once(" and ")?;
    count.parse::<u64>().ok()?;
    Some(format!("{names} và {count} {others}"))
}

/// Returns a part of a message: numbers with a decimal comma, and kinds of files by their Vietnamese names.
fn part_text(part: &str) -> String {
    if part.parse::<f64>().is_ok() {
        return part.replace('.', ",");
    }
    match part {
        "text" | "a string" => return "văn bản".to_owned(),
        "a pointer of Git LFS" => return "con trỏ của Git LFS".to_owned(),
        "an ICC profile that cannot be read" => return "hồ sơ ICC không đọc được".to_owned(),
        "without a name" => return "không có tên".to_owned(),
        "MeshLab, Blender or CloudCompare" => {
            return "MeshLab, Blender hoặc CloudCompare".to_owned();
        }
        _ => {}
    }
    let listed = with_more(part, "mục khác").or_else(|| boxes_text(part));
    if let Some(listed) = listed.or_else(|| left_out_reasons(part)) {
        return listed;
    }
    let name = part.strip_prefix("a ").or_else(|| part.strip_prefix("an "));
    let kind = name.and_then(|name| {
        let mut kinds = KINDS.iter();
        kinds.find_map(|(end, vietnamese)| {
            let name = name.strip_suffix(end)?;
            Some(format!("{vietnamese}{name}"))
        })
    });
    kind.unwrap_or_else(|| part.to_owned())
}

/// Returns a list of boxes of labels, such as `box 3 "c" as box 1`, in Vietnamese. `None` if it is something else.
fn boxes_text(list: &str) -> Option<String> {
    let one = |text: &str| {
        let shown = text.strip_prefix("box ")?;
        let (number, name) = shown.split_once(' ').unwrap_or((shown, ""));
        let is_box = number.parse::<u64>().is_ok() && (name.is_empty() || name.starts_with('"'));
        is_box.then(|| format!("khung {shown}"))
    };
    let each = list.split(", ").map(|item| match item.split_once(" as ") {
        Some((repeat, first)) => Some(format!("{} giống {}", one(repeat)?, one(first)?)),
        None => one(item),
    });
    Some(each.collect::<Option<Vec<String>>>()?.join(", "))
}

#[cfg(test)]
mod tests;
