//! Known-answer worlds for both methods.

use nalgebra::Vector3;

use super::{FitError, fit};
use crate::domain::{FailureClass, FitOutcome};
use crate::mesh::Mesh;
use crate::stages::paper_method;
use crate::stages::testing::{SyntheticSheet, print, settings, some_turn};

fn normal_error_deg(world: &SyntheticSheet, found: &FitOutcome) -> f64 {
    let [x, y, z, _] = found.plane_from_mesh.0[2];
    Vector3::new(x, y, z).angle(&world.normal()).to_degrees()
}

#[test]
fn plane_and_side_are_found_in_any_pose() {
    for k in 0..6 {
        let world = SyntheticSheet {
            turn: some_turn(k),
            inward: k % 2 == 0,
            ..SyntheticSheet::default()
        };
        let found = fit(
            &world.mesh().into(),
            Some(&print(14.0, 2.0).0),
            None,
            &settings().fit,
        )
        .expect("a plane");
        let error = normal_error_deg(&world, &found);
        assert!(error < 0.4, "{error} degrees in pose {k}");
        let [_, _, height] = found.plane_from_mesh.apply(world.place(-2.7, 1.0, 0.0));
        assert!(height.abs() < 0.05, "{height} mm");
    }
}

#[test]
fn bow_is_found_only_where_there_is_one() {
    let bent = SyntheticSheet {
        bow_mm: 0.5,
        turn: some_turn(4),
        ..SyntheticSheet::default()
    };
    let found = fit(
        &bent.mesh().into(),
        Some(&print(14.0, 2.0).0),
        None,
        &settings().fit,
    )
    .expect("a plane");
    assert!(
        found.bow.is_some() && (0.3..1.2).contains(&found.bow_height),
        "{}",
        found.bow_height
    );
    let flat = SyntheticSheet {
        turn: some_turn(4),
        ..SyntheticSheet::default()
    };
    let found = fit(
        &flat.mesh().into(),
        Some(&print(14.0, 2.0).0),
        None,
        &settings().fit,
    )
    .expect("a plane");
    assert!(found.bow_height < 0.05, "{}", found.bow_height);
}

#[test]
fn the_papers_plane_is_close_on_an_open_mesh() {
    for k in 0..4 {
        let world = SyntheticSheet {
            turn: some_turn(k),
            ..SyntheticSheet::default()
        };
        let found = paper_method::fit::fit(&world.mesh().into(), &settings().fit).expect("a plane");
        let error = normal_error_deg(&world, &found);
        assert!(error < 3.0, "{error} degrees in pose {k}");
    }
}

/// A fit of points without faces.
type FitPoints<'a> = &'a dyn Fn(Vec<[f64; 3]>) -> Result<FitOutcome, FitError>;

#[test]
fn points_that_span_no_surface_are_rejected() {
    let mesh = |vertices: Vec<[f64; 3]>| Mesh {
        vertices: vertices.into(),
        triangles: Vec::new().into(),
    };
    let params = settings().fit;
    let ours = |vertices| fit(&mesh(vertices).into(), None, None, &params);
    let the_papers = |vertices| paper_method::fit::fit(&mesh(vertices).into(), &params);
    let methods: [FitPoints<'_>; 2] = [&ours, &the_papers];
    for (k, fit) in methods.into_iter().enumerate() {
        assert_eq!(fit(vec![[0.0; 3]; 2]), Err(FitError::TooFewPoints(2)));
        assert_eq!(fit(vec![[1.0, 2.0, 3.0]; 9]), Err(FitError::OnePoint(9)));
        let line = (0..50)
            .map(|i| [f64::from(i), f64::from(2 * i), 1.0])
            .collect();
        assert_eq!(fit(line), Err(FitError::OneLine(50)));
        let few = (0..36)
            .map(|i| [f64::from(i % 6), f64::from(i / 6), f64::from(i % 2)])
            .collect();
        assert_eq!(fit(few), Err(FitError::NoFaces(36)));
        let plate = (0..900)
            .map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0])
            .collect();
        let refused = fit(plate).expect_err("nothing is carved");
        assert_eq!(refused.class(), FailureClass::NoSolution, "method {k}");
    }
}
