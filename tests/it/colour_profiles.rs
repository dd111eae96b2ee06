//! Prints in other colour spaces, and of cameras, have the mask and the scores of their twins in sRGB. A profile that cannot
//! be applied is named.

use std::io::Cursor;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use mocban::config::{self, Sources};
use mocban::demo::{PairGenerator, Tier};
use mocban::raster::test_profiles::TestProfile;
use mocban::raster::{Grid, ImageLimits, PrintImage, decode};
use mocban::stages::{AlignedPair, Scan, Settings};
use serde_json::json;

use crate::cli::{call, mocban};
use crate::resume::{project, run};

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
        .rgb
        .to_rgb16()
        .into_owned();
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

#[test]
fn a_profile_that_cannot_be_applied_is_told_by_run_and_kept() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "1");
    let data = project.dir().join("data");
    let print = image::open(data.join("prints/upright-0000.jpg")).expect("a print");
    let print = print.into_rgb8();
    let mut profile = TestProfile::WIDE.icc();
    profile[16..20].copy_from_slice(b"Lab ");
    let mut file = Cursor::new(Vec::new());
    let mut encoder = PngEncoder::new(&mut file);
    encoder.set_icc_profile(profile).expect("a profile");
    let (width, height) = print.dimensions();
    encoder
        .write_image(&print, width, height, ExtendedColorType::Rgb8)
        .expect("encodes");
    std::fs::write(data.join("a.png"), file.into_inner()).expect("written");
    let list = "id,mesh,print\na,meshes/upright-0000.ply,a.png\n";
    std::fs::write(data.join("one.csv"), list).expect("written");
    mocban(project.dir(), &["import", "data/one.csv"]).expect(0);
    let said = "the image's colour profile (test, for Lab colours) cannot be applied";
    let told = call(&mut run(&project, &["a"])).expect(0).err;
    assert!(told.contains(said), "{told}");
    let shown = mocban(project.dir(), &["show", "a"]).expect(0).out;
    assert!(shown.contains(said), "{shown}");
    let shown = mocban(project.dir(), &["show", "a", "--json"]).expect(0);
    let warnings = &shown.json()["warnings"];
    assert!(warnings.to_string().contains(said), "{warnings}");
    let status = mocban(project.dir(), &["status", "--json"]).expect(0);
    let counted = json!({"pairs": {"id": "a", "count": 1}});
    assert_eq!(status.json()["ignored_profiles"], counted);
}
