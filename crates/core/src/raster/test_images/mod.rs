//! Writers of image files that no encoder of this crate makes, for tests.

mod fax_rows;
mod jpeg;
mod png_chunk;
mod tiff;

pub use fax_rows::{END_OF_LINE, bytes_of, rows_at_bits, rows_with_lines, run_codes};
pub use jpeg::{TestJpeg, TestScans};
pub use png_chunk::encoded_chunk;
pub use tiff::{TestPage, TestTiff, TestValues};

/// Packs numbers of some bits, each row from a new byte.
pub fn packed(numbers: &[u32], width: usize, bits: usize) -> Vec<u8> {
    let rows = numbers.chunks(width).map(|row| {
        let bit = |at: usize| {
            row.get(at / bits)
                .map_or(0, |number| number >> (bits - 1 - at % bits) & 1)
        };
        let bytes = 0..(width * bits).div_ceil(8);
        bytes
            .map(|byte| (0..8).fold(0, |sum, at| sum << 1 | bit(8 * byte + at) as u8))
            .collect::<Vec<_>>()
    });
    rows.collect::<Vec<_>>().concat()
}

/// Returns luma and chroma as JFIF defines them.
pub fn ycbcr([r, g, b]: [u8; 3]) -> [u8; 3] {
    let [r, g, b] = [r, g, b].map(f64::from);
    let y = 0.299 * r + 0.587 * g + 0.114 * b;
    [y, 128.0 + (b - y) / 1.772, 128.0 + (r - y) / 1.402].map(|value| value.round() as u8)
}
