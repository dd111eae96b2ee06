//! Chunks of PNG files.

use flate2::Crc;

/// Returns a chunk of a PNG with its length and its checksum.
pub fn encoded_chunk(kind: [u8; 4], content: &[u8]) -> Vec<u8> {
    let mut crc = Crc::new();
    crc.update(&kind);
    crc.update(content);
    let len = (content.len() as u32).to_be_bytes();
    [&len[..], &kind, content, &crc.sum().to_be_bytes()].concat()
}
