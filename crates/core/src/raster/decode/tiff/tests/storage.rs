//! Strips and tiles, planes, compressions and predictors.

use std::io::Write as _;

use super::{BLACK_IS_ZERO, RGB, colours, group4, levels, picture, rgb_bytes, widened};
use crate::raster::Grid;
use crate::raster::test_images::{TestPage, TestTiff, TestValues, packed};

const UNCOMPRESSED: u16 = 1;
const LZW: u16 = 5;
const DEFLATE: u16 = 8;
const PACK_BITS: u16 = 32773;

fn compressed(bytes: &[u8], compression: u16) -> Vec<u8> {
    match compression {
        LZW => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
            .encode(bytes)
            .expect("encodes"),
        DEFLATE => {
            let mut encoder =
                flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(bytes).expect("encodes");
            encoder.finish().expect("encodes")
        }
        // Runs of one value, and literal bytes.
        PACK_BITS => bytes
            .chunk_by(|a, b| a == b)
            .flat_map(|run| run.chunks(128))
            .flat_map(|run| match run {
                [byte] => vec![0, *byte],
                run => vec![(257 - run.len()) as u8, run[0]],
            })
            .collect(),
        _ => bytes.to_vec(),
    }
}

/// Replaces each sample of 16 bits by its difference from the pixel to the left.
fn differences(numbers: &[u16], width: usize, samples: usize) -> Vec<u16> {
    let rows = numbers.chunks(width * samples);
    let of_row = |row: &[u16]| {
        let left = |at: usize| at.checked_sub(samples).map_or(0, |left| row[left]);
        (0..row.len())
            .map(|at| row[at].wrapping_sub(left(at)))
            .collect::<Vec<_>>()
    };
    rows.flat_map(of_row).collect()
}

/// Cuts a grid into tiles of 16 by 16, which extend beyond its edges.
fn tiled<T: Copy>(grid: &Grid<T>) -> Vec<Grid<T>> {
    let corners = [(0, 0), (16, 0)].into_iter();
    let inside = |x: usize, y: usize| grid.at(x.min(grid.width() - 1), y.min(grid.height() - 1));
    corners
        .map(|(left, top)| Grid::from_fn(16, 16, |x, y| inside(left + x, top + y)))
        .collect()
}

#[test]
fn strips_and_tiles_in_planes_or_not_give_the_same_picture_however_compressed() {
    for order in TestTiff::BYTE_ORDERS {
        for compression in [UNCOMPRESSED, LZW, DEFLATE, PACK_BITS] {
            let planes = [0, 1, 2].map(|channel| picture().map(|colour| colour[channel]));
            let base = TestPage::new([20, 14], RGB, 8, 3).short(259, compression);
            let tiles = tiled(&picture()).into_iter().map(|tile| rgb_bytes(&tile));
            let plane_tiles = planes
                .iter()
                .flat_map(tiled)
                .map(|tile| tile.data().to_vec());
            let plane_strips = planes
                .iter()
                .flat_map(|plane| plane.data().chunks(20 * 5).map(<[u8]>::to_vec));
            let whole = rgb_bytes(&picture());
            let strips = whole.chunks(60 * 5).map(<[u8]>::to_vec);
            let pack = |chunk: Vec<u8>| compressed(&chunk, compression);
            for (name, page) in [
                ("strips", base.clone().strips(5, strips.map(pack).collect())),
                (
                    "tiles",
                    base.clone().tiles([16, 16], tiles.map(pack).collect()),
                ),
                (
                    "planes",
                    base.clone()
                        .short(284, 2)
                        .strips(5, plane_strips.map(pack).collect()),
                ),
                (
                    "tiled planes",
                    base.clone()
                        .short(284, 2)
                        .tiles([16, 16], plane_tiles.map(pack).collect()),
                ),
            ] {
                let read = colours(&order.encode(&[page]));
                assert_eq!(
                    read.expect(name),
                    widened(&picture()),
                    "{name}, {compression}, {order:?}"
                );
            }
        }
    }
}

#[test]
fn predictors_of_16_bits_are_undone_in_both_byte_orders() {
    let wide = picture().map(|colour| colour.map(|c| u16::from(c) * 251));
    let numbers = differences(wide.data().as_flattened(), 20, 3);
    for order in TestTiff::BYTE_ORDERS {
        for compression in [LZW, DEFLATE] {
            let bytes = numbers.iter().flat_map(|number| {
                if order.is_big_endian {
                    number.to_be_bytes()
                } else {
                    number.to_le_bytes()
                }
            });
            let strip = compressed(&bytes.collect::<Vec<_>>(), compression);
            let page = TestPage::new([20, 14], RGB, 16, 3).short(259, compression);
            let page = page.short(317, 2).strips(14, vec![strip]);
            assert_eq!(colours(&order.encode(&[page])).expect("reads"), wide);
        }
    }
}

#[test]
fn bits_stored_in_reverse_order_are_turned() {
    let bits = packed(&levels(1), 20, 1);
    let fax = group4(&levels(1));
    for (compression, bits_per_sample, strip) in [
        (UNCOMPRESSED, 1, bits),
        (4, 1, fax),
        (LZW, 8, compressed(&packed(&levels(8), 20, 8), LZW)),
        (UNCOMPRESSED, 12, packed(&levels(12), 20, 12)),
    ] {
        let page = |strip| {
            let page = TestPage::new([20, 14], BLACK_IS_ZERO, bits_per_sample, 1);
            page.short(259, compression).strips(14, vec![strip])
        };
        let reversed = strip.iter().map(|byte| byte.reverse_bits()).collect();
        let twin = TestTiff::default().encode(&[page(strip)]);
        let turned = TestTiff::default().encode(&[page(reversed).short(266, 2)]);
        let twin = colours(&twin).expect("reads");
        assert!(twin.data().contains(&[0; 3]) && twin.data().contains(&[65535; 3]));
        assert_eq!(colours(&turned).expect("reads"), twin, "{compression}");
    }
}

#[test]
fn jpeg_strips_are_read_with_and_without_shared_tables() {
    let grey = picture().map(|[r, ..]| *r);
    let mut jpeg = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95)
        .encode(grey.data(), 20, 14, image::ExtendedColorType::L8)
        .expect("encodes");
    let wanted = colours(&jpeg).expect("reads");
    let page = TestPage::new([20, 14], BLACK_IS_ZERO, 8, 1).short(259, 7);
    let whole = page.clone().strips(14, vec![jpeg.clone()]);
    assert_eq!(
        colours(&TestTiff::default().encode(&[whole])).expect("reads"),
        wanted
    );
    // The tables are the segments of quantization and Huffman tables.
    let (mut tables, mut strip, mut at) = (vec![0xff, 0xd8], vec![0xff, 0xd8], 2);
    while jpeg[at + 1] != 0xda {
        let end = at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        let is_table = matches!(jpeg[at + 1], 0xdb | 0xc4);
        if is_table { &mut tables } else { &mut strip }.extend(&jpeg[at..end]);
        at = end;
    }
    tables.extend([0xff, 0xd9]);
    strip.extend(&jpeg[at..]);
    let shared = page
        .with(347, TestValues::Bytes(tables))
        .strips(14, vec![strip]);
    assert_eq!(
        colours(&TestTiff::default().encode(&[shared])).expect("reads"),
        wanted
    );
}
