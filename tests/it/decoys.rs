//! Pairs that have no correct alignment are refused: a print of another character, a mirrored mesh, an uncarved plate.

use std::sync::LazyLock;

use mocban::demo::{PairGenerator, Tier};
use mocban::mesh::Mesh;
use mocban::raster;
use mocban::stages::{AlignedPair, Settings, StageError};
use rayon::prelude::*;

use crate::decoy::{Decoy, DecoyPair, LOOK_ALIKES, decoy_pair};
use crate::semi_real::settings;

/// Number of pairs per kind and tier.
const COUNT: u64 = 3;

fn made(tier: Tier, seed: u64, kind: Decoy, index: u64) -> DecoyPair {
    decoy_pair(&PairGenerator::new(tier, seed), kind, index).expect("images encode")
}

/// Aligns a pair. Returns the highest confidence of a metric.
fn align(decoy: &DecoyPair, settings: &Settings) -> Result<f64, StageError> {
    let print =
        raster::decode(&decoy.print, &raster::ImageLimits::SUGGESTED).expect("a print image");
    let aligned = AlignedPair::new(&decoy.mesh.clone().into(), &print.into(), settings)?;
    let metrics = aligned.registered.outcome.metrics.iter();
    Ok(metrics
        .filter_map(|metric| metric.confidence)
        .fold(0.0, f64::max))
}

/// A decoy that must be refused.
struct AlignedDecoy {
    tier: Tier,
    kind: Decoy,
    index: u64,
    /// The highest confidence of a metric, or why it was refused.
    outcome: Result<f64, String>,
}

/// The outcome of each decoy that must be refused. Two tests read them.
static ALIGNED: LazyLock<Vec<AlignedDecoy>> = LazyLock::new(|| {
    let settings = settings();
    // Not every print with nearly the same strokes is refused.
    let doubted = [Decoy::LookAlike, Decoy::AnotherHand, Decoy::BrushWriting];
    let is_refused = |kind: &Decoy| !doubted.contains(kind);
    let kinds = || Decoy::ALL.into_iter().filter(is_refused);
    let cases: Vec<(Tier, Decoy, u64)> = [Tier::Upright, Tier::Pose]
        .into_iter()
        .flat_map(|tier| kinds().map(move |kind| (tier, kind)))
        .flat_map(|(tier, kind)| (0..COUNT).map(move |index| (tier, kind, index)))
        .collect();
    let aligned = cases.into_par_iter().map(|(tier, kind, index)| {
        let outcome = align(&made(tier, 77, kind, index), &settings);
        AlignedDecoy {
            tier,
            kind,
            index,
            outcome: outcome.map_err(|error| error.to_string()),
        }
    });
    aligned.collect()
});

#[test]
fn pairs_that_do_not_belong_together_are_refused() {
    let accepted: Vec<String> = ALIGNED
        .iter()
        .filter_map(|decoy| {
            let sure = decoy.outcome.as_ref().ok()?;
            let (tier, index, kind) = (decoy.tier, decoy.index, decoy.kind.name());
            Some(format!("{tier} {index}: {kind}, confidence {sure:.3}"))
        })
        .collect();
    assert!(
        accepted.is_empty(),
        "aligned without an error: {}",
        accepted.join(", ")
    );
}

#[test]
fn no_look_alikes_are_listed_twice() {
    let mut listed = LOOK_ALIKES.map(|mut pair| {
        assert_ne!(pair[0], pair[1]);
        pair.sort_unstable();
        pair
    });
    listed.sort_unstable();
    let twice = listed.windows(2).find(|pairs| pairs[0] == pairs[1]);
    assert_eq!(twice, None);
}

#[test]
fn look_alikes_are_pairs_of_different_characters() {
    let pairs = PairGenerator::new(Tier::Upright, 3).with_vertices(Some(2000));
    for index in [0, LOOK_ALIKES.len() as u64] {
        let decoy = decoy_pair(&pairs, Decoy::LookAlike, index).expect("images encode");
        let [carved, printed] = if index == 0 {
            ['申', '甲']
        } else {
            ['甲', '申']
        };
        let pair = |character, index| pairs.pair_of(character, index).expect("images encode");
        let (mesh, print) = (pair(carved, index).mesh, pair(printed, index + 1).print);
        assert!(decoy == DecoyPair { mesh, print });
        assert_eq!(pair(carved, index).character, carved.to_string());
    }
}

