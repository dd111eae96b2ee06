//! Less common TIFF prints: palettes, few bits per sample, alpha, floats.

use mocban::raster::{Grid, ImageLimits, decode};

use crate::tiff_file::{FLOAT, INT, PALETTE, RGB, TiffFile, WHITE_IS_ZERO};

fn read(file: &TiffFile) -> Result<Grid<[u16; 3]>, String> {
    let picture = decode(&file.encode(), &ImageLimits::SUGGESTED);
    picture
        .map(|picture| picture.rgb.to_rgb16().into_owned())
        .map_err(|error| error.to_string())
}

fn floats(values: &[f32]) -> TiffFile {
    let data = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    TiffFile {
        format: FLOAT,
        ..TiffFile::grey(values.len() as u32, 1, 32, data)
    }
}

#[test]
fn a_palette_gives_its_colours_at_every_depth() {
    // With three columns, rows of few bits end within a byte.
    for (bits, data) in [
        (1, vec![0b0100_0000, 0b1010_0000]),
        (2, vec![0b0001_0000, 0b0100_0100]),
        (4, vec![0x01, 0x00, 0x10, 0x10]),
        (8, vec![0, 1, 0, 1, 0, 1]),
    ] {
        let mut colours = vec![0; 3 << bits];
        let reds = 1 << bits;
        (colours[1], colours[reds], colours[2 * reds + 1]) = (65535, 300, 7);
        let file = TiffFile {
            photometric: PALETTE,
            colours,
            ..TiffFile::grey(3, 2, bits, data)
        };
        let (zero, one) = ([0, 300, 0], [65535, 0, 7]);
        assert_eq!(
            read(&file).expect("reads").data(),
            [zero, one, zero, one, zero, one],
            "{bits} bits"
        );
    }
}

#[test]
fn a_pixel_outside_the_palette_is_an_error() {
    let file = TiffFile {
        photometric: PALETTE,
        colours: vec![0; 12],
        ..TiffFile::grey(2, 1, 8, vec![3, 4])
    };
    assert_eq!(
        read(&file).expect_err("no such colour"),
        "the TIFF image cannot be decoded: a pixel has the colour 4 of a palette of 4"
    );
}

#[test]
fn grey_with_alpha_is_composited_on_white() {
    let data = vec![0, 255, 0, 0, 100, 255, 0, 51];
    let plain = TiffFile {
        bits: vec![8, 8],
        extra: Some(2),
        ..TiffFile::grey(4, 1, 8, data.clone())
    };
    // Unassociated alpha, premultiplied alpha, and an extra sample of unknown meaning, which is ignored.
    for (extra, levels) in [
        (2, [0, 65535, 25700, 52428]),
        (1, [0, 65535, 25700, 52428]),
        (0, [0, 0, 25700, 0]),
    ] {
        let file = TiffFile {
            extra: Some(extra),
            ..plain.clone()
        };
        assert_eq!(
            read(&file).expect("reads").data(),
            levels.map(|level| [level; 3]),
            "extra sample {extra}"
        );
    }
    let white_is_zero = TiffFile {
        photometric: WHITE_IS_ZERO,
        extra: Some(0),
        ..plain
    };
    assert_eq!(read(&white_is_zero).expect("reads").at(0, 0), [65535; 3]);
}

#[test]
fn grey_of_any_depth_spans_black_to_white() {
    for (bits, data) in [
        (1, vec![0b0100_0000]),
        (2, vec![0b0011_0000]),
        (4, vec![0x0f]),
        (8, vec![0, 255]),
        (16, vec![0, 0, 255, 255]),
        (32, vec![0, 0, 0, 0, 255, 255, 255, 255]),
        (64, [[0; 8], [255; 8]].concat()),
    ] {
        let file = TiffFile::grey(2, 1, bits, data);
        assert_eq!(
            read(&file).expect("reads").data(),
            [[0; 3], [65535; 3]],
            "{bits} bits"
        );
        let inverted = TiffFile {
            photometric: WHITE_IS_ZERO,
            ..file
        };
        assert_eq!(
            read(&inverted).expect("reads").data(),
            [[65535; 3], [0; 3]],
            "{bits} bits"
        );
    }
}

#[test]
fn floats_are_read_when_their_range_is_unambiguous() {
    let levels = |file: &TiffFile| {
        read(file).map(|grid| grid.data().iter().map(|c| c[0]).collect::<Vec<_>>())
    };
    assert_eq!(levels(&floats(&[0.0, 0.5, 1.0])), Ok(vec![0, 32768, 65535]));
    assert_eq!(
        levels(&floats(&[0.0, 200.0, 255.0])),
        Ok(vec![0, 51400, 65535])
    );
    assert_eq!(
        levels(&floats(&[0.0, 256.0, 65535.0])),
        Ok(vec![0, 256, 65535])
    );
    for (values, says) in [
        (
            &[0.0, 1.5][..],
            "its floats go from 0 to 1.5; 0 to 1 and whole numbers to 255 or 65535 are read",
        ),
        (&[-0.5, 1.0], "its floats go from -0.5 to 1"),
        (&[0.0, 1e30], "its floats go from 0 to "),
        (&[0.0, f32::NAN], "it holds the sample NaN"),
        (&[f32::INFINITY], "it holds the sample inf"),
    ] {
        let error = levels(&floats(values)).expect_err(says);
        assert!(
            error.starts_with(&format!("the TIFF image cannot be decoded: {says}")),
            "{error}"
        );
    }
}

#[test]
fn signed_samples_and_huge_headers_are_rejected() {
    let signed = TiffFile {
        format: INT,
        ..TiffFile::grey(1, 1, 16, vec![0, 0])
    };
    let error = read(&signed).expect_err("signed");
    assert!(
        error.contains("its samples are signed or of an unknown kind"),
        "{error}"
    );
    let huge = TiffFile {
        photometric: PALETTE,
        colours: vec![0; 6],
        ..TiffFile::grey(90_000, 90_000, 1, vec![0])
    };
    let error = read(&huge).expect_err("huge");
    assert!(
        error.starts_with("the image is 90000 x 90000 pixels"),
        "{error}"
    );
    let short = TiffFile {
        height: 900,
        ..TiffFile::grey(900, 1, 4, vec![0; 450])
    };
    assert!(read(&short).is_err());
}

#[test]
fn thousands_of_samples_are_refused_in_one_sentence() {
    let file = TiffFile {
        photometric: RGB,
        bits: vec![8; 5000],
        ..TiffFile::grey(2, 2, 8, vec![0; 4])
    };
    let error = read(&file).expect_err("5000 samples a pixel");
    crate::sample_files::assert_one_sentence(&error);
    assert_eq!(
        error,
        "the TIFF image cannot be decoded: it has 5000 samples per pixel; at most 64 are read"
    );
}
