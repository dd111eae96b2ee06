//! Lines, words and numbers of text formats, without copies.

use super::decimal;
use super::error::MeshError;
use crate::domain::cancel::{PollCounter, poll, polled};

/// Longest line or word in bytes. Code that reads one takes a few milliseconds for it between two polls for a cancellation.
pub(super) const MAX_LINE_BYTES: usize = 4 << 20;
/// Bytes at the beginning of a file that show how its lines end.
const HEAD_BYTES: usize = 1 << 16;
/// Bytes that are searched between two polls.
const BYTES_PER_POLL: usize = 1 << 20;

/// Returns the trimmed lines with their line numbers, counted from 1. Lines end in LF or CRLF, and in files of classic
/// Mac OS also in CR.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    raw_lines(bytes).map(|(line, content)| (line, content.trim_ascii()))
}

/// Returns the lines like [`lines`], with white space at their ends, such as tabs beside empty cells.
pub(super) fn raw_lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    let is_classic_mac = is_classic_mac(bytes);
    let mut counter = PollCounter::default();
    let mut unread = Some(bytes);
    let lines = std::iter::from_fn(move || {
        let rest = unread?;
        let end = if is_classic_mac {
            memchr::memchr2(b'\n', b'\r', rest)
        } else {
            memchr::memchr(b'\n', rest)
        };
        let line = &rest[..end.unwrap_or(rest.len())];
        unread = end.map(|end| &rest[end + 1..]);
        counter.add(poll_items(line.len()));
        Some(line)
    });
    (1..).zip(lines)
}

/// The byte that ended text files in CP/M and DOS.
const END_MARK: u8 = 0x1a;

/// Returns a text without the byte that ends text files in DOS, and without white space behind it.
pub(super) fn without_end_mark(bytes: &[u8]) -> &[u8] {
    let mut text = bytes.trim_ascii_end();
    if text.last() != Some(&END_MARK) {
        return bytes;
    }
    while let [before @ .., END_MARK] = text {
        text = before;
    }
    text
}

/// Returns whether more of the first lines end in CR than in LF or CRLF, as in files of classic Mac OS.
pub(super) fn is_classic_mac(bytes: &[u8]) -> bool {
    let mut head = &bytes[..bytes.len().min(HEAD_BYTES)];
    let (mut lf, mut cr) = (0, 0);
    while let [byte, rest @ ..] = head {
        lf += u32::from(*byte == b'\n');
        cr += u32::from(*byte == b'\r' && rest.first() != Some(&b'\n'));
        head = rest;
    }
    cr > lf
}

/// Returns how many items of a [`PollCounter`] stand for a line of this length: about one for each microsecond.
pub(super) fn poll_items(bytes: usize) -> u32 {
    1 + (bytes / 256).min(1 << 16) as u32
}

/// Returns whether a text contains a byte.
pub(super) fn contains(bytes: &[u8], wanted: u8) -> bool {
    bytes.chunks(BYTES_PER_POLL).any(|part| {
        poll();
        part.contains(&wanted)
    })
}

/// Checks that each line has at most [`MAX_LINE_BYTES`] bytes. Looks at few bytes of a file with short lines.
///
/// # Errors
/// Returns an error that names the first longer line.
pub(super) fn check_lines(bytes: &[u8]) -> Result<(), MeshError> {
    let is_classic_mac = is_classic_mac(bytes);
    let is_end = |byte: &u8| *byte == b'\n' || (is_classic_mac && *byte == b'\r');
    let mut rest = bytes;
    while let Some(window) = rest.get(..=MAX_LINE_BYTES) {
        poll();
        let Some(last) = window.iter().rposition(is_end) else {
            let before = &bytes[..bytes.len() - rest.len()];
            let line = polled(before).filter(|byte| is_end(byte)).count() as u64 + 1;
            let reason = format!("it has more than {MAX_LINE_BYTES} bytes");
            return Err(MeshError::Line { line, reason });
        };
        rest = &rest[last + 1..];
    }
    Ok(())
}

/// Returns the words between white space.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    polled(line.split(u8::is_ascii_whitespace)).filter(|word| !word.is_empty())
}

/// Parses a number of any type.
pub(super) fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Parses a coordinate. NaN and infinity stand for one that is missing.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    if let Some((value, [])) = decimal::parse(word) {
        return Some(value);
    }
    parse(word).or_else(|| {
        let unsigned = word.strip_prefix(b"-").unwrap_or(word);
        is_indefinite(unsigned).then_some(f64::NAN)
    })
}

/// Returns whether a text begins with NaN or infinity as the C library of Windows writes them: `nan(ind)`, `1.#IND00`.
pub(super) fn is_indefinite(text: &[u8]) -> bool {
    let starts = |name: &&str| {
        let start = text.get(..name.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(name.as_bytes()))
    };
    ["nan(", "1.#ind", "1.#qnan", "1.#snan", "1.#inf"]
        .iter()
        .any(starts)
}

