//! Samples of all sizes, and what they mean.

use super::{
    BLACK_IS_ZERO, ImageLimits, RGB, bilevel, colours, decode, levels, picture, plain_page, widened,
};
use crate::raster::Grid;
use crate::raster::test_images::{TestPage, TestTiff, TestValues, packed, ycbcr};
use crate::raster::test_profiles::TestProfile;

#[test]
fn grey_of_every_size_spans_black_to_white() {
    for order in TestTiff::BYTE_ORDERS {
        for bits in 1..=32_usize {
            let numbers = levels(bits);
            let strip = match bits {
                16 | 24 | 32 if !order.is_big_endian => numbers
                    .iter()
                    .flat_map(|n| n.to_le_bytes()[..bits / 8].to_vec())
                    .collect(),
                _ => packed(&numbers, 20, bits),
            };
            let page =
                TestPage::new([20, 14], BLACK_IS_ZERO, bits as u16, 1).strips(14, vec![strip]);
            let read = colours(&order.encode(&[page]));
            assert_eq!(read.expect("reads"), bilevel(), "{bits} bits, {order:?}");
        }
    }
    let ramp: Vec<u32> = (0..4096).collect();
    let page =
        TestPage::new([4096, 1], BLACK_IS_ZERO, 12, 1).strips(1, vec![packed(&ramp, 4096, 12)]);
    let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
    for (number, colour) in ramp.iter().zip(read.data()) {
        let level = (f64::from(*number) / 4095.0 * 65535.0).round() as u16;
        assert_eq!(*colour, [level; 3]);
    }
}

#[test]
fn ten_bits_in_sixteen_span_black_to_white_whatever_the_tags_say() {
    let low = levels(10);
    for (bits_per_sample, numbers) in [
        (10, low.clone()),
        (10, low.iter().map(|number| number << 6).collect()),
        (16, low),
        (16, levels(12)),
    ] {
        let words = numbers
            .iter()
            .flat_map(|number| (*number as u16).to_le_bytes());
        let page = TestPage::new([20, 14], BLACK_IS_ZERO, bits_per_sample, 1);
        let page = page.strips(14, vec![words.collect()]);
        let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
        let is_black = |grid: &Grid<[u16; 3]>| grid.map(|[r, ..]| *r == 0);
        assert_eq!(is_black(&read), is_black(&bilevel()), "{bits_per_sample}");
        assert!(
            read.data()
                .iter()
                .flatten()
                .all(|c| *c == 0 || *c >= 65535 - 64)
        );
    }
}

#[test]
fn ten_bits_in_sixteen_span_white_to_black_if_white_is_zero() {
    for bits in [9, 10, 12, 16] {
        // The paper is 0, and the ink has all bits.
        let inks = levels(bits)
            .into_iter()
            .map(|number| if number == 0 { (1 << bits) - 1 } else { 0 });
        let words = inks.flat_map(|number: u32| (number as u16).to_le_bytes());
        let page = TestPage::new([20, 14], 0, 16, 1).strips(14, vec![words.collect()]);
        let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
        let is_dark = |grid: &Grid<[u16; 3]>| grid.map(|[r, ..]| *r < 33_000);
        assert_eq!(is_dark(&read), is_dark(&bilevel()), "{bits}");
        let white = read.data().iter().filter(|colour| **colour == [65535; 3]);
        let paper = bilevel()
            .data()
            .iter()
            .filter(|colour| **colour == [65535; 3])
            .count();
        assert_eq!(white.count(), paper, "{bits}");
    }
}

#[test]
fn samples_of_an_undefined_kind_are_unsigned() {
    let page = plain_page(&picture()).short(339, 4);
    let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
    assert_eq!(read, widened(&picture()));
}

#[test]
fn a_palette_of_8_bit_colours_is_widened() {
    let read = |white: u16| {
        let mut palette = vec![white; 3 * 256];
        (palette[0], palette[256], palette[512]) = (white / 10, 0, white / 5);
        let page = TestPage::new([20, 14], 3, 8, 1).with(320, TestValues::Shorts(palette));
        let page = page.strips(14, vec![packed(&levels(8), 20, 8)]);
        colours(&TestTiff::default().encode(&[page])).expect("reads")
    };
    let (wide, narrow) = (read(255 * 257), read(255));
    assert_eq!(narrow.at(0, 0), [65535; 3]);
    let close = |a: &[u16; 3], b: &[u16; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) < 257);
    assert!(
        wide.data()
            .iter()
            .zip(narrow.data())
            .all(|(a, b)| close(a, b))
    );
}

