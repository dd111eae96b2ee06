//! Prints in other colour spaces, and of cameras, have the mask and the scores of their twins in sRGB.

use std::io::Cursor;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use mocban::config::{self, Sources};
use mocban::demo::{PairGenerator, Tier};
use mocban::raster::test_profiles::TestProfile;
use mocban::raster::{Grid, ImageLimits, PrintImage, decode};
use mocban::stages::{AlignedPair, Scan, Settings};

/// Encodes colours of 16 bits, or their red as grey, with an ICC profile.
fn png(rgb: &Grid<[u16; 3]>, is_grey: bool, profile: Option<TestProfile>) -> PrintImage {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = PngEncoder::new(&mut file);
    if let Some(profile) = profile {
        encoder.set_icc_profile(profile.icc()).expect("a profile");
    }
    let channels = if is_grey { 1 } else { 3 };
    let levels = rgb.data().iter().flat_map(|colour| &colour[..channels]);
    let bytes: Vec<u8> = levels.flat_map(|level| level.to_ne_bytes()).collect();
    let (width, height) = (rgb.width() as u32, rgb.height() as u32);
    let kind = if is_grey {
        ExtendedColorType::L16
    } else {
        ExtendedColorType::Rgb16
    };
    encoder
        .write_image(&bytes, width, height, kind)
        .expect("encodes");
    let image = decode(&file.into_inner(), &ImageLimits::SUGGESTED).expect("decodes");
    assert_eq!(image.profile_warning(), None);
    image
}

/// Asserts that two prints of a mesh have the same mask, pose and scores, but for rounding.
fn assert_same_results(
    scan: &Scan,
    settings: &Settings,
    [plain, other]: [PrintImage; 2],
    name: &str,
) {
    let [plain, other] = [plain, other]
        .map(|print| AlignedPair::new(scan, &print.into(), settings).expect("an alignment"));
    let overlap = plain
        .registered
        .canvas_print
        .overlap(&other.registered.canvas_print);
    assert!(overlap.iou > 0.99, "{name}: {}", overlap.iou);
    for (a, b) in plain.metrics().iter().zip(other.metrics()) {
        let turn = (a.angle_deg - b.angle_deg).abs();
        let differences = [
            a.scores.ssim - b.scores.ssim,
            a.scores.iou - b.scores.iou,
            a.scores.dice - b.scores.dice,
        ];
        let most = differences.map(f64::abs).into_iter().fold(0.0, f64::max);
        assert!(turn < 0.2 && most < 0.01, "{name}: {turn} degrees, {most}");
    }
}

#[test]
fn a_print_has_the_results_of_its_srgb_twin() {
    let loaded = config::load(&Sources::default()).expect("the defaults are sound");
    let settings = loaded.config.stages;
    let pair = PairGenerator::new(Tier::Pose, 57)
        .pair(0)
        .expect("the pair is made");
    let print = decode(&pair.print, &ImageLimits::SUGGESTED)
        .expect("a picture")
        .rgb;
    let scan = Scan::from(pair.mesh);
    let grey = print.map(|[_, green, _]| [*green; 3]);
    for (name, profile, is_grey) in [
        ("grey, gamma 1.8", TestProfile::GREY, true),
        ("grey, linear", TestProfile::LINEAR_GREY, true),
        ("wide gamut", TestProfile::WIDE, false),
    ] {
        let srgb = if is_grey { &grey } else { &print };
        let twin = png(&profile.twin(srgb), is_grey, Some(profile));
        let both = [png(srgb, is_grey, None), twin];
        assert_same_results(&scan, &settings, both, name);
    }
    // A camera of 10 bits stores its numbers without scaling.
    let narrow = grey.map(|colour| colour.map(|level| level >> 6));
    let both = [png(&grey, true, None), png(&narrow, true, None)];
    assert_same_results(&scan, &settings, both, "10 bits in 16");
}
