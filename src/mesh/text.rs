//! Lines, words and numbers of text formats, without copies.

/// Lines with their numbers, counted from 1; ends of any system, spaces around cut off.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    // A file of an old Mac has carriage returns only.
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    bytes
        .split(move |byte| *byte == end)
        .map(<[u8]>::trim_ascii)
        .zip(1..)
        .map(|(line, number)| (number, line))
}

/// Words between white space.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// A number as Rust and C write it; NaN and infinities are numbers here and refused later by vertex.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A whole number.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The first three words as numbers, or what is wrong with them.
pub(super) fn position<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<[f64; 3], String> {
    let mut out = [0.0; 3];
    for (have, value) in out.iter_mut().enumerate() {
        let word = words
            .next()
            .ok_or_else(|| format!("{have} of 3 coordinates"))?;
        *value = number(word).ok_or_else(|| not_a_number(word))?;
    }
    Ok(out)
}

/// Says that a word is no number, and shows at most the beginning of it.
pub(super) fn not_a_number(word: &[u8]) -> String {
    format!("{} is not a number", shown(word))
}

/// The beginning of a word in quotes, without what would be lost or do harm on a screen.
pub(super) fn shown(word: &[u8]) -> String {
    let beginning = &word[..word.len().min(200)];
    format!("\"{}\"", sanitize(&String::from_utf8_lossy(beginning)))
}

/// The same of a text, without quotes.
pub(super) fn sanitize(text: &str) -> String {
    crate::domain::sanitize(text, 48)
}

#[cfg(test)]
mod tests {
    use super::{sanitize, shown};

    #[test]
    fn words_of_a_mesh_come_plain_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(49)] {
            for said in [shown(rude.as_bytes()), sanitize(&rude)] {
                assert!(!said.contains(&rude), "{said:?}");
            }
        }
    }
}
