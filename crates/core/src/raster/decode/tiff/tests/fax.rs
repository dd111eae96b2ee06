//! Codings of faxes.

use super::{
    BLACK_IS_ZERO, TestPage, TestTiff, TestValues, bilevel, colours, group4, levels, packed,
};
use crate::raster::Grid;

/// Returns the codes of the runs of a row as text of 0 and 1. The number 1 is black.
fn run_codes(row: &[u32]) -> String {
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
fn bytes_of(bits: &str) -> Vec<u8> {
    let bits = bits.as_bytes().chunks(8);
    bits.map(|bits| {
        bits.iter()
            .enumerate()
            .fold(0, |sum, (at, bit)| sum | (bit - b'0') << (7 - at))
    })
    .collect()
}

#[test]
fn rows_of_a_fax_are_read_in_every_coding() {
    const END_OF_LINE: &str = "000000000001";
    // 150 pixels, so that long runs need two codes, and a row that begins with black.
    let pixels = Grid::from_fn(150, 12, |x, y| {
        u32::from(y == 3 || x > 20 + y && x < 120 && y % 4 > 1)
    });
    let rows = || (0..12).map(|y| run_codes(pixels.row(y)));
    let plain = colours(&TestTiff::default().encode(&[
        TestPage::new([150, 12], 0, 1, 1).strips(12, vec![packed(pixels.data(), 150, 1)]),
    ]));
    let plain = plain.expect("reads");
    let aligned = |to: usize| {
        rows().flat_map(move |row| {
            let len = row.len().next_multiple_of(to);
            bytes_of(&format!("{row:0<len$}"))
        })
    };
    let with_lines = rows().fold(String::new(), |text, row| text + END_OF_LINE + &row);
    let aligned_lines: String = rows().fold(String::new(), |text, row| {
        let zeros = (4 + 8 - text.len() % 8) % 8;
        text + &"0".repeat(zeros) + END_OF_LINE + &row
    });
    // Rows are marked as one-dimensional.
    let marked = rows().fold(String::new(), |text, row| text + END_OF_LINE + "1" + &row);
    for (name, compression, options, strip) in [
        ("rows at bytes", 2, None, aligned(8).collect()),
        ("rows at pairs of bytes", 32771, None, aligned(16).collect()),
        ("group 3", 3, None, bytes_of(&with_lines)),
        ("group 3, aligned", 3, Some(4), bytes_of(&aligned_lines)),
        (
            "group 3 without lines",
            3,
            None,
            bytes_of(&rows().collect::<String>()),
        ),
        ("group 3, two-dimensional", 3, Some(1), bytes_of(&marked)),
    ] {
        let strip: Vec<u8> = strip;
        let mut page = TestPage::new([150, 12], 0, 1, 1).short(259, compression);
        page = page.strips(12, vec![strip.clone()]);
        if let Some(options) = options {
            page = page.with(292, TestValues::Longs(vec![options]));
        }
        assert_eq!(
            colours(&TestTiff::default().encode(&[page.clone()])).expect(name),
            plain,
            "{name}"
        );
        page.chunks = vec![strip[..strip.len() - 3].to_vec()];
        assert!(
            colours(&TestTiff::default().encode(&[page])).is_err(),
            "{name}"
        );
    }
}

#[test]
fn rows_of_group_4_refer_to_the_row_above() {
    let numbers = levels(1);
    let page = TestPage::new([20, 14], BLACK_IS_ZERO, 1, 1).short(259, 4);
    let page = page.strips(14, vec![group4(&numbers)]);
    assert_eq!(
        colours(&TestTiff::default().encode(&[page])).expect("reads"),
        bilevel()
    );
}
