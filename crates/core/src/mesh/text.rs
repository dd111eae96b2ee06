//! Lines, words and numbers of text formats, without copies.

use super::error::MeshError;
use crate::domain::cancel::{PollCounter, poll, polled};

/// Longest line or word in bytes. Code that reads one takes a few milliseconds for it between two polls for a cancellation.
pub(super) const MAX_LINE_BYTES: usize = 4 << 20;
/// Bytes at the beginning of a file that show how its lines end.
const HEAD_BYTES: usize = 1 << 16;
/// Bytes that are searched between two polls.
const BYTES_PER_POLL: usize = 1 << 20;

/// Returns the trimmed lines with their line numbers, counted from 1.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    let is_end = line_end(bytes);
    let mut counter = PollCounter::default();
    bytes
        .split(is_end)
        .inspect(move |line| counter.add(poll_items(line.len())))
        .map(<[u8]>::trim_ascii)
        .zip(1..)
        .map(|(line, number)| (number, line))
}

/// Returns a function that recognizes the byte at the end of a line: LF, and also CR in files of classic Mac OS.
fn line_end(bytes: &[u8]) -> impl Fn(&u8) -> bool + Copy {
    let other = if is_classic_mac(bytes) { b'\r' } else { b'\n' };
    move |byte| *byte == b'\n' || *byte == other
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
    let is_end = line_end(bytes);
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
