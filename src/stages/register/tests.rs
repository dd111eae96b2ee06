//! Known alignments come back through all four stages.

use crate::stages::StageError;
use crate::stages::normalize;
use crate::stages::testing::{
    World, landmark_error_px, paper_settings, print, run, settings, some_turn,
};

#[test]
fn any_pose_unit_and_winding_comes_out_right() {
    let (picture, truth) = print(14.0, 3.0);
    for k in 0..4 {
        let world = World {
            turn: some_turn(k),
            scale: [1.0, 0.1, 0.001, 1.0 / 25.4][k as usize],
            origin: [40.0, -300.0, 7.0],
            inward: k % 2 == 1,
            ..World::default()
        };
        let results = run(&world.mesh(), &picture, &settings()).expect("an alignment");
        for (found, metric) in results {
            let error = landmark_error_px(&world, &truth, &found);
            assert!(error < 0.6, "{error} px for pose {k}, {metric:?}");
        }
    }
}

#[test]
fn a_bent_block_aligns_as_well() {
    let (picture, truth) = print(12.0, -4.0);
    let world = World {
        bow_mm: 0.5,
        turn: some_turn(11),
        ..World::default()
    };
    let results = run(&world.mesh(), &picture, &settings()).expect("an alignment");
    let error = landmark_error_px(&world, &truth, &results[0].0);
    assert!(error < 0.7, "{error} px");
}

#[test]
fn a_mirrored_mesh_never_passes() {
    let (picture, _) = print(14.0, 0.0);
    let world = World {
        mirrored: true,
        turn: some_turn(3),
        ..World::default()
    };
    let refused = run(&world.mesh(), &picture, &settings());
    let error = refused.expect_err("mirror writing reads wrong");
    assert!(
        matches!(
            error,
            StageError::Normalize(normalize::Error::Mirrored { .. })
        ),
        "{error}"
    );
}

#[test]
fn the_papers_method_aligns_an_upright_pair() {
    let (picture, truth) = print(14.0, 8.0);
    let world = World::default();
    let results = run(&world.mesh(), &picture, &paper_settings()).expect("an alignment");
    let error = landmark_error_px(&world, &truth, &results[2].0);
    assert!(error < 4.0, "{error} px");
}

#[test]
fn a_fleck_far_away_changes_nothing() {
    let (picture, truth) = print(14.0, 3.0);
    let world = World {
        turn: some_turn(5),
        ..World::default()
    };
    let mut mesh = world.mesh();
    let first = mesh.vertices.len() as u32;
    for place in [
        [900.0, 40.0, 300.0],
        [902.0, 40.0, 300.0],
        [900.0, 44.0, 305.0],
    ] {
        mesh.vertices.push(place);
    }
    mesh.triangles.push([first, first + 1, first + 2]);
    let results = run(&mesh, &picture, &settings()).expect("an alignment");
    let error = landmark_error_px(&world, &truth, &results[0].0);
    assert!(error < 0.7, "{error} px");
}
