//! Golden images of the synthetic pair, compared within a tolerance.
//!
//! `MOCBAN_REGENERATE=1 cargo test golden` rewrites them; look at the difference before committing.

use std::path::PathBuf;

use super::AlignedPair;
use super::testing::{SyntheticSheet, print, settings, some_turn};
use mocban_core::raster::{Grid, decode_grey8, png_grey8};

/// Largest difference between matching pixels, on a scale of 0 to 255.
const TOLERANCE: u8 = 12;
/// Fraction of pixels that may differ by more than `TOLERANCE`.
const OTHERS: f64 = 0.01;

fn hold(name: &str, got: &Grid<u8>) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/golden")
        .join(name);
    if std::env::var_os("MOCBAN_REGENERATE").is_some() {
        std::fs::write(&path, png_grey8(got)).expect("written");
    }
    let wanted = decode_grey8(&std::fs::read(&path).expect("a golden picture")).expect("grey");
    assert_eq!(
        (wanted.width(), wanted.height()),
        (got.width(), got.height()),
        "{name}"
    );
    let pairs = wanted.data().iter().zip(got.data());
    let differ = pairs.filter(|(a, b)| a.abs_diff(**b) > TOLERANCE).count();
    let share = differ as f64 / got.data().len() as f64;
    assert!(share < OTHERS, "{name}: {share} of the pixels differ");
}

#[test]
fn depth_map_and_mask_are_as_they_were() {
    let mut settings = settings();
    settings.depth.longest_px = 160;
    let (picture, _) = print(14.0, 3.0);
    let world = SyntheticSheet {
        turn: some_turn(2),
        ..SyntheticSheet::default()
    };
    let mesh = world.mesh();
    let aligned = AlignedPair::new(&mesh.into(), &picture, &settings).expect("an alignment");
    let levels = &aligned.depth.levels;
    hold("depth.png", &levels.map(|level| (level >> 8) as u8));
    hold(
        "mask.png",
        &aligned.registered.canvas_depths[2].map(|set| if *set { 255 } else { 0 }),
    );
}
