//! Codings of faxes.

use super::{BLACK_IS_ZERO, bilevel, colours, group4, levels};
use crate::raster::Grid;
use crate::raster::test_images::{
    END_OF_LINE, TestPage, TestTiff, TestValues, bytes_of, packed, rows_at_bits, rows_with_lines,
    run_codes,
};

#[test]
fn rows_of_a_fax_are_read_in_every_coding() {
    // 150 pixels, so that long runs need two codes, and a row that begins with black.
    let pixels = Grid::from_fn(150, 12, |x, y| {
        u32::from(y == 3 || x > 20 + y && x < 120 && y % 4 > 1)
    });
    let rows = || (0..12).map(|y| run_codes(pixels.row(y)));
    let plain = colours(&TestTiff::default().encode(&[
        TestPage::new([150, 12], 0, 1, 1).strips(12, vec![packed(pixels.data(), 150, 1)]),
    ]));
    let plain = plain.expect("reads");
    let aligned_lines: String = rows().fold(String::new(), |text, row| {
        let zeros = (4 + 8 - text.len() % 8) % 8;
        text + &"0".repeat(zeros) + END_OF_LINE + &row
    });
    // Rows are marked as one-dimensional.
    let marked = rows().fold(String::new(), |text, row| text + END_OF_LINE + "1" + &row);
    for (name, compression, options, strip) in [
        ("rows at bytes", 2, None, rows_at_bits(&pixels, 8)),
        (
            "rows at pairs of bytes",
            32771,
            None,
            rows_at_bits(&pixels, 16),
        ),
        ("group 3", 3, None, rows_with_lines(&pixels)),
        ("group 3, aligned", 3, Some(4), bytes_of(&aligned_lines)),
        (
            "group 3 without lines",
            3,
            None,
            bytes_of(&rows().collect::<String>()),
        ),
        ("group 3, two-dimensional", 3, Some(1), bytes_of(&marked)),
    ] {
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
