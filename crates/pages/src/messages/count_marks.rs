//! Marks around counts in sentences, so that a count is found again when the sentence is translated.
//!
//! The marks are characters for private use. A text that has such characters loses them.

/// The character before the first count of a text. Those of the others follow it.
const FIRST_BEGIN: char = '\u{f0000}';
/// The character behind a count, and the last one that is a mark.
const END: char = '\u{ffffd}';

/// Returns whether a character is a mark.
pub(super) fn is_count_mark(c: char) -> bool {
    (FIRST_BEGIN..=END).contains(&c)
}

/// Returns a count between its marks. Counts with too large an index have none.
pub(crate) fn marked_count(index: usize, count: &str) -> String {
    let begin = u32::try_from(index).ok();
    let begin = begin.and_then(|index| char::from_u32(index.checked_add(FIRST_BEGIN.into())?));
    match begin {
        Some(begin) if begin < END => format!("{begin}{count}{END}"),
        _ => count.to_owned(),
    }
}

/// Returns words without marks.
pub(crate) fn unmarked(words: &str) -> String {
    words.replace(is_count_mark, "")
}

/// Returns the parts of a text with marks: words, and counts with their indices.
pub(crate) fn marked_parts(text: &str) -> Vec<(&str, Option<usize>)> {
    let (mut parts, mut rest) = (Vec::new(), text);
    while let Some((words, behind)) = rest.split_once(is_count_mark) {
        let begin = rest[words.len()..].chars().next().unwrap_or(END);
        let (count, after) = behind.split_once(is_count_mark).unwrap_or((behind, ""));
        let index = u32::from(begin) - u32::from(FIRST_BEGIN);
        parts.extend([(words, None), (count, Some(index as usize))]);
        rest = after;
    }
    parts.push((rest, None));
    parts
}

#[cfg(test)]
mod tests {
    use super::{END, marked_count, marked_parts, unmarked};

    #[test]
    fn counts_are_found_by_their_marks_in_any_order() {
        let [first, second] = [marked_count(0, "1,234"), marked_count(1, "2")];
        let text = format!("of {second}, {first} failed");
        assert_eq!(
            marked_parts(&text),
            [
                ("of ", None),
                ("2", Some(1)),
                (", ", None),
                ("1,234", Some(0)),
                (" failed", None),
            ]
        );
        assert_eq!(unmarked(&text), "of 2, 1,234 failed");
        assert_eq!(marked_parts("2 failed"), [("2 failed", None)]);
        assert_eq!(marked_count(usize::MAX, "2"), "2");
        let last = (END as usize) - 0xf_0000;
        assert_eq!(marked_count(last, "2"), "2");
    }
}
