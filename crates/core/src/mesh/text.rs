//! Lines, words and numbers of text formats, without copies.

use crate::domain::cancel::polled;

/// Returns the trimmed lines with their line numbers, counted from 1. Lines may end in LF or CRLF, or in CR if the file
/// has no LF.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    // Files of classic Mac OS have carriage returns only.
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    polled(bytes.split(move |byte| *byte == end))
        .map(<[u8]>::trim_ascii)
        .zip(1..)
        .map(|(line, number)| (number, line))
}

/// Returns the words between white space.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    polled(line.split(u8::is_ascii_whitespace)).filter(|word| !word.is_empty())
}

/// Parses a number. Accepts NaN and infinity, which the readers reject in vertices.
pub(super) fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Parses the first three words as numbers; the error is a message.
pub(super) fn position<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<[f64; 3], String> {
    let mut out = [0.0; 3];
    for (have, value) in out.iter_mut().enumerate() {
        let missing = || format!("{have} of 3 coordinates");
        let word = words.next().ok_or_else(missing)?;
        *value = parse(word).ok_or_else(|| not_a_number(word))?;
    }
    Ok(out)
}

/// Says that a word is not a number, and quotes its beginning.
pub(super) fn not_a_number(word: &[u8]) -> String {
    format!("{} is not a number", quote(word))
}

/// Quotes the beginning of a word without control characters.
pub(super) fn quote(word: &[u8]) -> String {
    let beginning = &word[..word.len().min(200)];
    format!("\"{}\"", sanitize(&String::from_utf8_lossy(beginning)))
}

/// Shortens a text and removes control characters.
pub(super) fn sanitize(text: &str) -> String {
    crate::domain::sanitize(text, 48)
}

#[cfg(test)]
mod tests {
    use super::{quote, sanitize};

    #[test]
    fn quoted_words_are_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(49)] {
            for said in [quote(rude.as_bytes()), sanitize(&rude)] {
                assert!(!said.contains(&rude), "{said:?}");
            }
        }
    }
}