#[test]
fn luma_and_chroma_are_read_without_compression() {
    // Blocks of 4 by 4 pixels share a colour, so that shared chroma loses nothing.
    let blocks = Grid::from_fn(22, 14, |x, y| picture().at(x / 4 * 4 % 20, y / 4 * 4));
    let coded = blocks.map(|colour| ycbcr(*colour));
    for (across, down) in [(1, 1), (2, 1), (2, 2), (1, 2), (4, 4)] {
        let mut strip = Vec::new();
        for top in (0..14).step_by(down) {
            for left in (0..22).step_by(across) {
                let at = |x: usize, y: usize| coded.at((left + x).min(21), (top + y).min(13));
                strip.extend((0..down).flat_map(|y| (0..across).map(move |x| at(x, y)[0])));
                strip.extend(&at(0, 0)[1..]);
            }
        }
        let page = TestPage::new([22, 14], 6, 8, 3);
        let shared = TestValues::Shorts(vec![across as u16, down as u16]);
        let page = page.with(530, shared).strips(14, vec![strip]);
        // The factors of the default, and the range that programs for JPEG write.
        let page = page.with(
            529,
            TestValues::Ratios(vec![[299, 1000], [587, 1000], [114, 1000]]),
        );
        let range = [0, 255, 128, 255, 128, 255].map(|value| [value, 1]);
        let page = page.with(532, TestValues::Ratios(range.to_vec()));
        let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
        let wanted = widened(&blocks);
        let pairs = read
            .data()
            .as_flattened()
            .iter()
            .zip(wanted.data().as_flattened());
        let most = pairs.map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most < Some(3 * 257), "{across} x {down}: {most:?}");
    }
}

#[test]
fn every_integer_type_of_a_tag_is_read() {
    for (tag, value) in [(256, 20), (262, 2), (274, 6), (277, 3), (278, 14), (284, 1)] {
        let wanted = plain_page(&picture()).short(274, 6);
        let wanted = colours(&TestTiff::default().encode(&[wanted])).expect("reads");
        for order in TestTiff::BYTE_ORDERS {
            for values in [
                TestValues::Bytes(vec![value]),
                TestValues::Shorts(vec![u16::from(value)]),
                TestValues::Longs(vec![u32::from(value)]),
                TestValues::SignedLongs(vec![i32::from(value)]),
                TestValues::Longs8(vec![u64::from(value)]),
            ] {
                let page = plain_page(&picture())
                    .short(274, 6)
                    .with(tag, values.clone());
                let read = colours(&order.encode(&[page])).expect("reads");
                assert_eq!(read, wanted, "{tag}: {values:?}, {order:?}");
            }
        }
    }
}

#[test]
fn transparency_is_composited_on_white_once() {
    for (kind, levels) in [(2, [0, 255, 51]), (1, [0, 255, 51]), (0, [0, 0, 0])] {
        let alphas = levels.map(|alpha: u8| [0, 0, 0, alpha]);
        let page = TestPage::new([3, 1], RGB, 8, 4).short(338, kind);
        let page = page.strips(1, vec![alphas.as_flattened().to_vec()]);
        let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
        let wanted = match kind {
            0 => [[0; 3]; 3],
            _ => [[65535; 3], [0; 3], [52428; 3]],
        };
        assert_eq!(read.data(), wanted, "extra sample {kind}");
    }
}

#[test]
fn cmyk_leaves_the_light_that_its_inks_do_not_take() {
    let page = TestPage::new([2, 1], 5, 8, 4).strips(1, vec![vec![0, 255, 51, 0, 0, 0, 0, 204]]);
    let read = colours(&TestTiff::default().encode(&[page])).expect("reads");
    assert_eq!(read.data(), [[65535, 0, 52428], [13107; 3]]);
}

#[test]
fn a_colour_profile_of_inks_is_named() {
    let mut of_inks = TestProfile::WIDE.icc();
    of_inks[16..20].copy_from_slice(b"CMYK");
    let page = TestPage::new([2, 1], 5, 8, 4)
        .with(34675, TestValues::Bytes(of_inks))
        .strips(1, vec![vec![0, 255, 51, 0, 0, 0, 0, 204]]);
    let read = decode(
        &TestTiff::default().encode(&[page]),
        &ImageLimits::SUGGESTED,
    );
    let read = read.expect("reads");
    assert_eq!(
        read.ignored_profile.as_deref(),
        Some("test, for CMYK colours")
    );
    assert_eq!(read.rgb.to_rgb16().data(), [[65535, 0, 52428], [13107; 3]]);
}

#[test]
fn a_transfer_function_is_applied_or_named() {
    let read = |photometric: u16, lights: Vec<u16>| {
        let page = TestPage::new([3, 1], photometric, 8, 1)
            .with(301, TestValues::Shorts(lights))
            .strips(1, vec![vec![0, 100, 255]]);
        let file = TestTiff::default().encode(&[page]);
        decode(&file, &ImageLimits::SUGGESTED).expect("reads")
    };
    let linear: Vec<u16> = (0..256).map(|level| level * 257).collect();
    let found = read(BLACK_IS_ZERO, linear.clone());
    // The level of sRGB of the light 100 / 255.
    let level = (1.055 * (100.0_f64 / 255.0).powf(1.0 / 2.4) - 0.055) * 65535.0;
    assert_eq!(
        found.rgb.to_rgb16().data(),
        [[0; 3], [level.round() as u16; 3], [65535; 3]]
    );
    assert_eq!(found.ignored_profile, None);
    for (photometric, lights, level) in [(0, linear, 155), (BLACK_IS_ZERO, vec![0; 7], 100)] {
        let found = read(photometric, lights);
        let named = found.ignored_profile.as_deref();
        assert_eq!(named, Some("TIFF transfer function"));
        assert_eq!(found.rgb.at(1, 0), [level * 257; 3]);
    }
}
