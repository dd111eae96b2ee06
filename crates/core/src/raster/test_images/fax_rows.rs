//! Codes rows of bilevel pixels as faxes do, ITU-T T.4. The number 1 is black.

use crate::raster::Grid;

/// The code before each row, as text of 0 and 1.
pub const END_OF_LINE: &str = "000000000001";

/// Returns the codes of the runs of a row as text of 0 and 1.
pub fn run_codes(row: &[u32]) -> String {
    let mut codes = String::new();
    let mut add = |bits: Option<::fax::Bits>| {
        let ::fax::Bits { data, len } = bits.expect("a code");
        codes.push_str(&format!("{data:016b}")[16 - usize::from(len)..]);
    };
    if row[0] == 1 {
        add(::fax::maps::white::encode(0));
    }
    for run in row.chunk_by(|a, b| a == b) {
        let encode = if run[0] == 1 {
            ::fax::maps::black::encode
        } else {
            ::fax::maps::white::encode
        };
        let len = run.len() as u16;
        if len >= 64 {
            add(encode(len / 64 * 64));
        }
        add(encode(len % 64));
    }
    codes
}

/// Turns text of 0 and 1 to bytes.
pub fn bytes_of(bits: &str) -> Vec<u8> {
    let bits = bits.as_bytes().chunks(8);
    bits.map(|bits| {
        bits.iter()
            .enumerate()
            .fold(0, |sum, (at, bit)| sum | (bit - b'0') << (7 - at))
    })
    .collect()
}

/// Returns rows that each begin at a multiple of some bits (compression 2 and 32771 of TIFF).
pub fn rows_at_bits(pixels: &Grid<u32>, bits: usize) -> Vec<u8> {
    let rows = (0..pixels.height()).map(|y| run_codes(pixels.row(y)));
    let aligned = rows.flat_map(|row| {
        let len = row.len().next_multiple_of(bits);
        bytes_of(&format!("{row:0<len$}"))
    });
    aligned.collect()
}

/// Returns rows with an end-of-line code before each (group 3, compression 3 of TIFF).
pub fn rows_with_lines(pixels: &Grid<u32>) -> Vec<u8> {
    let rows = (0..pixels.height()).map(|y| run_codes(pixels.row(y)));
    let text = rows.fold(String::new(), |text, row| text + END_OF_LINE + &row);
    bytes_of(&text)
}