/// Returns the normal of a triangle, twice its area in length.
fn area_vector(mesh: &Mesh, triangle: [u32; 3]) -> [f64; 3] {
    let [a, b, c] = triangle.map(|corner| mesh.vertices.at(corner as usize));
    let side = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] - a[i]);
    let (u, v) = (side(b), side(c));
    [0, 1, 2].map(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3])
}

#[test]
fn mirrored_decoy_reflects_each_face_and_keeps_it_outward() {
    let mesh = PairGenerator::new(Tier::Pose, 3)
        .pair(0)
        .expect("images encode")
        .mesh;
    let reflected = made(Tier::Pose, 3, Decoy::Mirrored, 0).mesh;
    for (before, after) in mesh.triangles.iter().zip(&reflected.triangles) {
        let [x, y, z] = area_vector(&mesh, *before);
        let found = area_vector(&reflected, *after);
        let size = x.hypot(y).hypot(z);
        for (value, expected) in found.into_iter().zip([-x, y, z]) {
            assert!((value - expected).abs() <= 1e-9 * size);
        }
    }
}

#[test]
fn wrong_print_decoy_has_the_print_of_another_pair() {
    for tier in [Tier::Upright, Tier::Real] {
        let own = PairGenerator::new(tier, 3).pair(19).expect("images encode");
        let decoy = made(tier, 3, Decoy::WrongPrint, 19);
        assert!(decoy.mesh == own.mesh);
        assert!(decoy.print != own.print);
    }
}

#[test]
fn uncarved_decoy_is_flat_within_the_noise() {
    for index in 0..8 {
        let pairs = PairGenerator::new(Tier::Upright, 3);
        let pair = pairs.pair(index).expect("images encode");
        if pair.is_closed {
            continue;
        }
        let plane = pair.truth.plane;
        let mesh = made(Tier::Upright, 3, Decoy::Uncarved, index).mesh;
        // Upright meshes are in millimetres.
        let highest = mesh
            .vertices
            .iter()
            .map(|vertex| {
                let height = (0..3).map(|i| plane.n[i] * vertex[i]).sum::<f64>() + plane.d;
                height.abs()
            })
            .fold(0.0, f64::max);
        assert!(highest < 0.02, "{index}: {highest} mm");
    }
}

/// Returns why a pair is refused, or `None` if it is not. Other tests count those.
fn refusal(decoy: &DecoyPair) -> Option<String> {
    align(decoy, &settings())
        .err()
        .map(|error| error.to_string())
}

/// Two blocks beside each other in one file, with the print of a third.
fn two_pieces(index: u64) -> DecoyPair {
    let mut wrong = made(Tier::Upright, 77, Decoy::WrongPrint, index);
    let second = made(Tier::Upright, 77, Decoy::WrongPrint, index + 7).mesh;
    let across = |mesh: &Mesh| -> Vec<f64> {
        let places = 0..mesh.vertices.len();
        places.map(|place| mesh.vertices.at(place)[0]).collect()
    };
    let end = across(&wrong.mesh).into_iter().fold(f64::MIN, f64::max);
    let start = across(&second).into_iter().fold(f64::MAX, f64::min);
    let first = wrong.mesh.vertices.len() as u32;
    for place in 0..second.vertices.len() {
        let [x, y, z] = second.vertices.at(place);
        wrong.mesh.vertices.push([x - start + end + 2.0, y, z]);
    }
    for corners in &second.triangles {
        wrong.mesh.triangles.push(corners.map(|at| at + first));
    }
    wrong
}

