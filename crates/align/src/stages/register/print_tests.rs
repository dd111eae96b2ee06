//! Prints with unusual colours, shapes and parts, and prints of other blocks.

use crate::stages::register::RegisterError;
use crate::stages::testing::settings;
use crate::stages::{AlignedPair, Print, Scan, StageError};
use mocban_core::domain::Affine2;
use mocban_core::mesh::Mesh;
use mocban_core::raster::{Grid, ImageLimits, PrintImage, decode, resample};
use mocban_demo::{PairGenerator, Tier};

fn try_align(mesh: Mesh, print: &[u8]) -> Result<AlignedPair, StageError> {
    let print = decode(print, &ImageLimits::SUGGESTED).expect("an image");
    AlignedPair::new(&Scan::from(mesh), &Print::from(print), &settings())
}

fn align(mesh: Mesh, print: &[u8]) -> AlignedPair {
    try_align(mesh, print).expect("an alignment")
}

/// Aligns a pair, checks its landmarks, and returns the confidence.
fn confidence(tier: Tier, index: u64) -> f64 {
    let pair = PairGenerator::new(tier, 1).pair(index);
    let pair = pair.expect("images encode");
    let aligned = align(pair.mesh, &pair.print);
    let outcome = aligned.first_metric();
    let [found, wanted] = [aligned.print_from_mesh(outcome), pair.truth.print_from_mesh];
    for landmark in &pair.truth.landmarks {
        let [a, b] = [found, wanted].map(|map| map.apply(*landmark));
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]) / pair.truth.char_height_px;
        assert!(apart < 0.03, "{}: {apart}", pair.id);
    }
    outcome.confidence.expect("a confidence")
}

#[test]
fn coloured_ink_as_bright_as_the_sheet_is_aligned() {
    assert!(confidence(Tier::Coloured, 3) > 0.9);
}

#[test]
fn ink_beside_a_dark_stain_is_read_by_its_colour() {
    assert!(confidence(Tier::Coloured, 10) > 0.9);
}

#[test]
fn a_picture_that_was_scaled_unequally_is_aligned() {
    assert!(confidence(Tier::Stretched, 0) > 0.9);
}

#[test]
fn the_larger_part_of_a_torn_print_is_aligned_and_trusted_less() {
    let confidence = confidence(Tier::Torn, 9);
    assert!((0.5..0.9).contains(&confidence), "{confidence}");
    let pair = PairGenerator::new(Tier::Torn, 1).pair(9);
    let pair = pair.expect("images encode");
    let aligned = align(pair.mesh, &pair.print);
    let part = aligned.registered.outcome.displaced;
    let part = part.expect("a displaced part");
    // Parts are 1 to 3 mm apart, on characters of about 20 mm.
    let apart = part.shift_px[0].hypot(part.shift_px[1]) / pair.truth.char_height_px;
    assert!((0.03..0.2).contains(&apart), "{part:?}");
    assert!((0.05..0.48).contains(&part.ink_share), "{part:?}");
}

#[test]
fn a_torn_half_on_a_dark_ground_is_aligned() {
    assert!(confidence(Tier::HalfPrint, 8) > 0.5);
}

#[test]
fn a_print_of_12_px_is_aligned() {
    let pairs = PairGenerator::new(Tier::Hard, 12).with_vertices(Some(20_000));
    let pair = pairs.pair(3).expect("images encode");
    let full = decode(&pair.print, &ImageLimits::SUGGESTED).expect("an image");
    let sides = [full.rgb.width(), full.rgb.height()];
    let scale = 12.0 / sides[0].max(sides[1]) as f64;
    let to = sides.map(|side| (side as f64 * scale + 1e-6) as usize);
    let channel = |k: usize| {
        let values = full.rgb.map(|colour| f32::from(colour[k]));
        resample(&values, scale, [(scale - 1.0) / 2.0; 2], to)
    };
    let channels = [channel(0), channel(1), channel(2)];
    let colour = |x, y| [0, 1, 2].map(|k: usize| channels[k].at(x, y).round() as u16);
    let small = Print::from(PrintImage::from(Grid::from_fn(to[0], to[1], colour)));
    let aligned = AlignedPair::new(&Scan::from(pair.mesh), &small, &settings());
    let aligned = aligned.expect("an alignment");
    let outcome = aligned.first_metric();
    let full_from_small = Affine2::scale_shift(1.0 / scale, [(1.0 / scale - 1.0) / 2.0; 2]);
    let [found, wanted] = [aligned.print_from_mesh(outcome), pair.truth.print_from_mesh];
    for landmark in &pair.truth.landmarks {
        let [u, v, _] = found.apply(*landmark);
        let (a, b) = (full_from_small.apply([u, v]), wanted.apply(*landmark));
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]) / pair.truth.char_height_px;
        assert!(apart < 0.05, "{apart}");
    }
    // Its strokes are wider than a pixel.
    assert!(outcome.confidence.expect("a confidence") > 0.5);
}

#[test]
fn another_block_with_the_same_character_is_refused_or_doubted() {
    // The pose of the print by another hand is right.
    let (pairs, index) = (PairGenerator::new(Tier::Pose, 4), 10);
    let pair = pairs.pair(index).expect("images encode");
    let character = pair.character.chars().next().expect("a character");
    let print = pairs.print_by_another_hand(character, index + 1_000_000);
    match try_align(pair.mesh.clone(), &print.expect("images encode")) {
        Ok(other) => assert!(other.first_metric().confidence.expect("a confidence") < 0.5),
        Err(StageError::Register(RegisterError::OtherCharacter { pose, .. })) => {
            assert!(pose > 0.9);
        }
        Err(error) => panic!("{error}"),
    }
    let own = align(pair.mesh, &pair.print).first_metric().confidence;
    assert!(own.expect("a confidence") > 0.9, "{own:?}");
}

#[test]
fn white_around_coloured_ink_as_bright_as_its_sheet_is_no_background() {
    let pair = PairGenerator::new(Tier::Coloured, 5).pair(3);
    let pair = pair.expect("images encode");
    let aligned = align(pair.mesh, &pair.print);
    assert!(aligned.first_metric().confidence.expect("a confidence") > 0.9);
}