/// Parses the first three words as numbers; the error is a message.
pub(super) fn position<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<[f64; 3], String> {
    let mut out = [0.0; 3];
    for (have, value) in out.iter_mut().enumerate() {
        let missing = || format!("{have} of 3 coordinates");
        let word = words.next().ok_or_else(missing)?;
        *value = number(word).ok_or_else(|| not_a_number(word))?;
    }
    Ok(out)
}

/// Replaces the first comma of a word by a point.
pub(super) fn with_point(word: &[u8]) -> Vec<u8> {
    let mut pointed = word.to_vec();
    if let Some(comma) = pointed.iter_mut().find(|byte| **byte == b',') {
        *comma = b'.';
    }
    pointed
}

/// Says that a word is not a number, and quotes its beginning.
pub(super) fn not_a_number(word: &[u8]) -> String {
    let is_decimal_comma = word.contains(&b',') && number(&with_point(word)).is_some();
    let advice = if is_decimal_comma {
        "; save the file with decimal points instead of commas"
    } else {
        ""
    };
    format!("{} is not a number{advice}", quote(word))
}

/// Says that a number has a decimal mark, a point or a comma, and others have the other one.
pub(super) fn other_decimal_mark(word: &[u8], mark: u8) -> String {
    let said = match mark {
        b',' => "has a comma, but others have a point",
        _ => "has a point, but others have a comma",
    };
    let word = quote(word);
    format!("{word} {said}; write all numbers with the same decimal mark")
}

/// Ends the reasons of files that end within a line.
pub(super) const CUT_OFF: &str = "the file seems to be cut off";

/// Returns the last line if the file ends within it. Lines must not be too long, see [`check_lines`].
pub(super) fn unended_line(bytes: &[u8]) -> Option<&[u8]> {
    if matches!(bytes.last(), None | Some(b'\n' | b'\r')) {
        return None;
    }
    let is_classic = is_classic_mac(bytes);
    let is_end = |byte: &u8| *byte == b'\n' || (is_classic && *byte == b'\r');
    let before = bytes.iter().rposition(is_end);
    Some(&bytes[before.map_or(0, |end| end + 1)..])
}

/// Says that a file of several lines seems to be cut off if a fault lies in its last line and nothing ends this line.
pub(super) fn fault_at_end(fault: MeshError, bytes: &[u8]) -> MeshError {
    match fault {
        MeshError::Line { line, reason }
            if line > 1
                && !reason.ends_with(CUT_OFF)
                && check_lines(bytes).is_ok()
                && unended_line(bytes).is_some()
                && lines(bytes).count() as u64 == line =>
        {
            let reason = format!("{reason}; it is the last line, so {CUT_OFF}");
            MeshError::Line { line, reason }
        }
        fault => fault,
    }
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
    use super::{MAX_LINE_BYTES, check_lines, lines, quote, sanitize};
    use crate::domain::cancel::{CancelToken, Cancelled};
    use crate::mesh::{MeshLimits, read};

    #[test]
    fn lines_are_limited_and_long_ones_are_polled() {
        let longest = [vec![b'#'; MAX_LINE_BYTES], b"\n".to_vec()].concat();
        let short = b"v 0 0 0\n".repeat(3);
        for end in [b'\n', b'\r'] {
            let with_end = |mut text: Vec<u8>| {
                for byte in text.iter_mut().filter(|byte| **byte == b'\n') {
                    *byte = end;
                }
                text
            };
            let whole = with_end([&short[..], &longest, &longest, &short].concat());
            assert_eq!(check_lines(&whole), Ok(()));
            let long = with_end([&short[..], &longest, b"#", &longest].concat());
            let error = check_lines(&long).expect_err("too long").to_string();
            assert_eq!(error, "line 5: it has more than 4194304 bytes");
        }
        let many = longest.repeat(9);
        let token = CancelToken::cancelled_at(9);
        assert_eq!(token.run(|| lines(&many).count()), Err(Cancelled));
    }

    #[test]
    fn a_huge_line_is_refused_in_every_text_format() {
        let huge = "7".repeat(MAX_LINE_BYTES + 9);
        let header = "format ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
            property float z\nend_header\n";
        for (name, text, place) in [
            ("a.obj", format!("v 0 0 0\n# {huge}\n"), "line 2: "),
            ("a.xyz", format!("0 0 0\n# {huge}\n"), "line 2: "),
            ("a.stl", format!("solid\nfacet {huge}\n"), "line 2: "),
            ("a.ply", format!("ply\n{header}0 0 {huge}\n"), "vertex 1: "),
        ] {
            let limits = MeshLimits::SUGGESTED;
            let error = read(text.as_bytes(), name, &limits).expect_err("too long");
            let said = error.to_string();
            let is_short = said.len() < 200;
            assert!(
                is_short && said.contains("more than 4194304 bytes"),
                "{said}"
            );
            assert!(said.contains(place), "{said}");
        }
    }

    #[test]
    fn quoted_words_are_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(49)] {
            for said in [quote(rude.as_bytes()), sanitize(&rude)] {
                assert!(!said.contains(&rude), "{said:?}");
            }
        }
    }
}
