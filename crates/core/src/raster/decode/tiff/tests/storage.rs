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

/// Numbers of 12 bits from 0 to 4095, of which neighbours differ.
fn twelve_bits(width: usize, height: usize) -> Vec<u32> {
    let count = (width * height) as u32;
    (0..count).map(|at| at * 4095 / (count - 1)).collect()
}

#[test]
fn samples_in_16_bits_each_are_known_by_what_comes_out_of_a_compression() {
    let wanted = |number: u32| (f64::from(number) / 4095.0 * 65535.0).round() as u16;
    let numbers = twelve_bits(20, 14);
    for order in TestTiff::BYTE_ORDERS {
        let words = |numbers: &[u32]| -> Vec<u8> {
            let words = numbers.iter().map(|number| *number as u16);
            let bytes = words.map(|word| {
                if order.is_big_endian {
                    word.to_be_bytes()
                } else {
                    word.to_le_bytes()
                }
            });
            bytes.flatten().collect()
        };
        for compression in [UNCOMPRESSED, LZW, DEFLATE, PACK_BITS] {
            let pack = |bytes: Vec<u8>| compressed(&bytes, compression);
            let base = TestPage::new([20, 14], BLACK_IS_ZERO, 12, 1).short(259, compression);
            let strips = numbers.chunks(20 * 5);
            let grid = Grid::from_vec(20, 14, numbers.clone()).expect("a number for each pixel");
            let tiles: Vec<_> = tiled(&grid)
                .iter()
                .map(|tile| pack(words(tile.data())))
                .collect();
            let packed_strips = strips.clone().map(|strip| pack(packed(strip, 20, 12)));
            for (name, page) in [
                (
                    "padded strips",
                    base.clone()
                        .strips(5, strips.clone().map(|strip| pack(words(strip))).collect()),
                ),
                ("padded tiles", base.clone().tiles([16, 16], tiles)),
                (
                    "packed strips",
                    base.clone().strips(5, packed_strips.collect()),
                ),
            ] {
                let read = colours(&order.encode(&[page])).expect(name);
                let pairs = read.data().iter().zip(&numbers);
                for (colour, number) in pairs {
                    assert_eq!(*colour, [wanted(*number); 3], "{name}, {compression}");
                }
            }
            let plane = pack(words(&numbers));
            let planes = TestPage::new([20, 14], RGB, 12, 3)
                .short(259, compression)
                .short(284, 2)
                .strips(14, vec![plane; 3]);
            let read = colours(&order.encode(&[planes])).expect("planes");
            assert_eq!(read.at(19, 13), [65535; 3], "{compression}");
            assert_eq!(read.at(10, 5), [wanted(numbers[110]); 3], "{compression}");
        }
    }
}

#[test]
fn only_padded_samples_of_12_bits_may_have_a_predictor() {
    let numbers: Vec<u16> = twelve_bits(20, 14).iter().map(|n| *n as u16).collect();
    let words = differences(&numbers, 20, 1)
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect::<Vec<_>>();
    let page = TestPage::new([20, 14], BLACK_IS_ZERO, 12, 1)
        .short(259, DEFLATE)
        .short(317, 2);
    let padded = page.clone().strips(14, vec![compressed(&words, DEFLATE)]);
    let read = colours(&TestTiff::default().encode(&[padded])).expect("reads");
    assert_eq!((read.at(0, 0), read.at(19, 13)), ([0; 3], [65535; 3]));
    let strip = packed(&twelve_bits(20, 14), 20, 12);
    let refused = page.strips(14, vec![compressed(&strip, DEFLATE)]);
    assert_eq!(
        super::refusal(&refused),
        "the TIFF image cannot be decoded: its samples of 12 bits are stored by the predictor 2; save it without a predictor"
    );
}