/// The back of a block, with traces of tools that are a tenth as deep as a carving.
fn rough_back(index: u64) -> DecoyPair {
    let mut wrong = made(Tier::Upright, 77, Decoy::WrongPrint, index);
    let pair = PairGenerator::new(Tier::Upright, 77).pair(index);
    let plane = pair.expect("images encode").truth.plane;
    wrong.mesh.vertices.map_in_place(|vertex| {
        let height = (0..3).map(|i| plane.n[i] * vertex[i]).sum::<f64>() + plane.d;
        [0, 1, 2].map(|i| vertex[i] - 0.9 * height * plane.n[i])
    });
    wrong
}

/// A pair whose print is folded: the right half is turned by 30 degrees about the centre.
fn folded(index: u64) -> DecoyPair {
    let pair = PairGenerator::new(Tier::Upright, 1).pair(index);
    let pair = pair.expect("images encode");
    let print = raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED).expect("an image");
    let flat = print.rgb.to_rgb8();
    let (width, height) = (flat.width(), flat.height());
    let paper = flat.at(1, 1);
    let (sin, cos) = 30_f64.to_radians().sin_cos();
    let [mid_x, mid_y] = [width, height].map(|side| side as f64 / 2.0);
    let picture = raster::Grid::from_fn(width, height, |x, y| {
        if x < width / 2 {
            return flat.at(x, y);
        }
        let (dx, dy) = (x as f64 - mid_x, y as f64 - mid_y);
        let from = [mid_x + cos * dx - sin * dy, mid_y + sin * dx + cos * dy].map(f64::round);
        let is_inside =
            from[0] >= 0.0 && from[1] >= 0.0 && from[0] < width as f64 && from[1] < height as f64;
        if is_inside {
            flat.at(from[0] as usize, from[1] as usize)
        } else {
            paper
        }
    });
    DecoyPair {
        mesh: pair.mesh,
        print: raster::png_rgb8(&picture),
    }
}

#[test]
fn a_print_that_matches_in_one_half_is_refused_with_this_half() {
    let refused: Vec<(u64, Option<String>)> = [2, 3, 5]
        .into_par_iter()
        .map(|index| (index, refusal(&folded(index))))
        .collect();
    let halves = ["left", "right"].map(|half| format!("agree in the {half} half of the print"));
    for (index, why) in refused {
        let why = why.unwrap_or_default();
        let names_half = halves.iter().any(|half| why.contains(half));
        assert!(names_half, "{index}: {why:?}");
    }
}

/// Looks for a text in refusals, until one has it. Returns all of them if none has.
fn find(what: &str, refusals: impl Iterator<Item = String>) -> Result<(), Vec<String>> {
    let mut others = Vec::new();
    for text in refusals {
        if text.contains(what) {
            return Ok(());
        }
        others.push(text);
    }
    Err(others)
}

#[test]
fn refusals_say_what_was_seen() {
    let seen = ["separate pieces", "nearly flat", "half of the print only"];
    let refused = |kind: Decoy| -> Vec<String> {
        let of_kind = ALIGNED.iter().filter(|decoy| decoy.kind == kind);
        let refusals = of_kind.filter_map(|decoy| decoy.outcome.as_ref().err());
        refusals.cloned().collect()
    };
    let [wrong, flat] = [Decoy::WrongPrint, Decoy::Uncarved].map(refused);
    assert!(wrong.len() > COUNT as usize && flat.len() > COUNT as usize);
    let of_others = wrong
        .iter()
        .filter(|text| seen.iter().any(|what| text.contains(what)));
    assert_eq!(of_others.count(), 0, "{wrong:#?}");
    assert!(
        flat.iter().all(|text| !text.contains("another character")),
        "{flat:#?}"
    );
    assert_eq!(find("no carving found", flat.into_iter()), Ok(()));
    let pieces = (0..COUNT).filter_map(|index| refusal(&two_pieces(index)));
    assert_eq!(find("2 separate pieces", pieces), Ok(()));
    let back = (0..COUNT).filter_map(|index| refusal(&rough_back(index)));
    let is_back = "of its length): does it show the back of the block?";
    assert_eq!(find(is_back, back), Ok(()));
}
