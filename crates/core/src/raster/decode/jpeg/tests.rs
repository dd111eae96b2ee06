//! Tests of the JPEG decoder, with files that are made by code.

use super::super::{DecodeError, ImageLimits, PrintImage, decode};
use crate::domain::FileKind;
use crate::domain::cancel::{CancelToken, Cancelled};
use crate::raster::Grid;
use crate::raster::test_images::{TestJpeg, TestScans};
use crate::raster::test_profiles::TestProfile;

const SHARED: [[usize; 2]; 4] = [[1, 1], [2, 1], [1, 2], [2, 2]];
const SEPARATE: TestScans = TestScans::Separate([0, 1, 2]);

/// Returns a smooth picture with sides that are no multiples of blocks.
fn picture() -> Grid<[u8; 3]> {
    Grid::from_fn(45, 37, |x, y| {
        let wave = |at: usize, length: f64| (at as f64 / length).sin() * 60.0 + 128.0;
        [wave(x, 9.0), wave(y, 7.0), wave(x + 2 * y, 15.0)].map(|level| level as u8)
    })
}

fn read(bytes: &[u8]) -> Result<PrintImage, DecodeError> {
    decode(bytes, &ImageLimits::SUGGESTED)
}

/// Returns the largest difference of a colour, in levels of 255.
fn most_different(image: &PrintImage, wanted: &Grid<[u8; 3]>) -> u16 {
    assert_eq!(
        (image.rgb.width(), image.rgb.height()),
        (wanted.width(), wanted.height())
    );
    let read = image.rgb.to_rgb16();
    let levels = read.data().as_flattened().iter().map(|level| level / 257);
    let wanted = wanted.data().as_flattened().iter();
    levels
        .zip(wanted)
        .map(|(a, b)| a.abs_diff(u16::from(*b)))
        .max()
        .unwrap_or(0)
}

#[test]
fn components_in_scans_of_their_own_give_the_picture_however_chroma_is_shared() {
    for shared in SHARED {
        for scans in [
            TestScans::Interleaved,
            SEPARATE,
            TestScans::Separate([1, 2, 0]),
            TestScans::Progressive,
        ] {
            let image = read(&TestJpeg { shared, scans }.encode(&picture(), &[])).expect("reads");
            let most = most_different(&image, &picture());
            assert!(most <= 16, "{shared:?}, {scans:?}: {most}");
        }
    }
}

#[test]
fn a_missing_component_and_scans_of_two_components_are_refused() {
    let file = TestJpeg {
        shared: [2, 2],
        scans: SEPARATE,
    }
    .encode(&picture(), &[]);
    let scans: Vec<usize> = (0..file.len() - 1)
        .filter(|at| file[*at..at + 2] == [0xff, 0xda])
        .collect();
    // The last scan is cut away.
    let missing = [&file[..scans[2]], &[0xff, 0xd9]].concat();
    assert_eq!(
        read(&missing).expect_err("refused").to_string(),
        "the JPEG image cannot be decoded: one of its colours is missing"
    );
    // The header of the second scan names two components.
    let mut joined = file.clone();
    joined.splice(scans[1] + 2..scans[1] + 7, [0, 10, 2, 2, 0, 3, 0]);
    assert_eq!(
        read(&joined).expect_err("refused").to_string(),
        "the JPEG image cannot be decoded: its colours are coded in several scans of different sizes; save it as a \
         usual JPEG or as PNG"
    );
}

#[test]
fn a_whole_image_without_an_end_marker_is_read_also_with_a_trailer() {
    for scans in [TestScans::Interleaved, SEPARATE, TestScans::Progressive] {
        let file = TestJpeg {
            shared: [2, 2],
            scans,
        }
        .encode(&picture(), &[]);
        let whole = read(&file).expect("reads");
        let (data, end) = file.split_at(file.len() - 2);
        let trailer = b"SEFHe\0\0\0\x01\0\0\0vendor {\"model\": 7}SEFT";
        for (name, bytes) in [
            ("without an end", data.to_vec()),
            ("half an end", [data, &end[..1]].concat()),
            ("a trailer", [&file[..], trailer].concat()),
            ("a trailer in place of the end", [data, trailer].concat()),
            ("a second image", [&file[..], &file].concat()),
        ] {
            assert_eq!(read(&bytes).expect(name), whole, "{name}, {scans:?}");
        }
    }
}

#[test]
fn an_image_that_ends_early_is_truncated() {
    let truncated = DecodeError::Truncated(FileKind::Jpeg);
    for scans in [TestScans::Interleaved, SEPARATE, TestScans::Progressive] {
        let file = TestJpeg {
            shared: [2, 2],
            scans,
        }
        .encode(&picture(), &[]);
        for len in (20..file.len() - 12).step_by(7) {
            assert_eq!(
                read(&file[..len]),
                Err(truncated.clone()),
                "{scans:?}: {len}"
            );
        }
        let last_scan = (0..file.len())
            .rev()
            .find(|at| file[*at..].starts_with(&[0xff, 0xda]));
        let without = &file[..last_scan.expect("a scan")];
        assert_eq!(read(without), Err(truncated.clone()), "{scans:?}");
    }
}

