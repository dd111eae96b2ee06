//! Tests of the TIFF decoder, with files that are made by code.

mod fax;
mod pages;
mod refusals;
mod samples;
mod storage;

use super::super::{DecodeError, ImageLimits, decode};
use crate::raster::Grid;
use crate::raster::test_images::{TestPage, TestTiff};

const BLACK_IS_ZERO: u16 = 1;
const RGB: u16 = 2;

/// Decodes a file and returns its colours.
fn colours(file: &[u8]) -> Result<Grid<[u16; 3]>, DecodeError> {
    decode(file, &ImageLimits::SUGGESTED).map(|image| image.rgb.to_rgb16().into_owned())
}

/// Returns the sentence for a page that is refused.
fn refusal(page: &TestPage) -> String {
    let file = TestTiff::default().encode(std::slice::from_ref(page));
    colours(&file).expect_err("refused").to_string()
}

/// Returns a picture of 20 by 14 pixels without symmetry.
fn picture() -> Grid<[u8; 3]> {
    Grid::from_fn(20, 14, |x, y| {
        let stroke = (4..9).contains(&x) && (2..11).contains(&y) || (9..16).contains(&x) && y == 5;
        if stroke {
            [20, x as u8, y as u8]
        } else {
            [230, 240 - x as u8, 200 + y as u8]
        }
    })
}

fn widened(picture: &Grid<[u8; 3]>) -> Grid<[u16; 3]> {
    picture.map(|colour| colour.map(|c| u16::from(c) * 257))
}

/// Returns the bytes of all pixels.
fn rgb_bytes(picture: &Grid<[u8; 3]>) -> Vec<u8> {
    picture.data().as_flattened().to_vec()
}

/// Returns a page of RGB in one strip.
fn plain_page(picture: &Grid<[u8; 3]>) -> TestPage {
    let size = [picture.width() as u32, picture.height() as u32];
    TestPage::new(size, RGB, 8, 3).strips(size[1], vec![rgb_bytes(picture)])
}

/// Returns black strokes on white as numbers of some bits.
fn levels(bits: usize) -> Vec<u32> {
    let white = ((1_u64 << bits) - 1) as u32;
    let pixels = picture();
    pixels
        .data()
        .iter()
        .map(|[r, ..]| if *r == 20 { 0 } else { white })
        .collect()
}

fn bilevel() -> Grid<[u16; 3]> {
    picture().map(|[r, ..]| if *r == 20 { [0; 3] } else { [65535; 3] })
}

fn group4(numbers: &[u32]) -> Vec<u8> {
    let mut encoder = ::fax::encoder::Encoder::new(::fax::VecWriter::new());
    for row in numbers.chunks(20) {
        // The number 1 is white here, and black in the file.
        let pixels = row.iter().map(|n| {
            if *n == 1 {
                ::fax::Color::Black
            } else {
                ::fax::Color::White
            }
        });
        encoder.encode_line(pixels, 20).expect("encodes");
    }
    encoder.finish().expect("encodes").finish()
}
