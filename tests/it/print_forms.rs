//! A print in files as other programs write them, each of which is read like its plain twin.

use mocban::raster::test_images::{
    TestJpeg, TestPage, TestScans, TestTiff, TestValues, packed, rows_at_bits, rows_with_lines,
    ycbcr,
};
use mocban::raster::{Grid, png_grey8, png_rgb8};

use crate::tiff_file::{BLACK_IS_ZERO, PALETTE, RGB, WHITE_IS_ZERO};

/// Photometric interpretations: inks, and luma with chroma.
const CMYK: u16 = 5;
const YCBCR: u16 = 6;

/// The orientation that turns the stored image clockwise by a quarter.
const QUARTER: u8 = 6;

/// A print in an unusual form.
pub(crate) struct PrintForm {
    /// Name of the file, and the id of its pair.
    pub(crate) name: &'static str,
    pub(crate) bytes: Vec<u8>,
    /// Whether the stored image is turned.
    pub(crate) is_turned: bool,
}

fn form(name: &'static str, bytes: Vec<u8>) -> PrintForm {
    PrintForm {
        name,
        bytes,
        is_turned: false,
    }
}

fn turned_form(name: &'static str, bytes: Vec<u8>) -> PrintForm {
    PrintForm {
        is_turned: true,
        ..form(name, bytes)
    }
}

/// Returns the forms of a print in colour, in grey, and in black and white, the plain one of each first.
pub(crate) fn groups(print: &Grid<[u8; 3]>) -> [Vec<PrintForm>; 3] {
    let grey = print.map(|[_, green, _]| *green);
    [in_colour(print), in_grey(&grey), bilevel(&grey)]
}

fn in_colour(print: &Grid<[u8; 3]>) -> Vec<PrintForm> {
    let mut forms = vec![form("plain.png", png_rgb8(print))];
    forms.extend(pages(print));
    forms.extend(stored_colours(print));
    forms.extend(jpegs(print));
    forms
}

fn size<T: Copy>(grid: &Grid<T>) -> [u32; 2] {
    [grid.width() as u32, grid.height() as u32]
}

fn tiff(page: TestPage) -> Vec<u8> {
    TestTiff::default().encode(&[page])
}

fn rgb_page(print: &Grid<[u8; 3]>) -> TestPage {
    let strip = print.data().as_flattened().to_vec();
    let size = size(print);
    TestPage::new(size, RGB, 8, 3).strips(size[1], vec![strip])
}

/// Returns the print with fewer pixels.
fn preview(print: &Grid<[u8; 3]>) -> TestPage {
    let [width, height] = [print.width() / 3, print.height() / 3];
    rgb_page(&Grid::from_fn(width, height, |x, y| print.at(3 * x, 3 * y)))
}

/// Returns files whose first page is a preview.
fn pages(print: &Grid<[u8; 3]>) -> [PrintForm; 2] {
    let marked = TestPage {
        pictures: vec![rgb_page(print)],
        ..preview(print).with(254, TestValues::Longs(vec![1]))
    };
    let unmarked = [preview(print), rgb_page(print)];
    [
        form("subdirectory.tif", tiff(marked)),
        form(
            "unmarked-preview.tif",
            TestTiff::default().encode(&unmarked),
        ),
    ]
}

/// Returns a file of two full pages.
pub(crate) fn two_pages(print: &Grid<[u8; 3]>) -> Vec<u8> {
    TestTiff::default().encode(&[rgb_page(print), rgb_page(print)])
}

/// Returns the stored pixels of an image whose orientation is [`QUARTER`].
fn turned(upright: &Grid<[u8; 3]>) -> Grid<[u8; 3]> {
    let right = upright.width() - 1;
    Grid::from_fn(upright.height(), upright.width(), |x, y| {
        upright.at(right - y, x)
    })
}

/// Returns a page with the first pixel in the least significant bit of each byte (`FillOrder` 2).
fn bits_reversed(page: TestPage) -> TestPage {
    let reversed = |chunk: &Vec<u8>| -> Vec<u8> {
        let bytes = chunk.iter();
        bytes.map(|byte| byte.reverse_bits()).collect()
    };
    let chunks = page.chunks.iter().map(reversed).collect();
    TestPage {
        chunks,
        ..page.short(266, 2)
    }
}

/// Returns TIFF files that store the colours otherwise than as upright, interleaved bytes of red, green and blue.
fn stored_colours(print: &Grid<[u8; 3]>) -> [PrintForm; 5] {
    let inks = |colour: &[u8; 3]| {
        let [cyan, magenta, yellow] = colour.map(|level| 255 - level);
        [cyan, magenta, yellow, 0]
    };
    let inks: Vec<u8> = print.data().iter().flat_map(inks).collect();
    let size = size(print);
    let cmyk = TestPage::new(size, CMYK, 8, 4).strips(size[1], vec![inks]);
    let orientation = TestValues::Longs(vec![u32::from(QUARTER)]);
    let quarter = rgb_page(&turned(print)).with(274, orientation);
    [
        form("tiled-planes.tif", tiff(tiled_planes(print))),
        form("shared-chroma.tif", tiff(shared_chroma(print))),
        form("reversed-bits.tif", tiff(bits_reversed(rgb_page(print)))),
        form("cmyk.tif", tiff(cmyk)),
        turned_form("turned.tif", tiff(quarter)),
    ]
}