fn segment(marker: u8, body: &[&[u8]]) -> Vec<u8> {
    let body = body.concat();
    let len = (body.len() as u16 + 2).to_be_bytes();
    [&[0xff, marker], &len[..], &body].concat()
}

#[test]
fn an_orientation_of_four_bytes_turns_the_image() {
    let exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x04\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
    let test = TestJpeg {
        shared: [2, 2],
        scans: TestScans::Interleaved,
    };
    let plain = read(&test.encode(&picture(), &[])).expect("reads");
    let turned = read(&test.encode(&picture(), &[segment(0xe1, &[exif])])).expect("reads");
    assert_eq!((plain.turned, turned.turned), (None, Some(6)));
    assert_eq!((turned.rgb.width(), turned.rgb.height()), (37, 45));
    assert_eq!(turned.rgb.at(36, 0), plain.rgb.at(0, 0));
    assert_eq!(turned.rgb.at(0, 44), plain.rgb.at(44, 36));
}

/// Encodes 8 x 8 equal pixels with four stored components, as Adobe programs save CMYK: 255 is a place without ink.
fn cmyk(stored: [u8; 4]) -> Vec<u8> {
    let mut bits = String::new();
    for value in stored {
        // The quantization makes the average a difference from 128. Each size has a code of four bits.
        let average = i32::from(value) - 128;
        let size = 32 - average.unsigned_abs().leading_zeros() as usize;
        let coded = if average < 0 { average - 1 } else { average } & ((1 << size) - 1);
        bits.extend([format!("{size:04b}")]);
        if size > 0 {
            bits.extend([format!("{coded:0size$b}")]);
        }
        // There is no other coefficient.
        bits.push('0');
    }
    while !bits.len().is_multiple_of(8) {
        bits.push('1');
    }
    let bytes = bits.as_bytes().chunks(8);
    let byte = |bits: &[u8]| {
        bits.iter()
            .fold(0, |byte: u8, bit| byte << 1 | (bit - b'0'))
    };
    let mut coded = Vec::new();
    for byte in bytes.map(byte) {
        coded.push(byte);
        if byte == 0xff {
            coded.push(0);
        }
    }
    let components: Vec<u8> = (1..=4).flat_map(|id| [id, 0x11, 0]).collect();
    let tables: Vec<u8> = (1..=4).flat_map(|id| [id, 0]).collect();
    let lengths = |length: usize, count: u8| {
        let mut lengths = [0; 16];
        lengths[length - 1] = count;
        lengths
    };
    let sizes: Vec<u8> = (0..12).collect();
    [
        b"\xff\xd8".to_vec(),
        segment(0xee, &[b"Adobe\0\x64\0\0\0\0\0"]),
        segment(0xdb, &[&[0], &[8; 64]]),
        segment(0xc0, &[&[8, 0, 8, 0, 8, 4], &components]),
        segment(0xc4, &[&[0], &lengths(4, 12), &sizes]),
        segment(0xc4, &[&[0x10], &lengths(1, 1), &[0]]),
        segment(0xda, &[&[4], &tables, &[0, 63, 0]]),
        coded,
        b"\xff\xd9".to_vec(),
    ]
    .concat()
}

#[test]
fn cmyk_leaves_the_light_that_its_inks_do_not_take() {
    for (stored, wanted) in [
        ([255; 4], [255; 3]),
        ([0, 255, 255, 255], [0, 255, 255]),
        ([255, 0, 255, 255], [255, 0, 255]),
        ([255, 255, 0, 255], [255, 255, 0]),
        ([255, 255, 255, 0], [0; 3]),
        ([128, 255, 64, 255], [128, 255, 64]),
        ([255, 255, 255, 90], [90; 3]),
    ] {
        let image = read(&cmyk(stored)).expect("an image");
        let wanted: Grid<[u8; 3]> = Grid::new(8, 8, wanted);
        assert!(most_different(&image, &wanted) <= 2, "{stored:?}");
    }
}

