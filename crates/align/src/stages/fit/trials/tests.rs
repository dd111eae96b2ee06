//! Candidates of a fit that are registered, widened and compared.

use super::{Trials, factor_of_winding, replaces};
use crate::stages::fit::fit;
use crate::stages::testing::settings;
use crate::stages::{Print, Scan};
use mocban_core::domain::{FitOutcome, Rigid3, ScanRegion};
use mocban_core::raster::{ImageLimits, decode};
use mocban_demo::{DemoPair, PairGenerator, Tier};
use nalgebra::Vector3;

fn read(pair: &DemoPair) -> (Scan, Print) {
    let print = decode(&pair.print, &ImageLimits::SUGGESTED).expect("an image");
    (Scan::from(pair.mesh.clone()), Print::from(print))
}

fn upright_pair() -> DemoPair {
    let pairs = PairGenerator::new(Tier::Pose, 7).with_vertices(Some(20_000));
    pairs.pair(0).expect("a pair")
}

#[test]
fn a_box_that_cuts_through_the_character_is_widened() {
    let pair = upright_pair();
    let (scan, print) = read(&pair);
    let params = settings().fit;
    let whole = fit(&scan, Some(&print), None, &params).expect("a plane");
    let [low, high] = scan.indexed().bounds(&whole.plane_from_mesh);
    let width = high[0] - low[0];
    let cut = FitOutcome {
        region: Some(ScanRegion {
            box_from_mesh: whole.plane_from_mesh,
            bounds: [
                [low[0], low[1], -width],
                [low[0] + 0.7 * width, high[1], width],
            ],
        }),
        ..whole
    };
    let mut trials = Trials::new(&scan, &print, &params);
    trials.add(cut, false);
    assert!(trials.is_sure());
    let region = trials.into_best(true).and_then(|found| found.region);
    let [.., to] = region.expect("a box").bounds;
    assert!(to[0] > low[0] + 0.9 * width, "{to:?} {low:?} {width}");
}

#[test]
fn a_sure_side_ends_the_search_before_others_are_sought() {
    let pair = upright_pair();
    let (scan, print) = read(&pair);
    let params = settings().fit;
    let whole = fit(&scan, Some(&print), None, &params).expect("a plane");
    let mut trials = Trials::new(&scan, &print, &params);
    assert_eq!(trials.certain(whole.clone()).as_ref(), Some(&whole));
    let [x, y, z, last] = whole.plane_from_mesh.0;
    let back = FitOutcome {
        plane_from_mesh: Rigid3([x, y.map(|v| -v), z.map(|v| -v), last]),
        ..whole
    };
    assert_eq!(trials.certain(back.clone()), None);
    trials.add(back, false);
    assert!(!trials.is_sure() && trials.known.is_none());
}

#[test]
fn faces_that_point_inward_count_against_a_side_for_small_prints_only() {
    assert!(replaces(0.5 * factor_of_winding(true, Some(0.98)), 0.3, 1));
    assert!(!replaces(0.5 * factor_of_winding(true, Some(0.02)), 0.1, 1));
    for outward in [None, Some(0.0)] {
        assert_eq!(factor_of_winding(false, outward), 1.0);
    }
}

#[test]
fn a_candidate_that_matches_replaces_one_that_does_not() {
    assert!(replaces(0.05, 0.0, 5));
    assert!(!replaces(0.0, 0.0, 1));
    assert!(replaces(0.5, 0.35, 1));
    // The best of many draws must be surer.
    assert!(!replaces(0.5, 0.35, 4));
}

#[test]
fn both_parts_of_a_broken_character_that_did_not_slide_are_kept() {
    let mut pair = upright_pair();
    let (scan, print) = read(&pair);
    let params = settings().fit;
    let whole = fit(&scan, Some(&print), None, &params).expect("a plane");
    let [low, high] = scan.indexed().bounds(&whole.plane_from_mesh);
    let middle = f64::midpoint(low[0], high[0]);
    let is_left = |corner: &u32| {
        let vertex = pair.mesh.vertices.at(*corner as usize);
        whole.plane_from_mesh.apply(vertex)[0] < middle
    };
    let is_in_part = |face: &&[u32; 3]| {
        let left = face.iter().filter(|corner| is_left(corner)).count();
        left == 0 || left == 3
    };
    let faces: Vec<[u32; 3]> = pair
        .mesh
        .triangles
        .iter()
        .filter(is_in_part)
        .copied()
        .collect();
    pair.mesh.triangles = faces.into();
    let (scan, print) = read(&pair);
    let found = fit(&scan, Some(&print), None, &params).expect("a plane");
    let is_inside = |landmark: &[f64; 3]| {
        let region = found.region.as_ref();
        region.is_none_or(|region| region.contains(*landmark))
    };
    assert!(pair.truth.landmarks.iter().all(is_inside));
}

/// Fits a scan with several parts. The surface and the box must be those of the part that the print shows.
fn box_of_part(tier: Tier, index: u64) -> (Scan, ScanRegion) {
    let pair = PairGenerator::new(tier, 1).with_vertices(Some(20_000));
    let pair = pair.pair(index).expect("a pair");
    let (scan, print) = read(&pair);
    let found = fit(&scan, Some(&print), None, &settings().fit).expect("a plane");
    let [x, y, z, _] = found.plane_from_mesh.0[2];
    let turn = Vector3::new(x, y, z).angle(&Vector3::from(pair.truth.plane.n));
    assert!(turn.to_degrees() < 4.0, "{turn} rad in pair {index}");
    let region = found.region.expect("a box");
    for landmark in &pair.truth.landmarks {
        assert!(region.contains(*landmark), "pair {index}");
    }
    (scan, region)
}

#[test]
fn the_piece_that_the_print_shows_is_found_among_others() {
    for index in [3, 8] {
        let (scan, region) = box_of_part(Tier::Pieces, index);
        // The other pieces are as large.
        let inside = scan.mesh_in(&region).triangles.len() as f64;
        assert!(inside < 0.6 * scan.mesh().triangles.len() as f64);
    }
}

#[test]
fn one_side_of_a_crack_is_found_if_both_do_not_fit_the_print() {
    for index in [0, 5] {
        box_of_part(Tier::Slid, index);
    }
}