fn tiled_planes(print: &Grid<[u8; 3]>) -> TestPage {
    const SIDE: usize = 64;
    let (right, bottom) = (print.width() - 1, print.height() - 1);
    let mut tiles = Vec::new();
    for channel in 0..3 {
        for top in (0..=bottom).step_by(SIDE) {
            for left in (0..=right).step_by(SIDE) {
                let tile: Grid<u8> = Grid::from_fn(SIDE, SIDE, |x, y| {
                    print.at((left + x).min(right), (top + y).min(bottom))[channel]
                });
                tiles.push(tile.data().to_vec());
            }
        }
    }
    let page = TestPage::new(size(print), RGB, 8, 3).short(284, 2);
    page.tiles([SIDE as u16; 2], tiles)
}

/// Returns luma and chroma without compression. Blocks of 2 by 2 pixels share their chroma.
fn shared_chroma(print: &Grid<[u8; 3]>) -> TestPage {
    let coded = print.map(|colour| ycbcr(*colour));
    let (right, bottom) = (print.width() - 1, print.height() - 1);
    let mut strip = Vec::new();
    for top in (0..=bottom).step_by(2) {
        for left in (0..=right).step_by(2) {
            let block = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(x, y)| coded.at((left + x).min(right), (top + y).min(bottom)));
            strip.extend(block.map(|[luma, ..]| luma));
            for channel in [1, 2] {
                let sum: u32 = block.iter().map(|pixel| u32::from(pixel[channel])).sum();
                strip.push((sum / 4) as u8);
            }
        }
    }
    let size = size(print);
    let page = TestPage::new(size, YCBCR, 8, 3).with(530, TestValues::Shorts(vec![2, 2]));
    page.strips(size[1], vec![strip])
}

/// Returns an EXIF segment whose orientation is [`QUARTER`], of the type LONG.
fn exif_of_long() -> Vec<u8> {
    let mut exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x04\0\x01\0\0\0".to_vec();
    exif.extend([QUARTER, 0, 0, 0, 0, 0, 0, 0]);
    let mut segment = vec![0xff, 0xe1, 0, exif.len() as u8 + 2];
    segment.extend(exif);
    segment
}

fn jpegs(print: &Grid<[u8; 3]>) -> [PrintForm; 6] {
    let of = |scans| TestJpeg {
        shared: [2, 2],
        scans,
    };
    let usual = of(TestScans::Interleaved);
    let separate = of(TestScans::Separate([0, 1, 2])).encode(print, &[]);
    let quarter = usual.encode(&turned(print), &[exif_of_long()]);
    let whole = usual.encode(print, &[]);
    let (data, _) = whole.split_at(whole.len() - 2);
    let trailer = b"SEFHe\0\0\0\x01\0\0\0vendor {\"model\": 7}SEFT";
    [
        form("usual.jpg", whole.clone()),
        form("scan-a-component.jpg", separate.clone()),
        turned_form("turned.jpg", quarter),
        form("without-end.jpg", data.to_vec()),
        form("trailer-for-end.jpg", [data, trailer].concat()),
        form("trailer.jpg", [&separate[..], trailer].concat()),
    ]
}

fn in_grey(grey: &Grid<u8>) -> Vec<PrintForm> {
    let size = size(grey);
    let page = |photometric, bits, strip: Vec<u8>| {
        TestPage::new(size, photometric, bits, 1).strips(size[1], vec![strip])
    };
    // The colours of the palette have 8 bits, though the tag has room for 16.
    let palette: Vec<u16> = (0..3 * 256).map(|at| at % 256).collect();
    let palette = page(PALETTE, 8, grey.data().to_vec()).with(320, TestValues::Shorts(palette));
    let scaled = |most: u32| grey.map(|level| (u32::from(*level) * most + 127) / 255);
    let twelve = packed(scaled((1 << 12) - 1).data(), grey.width(), 12);
    let ten = scaled((1 << 10) - 1);
    let ten = ten.data().iter();
    let words: Vec<u8> = ten
        .flat_map(|level| (*level as u16).to_le_bytes())
        .collect();
    let reversed = bits_reversed(page(BLACK_IS_ZERO, 8, grey.data().to_vec()));
    vec![
        form("plain-grey.png", png_grey8(grey)),
        form("palette.tif", tiff(palette)),
        form("packed-12.tif", tiff(page(BLACK_IS_ZERO, 12, twelve))),
        form(
            "ten-in-16.tif",
            tiff(page(BLACK_IS_ZERO, 10, words.clone())),
        ),
        form("ten-as-16.tif", tiff(page(BLACK_IS_ZERO, 16, words))),
        form("reversed-grey.tif", tiff(reversed)),
    ]
}

/// Returns black and white forms. The plain one has the same two levels, so that no form needs a tolerance of its own.
fn bilevel(grey: &Grid<u8>) -> Vec<PrintForm> {
    const BYTES: u16 = 2;
    const GROUP_3: u16 = 3;
    const WORDS: u16 = 32771;
    let least = grey.data().iter().min().expect("pixels");
    let most = grey.data().iter().max().expect("pixels");
    let middle = least.midpoint(*most);
    let black = grey.map(|level| u32::from(*level < middle));
    let size = size(grey);
    let page = |compression, strip: Vec<u8>| {
        let page = TestPage::new(size, WHITE_IS_ZERO, 1, 1).short(259, compression);
        page.strips(size[1], vec![strip])
    };
    let group_3 = page(GROUP_3, rows_with_lines(&black));
    let plain = black.map(|black| if *black == 1 { 0 } else { 255 });
    vec![
        form("plain-bilevel.png", png_grey8(&plain)),
        form("fax-rows.tif", tiff(page(BYTES, rows_at_bits(&black, 8)))),
        form("fax-words.tif", tiff(page(WORDS, rows_at_bits(&black, 16)))),
        form("group-3.tif", tiff(group_3.clone())),
        form("reversed-group-3.tif", tiff(bits_reversed(group_3))),
    ]
}