#[test]
fn a_colour_profile_in_several_segments_is_applied() {
    let profile = TestProfile::WIDE.icc();
    let (first, second) = profile.split_at(200);
    let part = |number, part| segment(0xe2, &[b"ICC_PROFILE\0", &[number, 2], part]);
    let test = TestJpeg {
        shared: [1, 1],
        scans: TestScans::Interleaved,
    };
    let wide = picture().map(|colour| colour.map(|c| u16::from(c) * 257));
    let twin = TestProfile::WIDE
        .twin(&wide)
        .map(|colour| colour.map(|c| (c / 257) as u8));
    // The segments are in the wrong order.
    let segments = [part(2, second), part(1, first)];
    let image = read(&test.encode(&twin, &segments)).expect("reads");
    assert_eq!(image.profile_warning(), None);
    let most = most_different(&image, &picture());
    assert!(most < 20, "{most}");
    let plain = read(&test.encode(&twin, &[])).expect("reads");
    assert!(most_different(&plain, &picture()) > 40);
    // Without its second part, the profile does not count.
    let half = read(&test.encode(&twin, &segments[1..])).expect("reads");
    assert!(half.profile_warning().is_some());
}

#[test]
fn a_colour_profile_of_inks_is_named() {
    let plain = cmyk([128, 255, 64, 255]);
    let mut of_inks = TestProfile::WIDE.icc();
    of_inks[16..20].copy_from_slice(b"CMYK");
    let profile = segment(0xe2, &[b"ICC_PROFILE\0", &[1, 1], &of_inks]);
    let named = read(&[&plain[..2], &profile, &plain[2..]].concat()).expect("reads");
    assert_eq!(
        named.ignored_profile.as_deref(),
        Some("test, for CMYK colours")
    );
    assert_eq!(named.rgb, read(&plain).expect("reads").rgb);
}

#[test]
fn a_colour_profile_without_its_first_part_is_named() {
    let test = TestJpeg {
        shared: [1, 1],
        scans: TestScans::Interleaved,
    };
    let second = segment(0xe2, &[b"ICC_PROFILE\0", &[2, 2], b"rest"]);
    let named = read(&test.encode(&picture(), &[second])).expect("reads");
    let wanted = "an ICC profile that cannot be read";
    assert_eq!(named.ignored_profile.as_deref(), Some(wanted));
}

#[test]
fn codings_that_are_not_read_are_named() {
    let file = TestJpeg {
        shared: [1, 1],
        scans: TestScans::Interleaved,
    }
    .encode(&picture(), &[]);
    let frame = (0..file.len())
        .find(|at| file[*at..].starts_with(&[0xff, 0xc0]))
        .expect("a frame");
    for (at, value, says) in [
        (1, 0xc3, "coded without loss"),
        (1, 0xc9, "coded by arithmetic coding"),
        (1, 0xc5, "coded in several frames"),
        (4, 12, "a JPEG of 12 bits per sample"),
    ] {
        let mut other = file.clone();
        other[frame + at] = value;
        assert_eq!(
            read(&other).expect_err("refused").to_string(),
            format!(
                "the JPEG image cannot be decoded: it is {says}; save it as a usual JPEG of 8 bits, or as PNG"
            )
        );
    }
}

#[test]
fn a_cancellation_ends_the_decoding_of_every_kind() {
    let small = picture();
    let large = Grid::from_fn(500, 500, |x, y| small.at(x % 45, y % 37));
    for scans in [TestScans::Interleaved, SEPARATE, TestScans::Progressive] {
        let file = TestJpeg {
            shared: [2, 2],
            scans,
        }
        .encode(&large, &[]);
        let token = CancelToken::default();
        let whole = token
            .run(|| read(&file))
            .expect("not cancelled")
            .expect("reads");
        assert_eq!(read(&file).as_ref(), Ok(&whole));
        // Components in scans of their own are put together row by row.
        let rows = if scans == SEPARATE { 500 } else { 0 };
        let reads = file.len() as u64 / 4 / 4096;
        assert!(
            token.polls() > rows + reads,
            "{scans:?}: {} polls",
            token.polls()
        );
        for poll in [1, 2, rows.max(3)] {
            let token = CancelToken::cancelled_at(poll);
            assert_eq!(
                token.run(|| read(&file)),
                Err(Cancelled),
                "{scans:?}: {poll}"
            );
        }
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(150))]
    #[test]
    fn changed_bytes_never_panic(
        scans in proptest::sample::select(vec![TestScans::Interleaved, SEPARATE, TestScans::Progressive]),
        shared in proptest::sample::select(SHARED.to_vec()),
        flips in proptest::collection::vec((proptest::prelude::any::<proptest::sample::Index>(), proptest::prelude::any::<u8>()), 1..6),
    ) {
        let limits = ImageLimits { max_bytes: 1 << 20, max_pixels: 10_000 };
        let mut file = TestJpeg { shared, scans }.encode(&picture(), &[]);
        for (at, value) in flips {
            let at = at.index(file.len());
            file[at] = value;
        }
        if let Ok(image) = decode(&file, &limits) {
            proptest::prop_assert!((image.rgb.width() * image.rgb.height()) as u64 <= limits.max_pixels);
        }
    }
}
