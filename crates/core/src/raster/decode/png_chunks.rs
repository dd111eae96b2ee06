//! The chunks of a PNG that are not pixels.

use std::borrow::Cow;
use std::io::Read as _;

use flate2::read::ZlibDecoder;

use crate::domain::cancel::PollCounter;

/// Longest text that is decompressed.
const MAX_TEXT_BYTES: u64 = 1 << 22;

/// Returns kind and content of each chunk that is complete, before and after the pixels.
pub(in crate::raster) fn png_chunks(bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut counter = PollCounter::default();
    let mut at = 8;
    std::iter::from_fn(move || {
        counter.tick();
        let [len, kind] = *bytes.get(at..at + 8)?.as_chunks::<4>().0 else {
            return None;
        };
        let start = at + 8;
        let end = start + u32::from_be_bytes(len) as usize;
        at = end + 4;
        Some((kind, bytes.get(start..end)?))
    })
}

/// Returns the content of the first chunk of a kind.
pub(super) fn png_chunk(bytes: &[u8], wanted: [u8; 4]) -> Option<&[u8]> {
    let mut chunks = png_chunks(bytes);
    let found = chunks.find(|(kind, _)| *kind == wanted);
    found.map(|(_, content)| content)
}

/// Returns the content of the first chunk of a kind that says what colours mean. Such a chunk counts only before the palette
/// and the pixels.
pub(super) fn png_colour_chunk(bytes: &[u8], wanted: [u8; 4]) -> Option<&[u8]> {
    let mut before = png_chunks(bytes).take_while(|(kind, _)| !matches!(kind, b"PLTE" | b"IDAT"));
    let found = before.find(|(kind, _)| *kind == wanted);
    found.map(|(_, content)| content)
}

/// Returns the keyword and the text of a text chunk with one of the keywords. Returns `None` for other chunks, and if the text
/// cannot be decompressed.
pub(in crate::raster) fn png_text<'b>(
    kind: [u8; 4],
    content: &'b [u8],
    keywords: &[&[u8]],
) -> Option<(&'b [u8], Cow<'b, [u8]>)> {
    let is_text = matches!(&kind, b"tEXt" | b"zTXt" | b"iTXt");
    let (keyword, rest) = split_at_nul(content).filter(|_| is_text)?;
    if !keywords.contains(&keyword) {
        return None;
    }
    let (is_compressed, text) = match &kind {
        b"tEXt" => (false, rest),
        b"zTXt" => (true, rest.get(1..)?),
        _ => {
            let (flags, rest) = rest.split_at_checked(2)?;
            let (_language, rest) = split_at_nul(rest)?;
            let (_translated, text) = split_at_nul(rest)?;
            (flags[0] == 1, text)
        }
    };
    if !is_compressed {
        return Some((keyword, Cow::Borrowed(text)));
    }
    let mut plain = Vec::new();
    let mut decoder = ZlibDecoder::new(text).take(MAX_TEXT_BYTES);
    decoder.read_to_end(&mut plain).ok()?;
    Some((keyword, Cow::Owned(plain)))
}

fn split_at_nul(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let end = memchr::memchr(0, bytes)?;
    Some((&bytes[..end], &bytes[end + 1..]))
}
