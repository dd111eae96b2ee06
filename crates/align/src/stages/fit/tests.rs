//! Tests of both fit methods on synthetic sheets with known planes.

use nalgebra::Vector3;

use super::{FitError, fit};
use crate::stages::Print;
use crate::stages::paper_method;
use crate::stages::testing::{SyntheticSheet, grid_print, print, settings, some_turn};
use mocban_core::domain::{FailureClass, FitOutcome, ScanRegion};
use mocban_core::mesh::Mesh;

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
        found.curvature.is_some() && (0.3..1.2).contains(&found.curvature_height),
        "{}",
        found.curvature_height
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
    assert!(found.curvature_height < 0.05, "{}", found.curvature_height);
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

/// Adds a square grid of faces to a mesh. `at` maps two coordinates from -1 to 1 to a sheet point in millimetres.
fn add_patch(mesh: &mut Mesh, world: &SyntheticSheet, at: impl Fn(f64, f64) -> [f64; 3]) {
    add_patch_of(mesh, world, 40, at);
}

/// Like [`add_patch`], with `side` vertices along each side.
fn add_patch_of(
    mesh: &mut Mesh,
    world: &SyntheticSheet,
    side: u32,
    at: impl Fn(f64, f64) -> [f64; 3],
) {
    let first = mesh.vertices.len() as u32;
    let place = |k: u32| f64::from(2 * k) / f64::from(side - 1) - 1.0;
    for k in 0..side * side {
        let [x, y, z] = at(place(k % side), place(k / side));
        mesh.vertices.push(world.place(x, y, z));
        if k % side > 0 && k / side > 0 {
            let corner = first + k;
            mesh.triangles
                .push([corner - side - 1, corner - side, corner]);
            mesh.triangles.push([corner - side - 1, corner, corner - 1]);
        }
    }
}

/// Checks that the carved side of a mesh is found, and returns its region.
fn assert_region_found(world: &SyntheticSheet, mesh: Mesh) -> ScanRegion {
    let print = print(14.0, 2.0).0;
    let found = fit(&mesh.into(), Some(&print), None, &settings().fit).expect("a plane");
    let error = normal_error_deg(world, &found);
    assert!(error < 1.0, "{error} degrees");
    let region = found.region.expect("a region");
    assert!(region.contains(world.place(0.0, 0.0, -0.5)));
    assert!(!region.contains(world.place(0.0, 0.0, 5.0)));
    assert!(!region.contains(world.place(0.0, 0.0, -15.0)));
    region
}

#[test]
fn carved_side_of_a_block_deeper_than_wide_is_found() {
    let world = SyntheticSheet {
        turn: some_turn(2),
        ..SyntheticSheet::default()
    };
    let mut mesh = world.mesh();
    let (half, deep) = (6.0, 11.0);
    for side in [-half, half] {
        add_patch(&mut mesh, &world, |u, v| {
            [side, half * u, deep * (v - 1.0) - 1.2]
        });
        add_patch(&mut mesh, &world, |u, v| {
            [half * u, side, deep * (v - 1.0) - 1.2]
        });
    }
    add_patch(&mut mesh, &world, |u, v| {
        [half * u, half * v, -2.0 * deep - 1.2]
    });
    assert_region_found(&world, mesh);
}

#[test]
fn block_on_a_table_is_found() {
    let world = SyntheticSheet {
        turn: some_turn(3),
        ..SyntheticSheet::default()
    };
    let mut mesh = world.mesh();
    add_patch(&mut mesh, &world, |u, v| {
        [24.0 * u + 5.0, 20.0 * v - 3.0, -6.0]
    });
    assert_region_found(&world, mesh);
}

#[test]
fn debris_around_a_block_is_left_out() {
    let world = SyntheticSheet {
        turn: some_turn(1),
        ..SyntheticSheet::default()
    };
    let mut mesh = world.mesh();
    for (x, z) in [(-9.0, 14.0), (4.0, 17.0), (10.0, -16.0), (-3.0, -20.0)] {
        add_patch(&mut mesh, &world, |u, v| {
            [x + 0.6 * u, 0.6 * v, z + 0.3 * u * v]
        });
    }
    assert_region_found(&world, mesh);
}

#[test]
fn specks_close_above_the_carving_are_left_out() {
    let world = SyntheticSheet::default();
    let mut mesh = world.mesh();
    add_patch(&mut mesh, &world, |u, v| [2.0 + 0.3 * u, 0.3 * v, 3.0]);
    let region = assert_region_found(&world, mesh);
    assert!(region.contains(world.place(2.0, 0.0, -0.5)));
    assert!(!region.contains(world.place(2.0, 0.0, 3.0)));
}

#[test]
fn thin_strokes_are_a_carving() {
    let world = SyntheticSheet::default();
    let mut mesh = Mesh::default();
    // A cross of two ridges of 8 x 0.3 mm on ground of 12 x 12 mm: 3 % of the area.
    add_patch_of(&mut mesh, &world, 120, |u, v| {
        let [x, y] = [6.0 * u, 6.0 * v];
        let outside = |along: f64, across: f64| {
            (along.abs() - 4.0)
                .max(0.0)
                .hypot((across.abs() - 0.15).max(0.0))
        };
        let ground = 1.2 + 0.1 * (3.0 * x).sin() * (2.0 * y).cos();
        [x, y, -(2.0 * outside(x, y).min(outside(y, x))).min(ground)]
    });
    let found = fit(&mesh.into(), None, None, &settings().fit).expect("a plane");
    assert!((0.8..1.4).contains(&found.relief), "{found:?}");
}

#[test]
fn middle_character_of_a_grid_is_found() {
    let world = SyntheticSheet {
        turn: some_turn(5),
        ..SyntheticSheet::default()
    };
    let (one, middle) = (world.mesh(), Vector3::from(world.place(0.0, 0.0, 0.0)));
    let mut mesh = Mesh::default();
    for place in 0..9 {
        let [x, y] = [place % 3 - 1, place / 3 - 1].map(|step| 12.0 * f64::from(step));
        let shift = Vector3::from(world.place(x, y, 0.0)) - middle;
        let first = mesh.vertices.len() as u32;
        for vertex in one.vertices.iter() {
            mesh.vertices.push((Vector3::from(vertex) + shift).into());
        }
        for face in &one.triangles {
            mesh.triangles.push(face.map(|corner| first + corner));
        }
    }
    let region = assert_region_found(&world, mesh);
    assert!(!region.contains(world.place(12.0, 0.0, -0.5)));
    assert!(!region.contains(world.place(0.0, -12.0, -0.5)));
}

#[test]
fn character_among_neighbours_in_the_print_is_outlined() {
    let world = SyntheticSheet {
        turn: some_turn(6),
        ..SyntheticSheet::default()
    };
    let fitted = |print: &Print| {
        fit(&world.mesh().into(), Some(print), None, &settings().fit).expect("a plane")
    };
    let (print, print_from_sheet) = grid_print(14.0, 2.0);
    let found = fitted(&print);
    assert!(normal_error_deg(&world, &found) < 0.4);
    let outline = found.print_outline.expect("an outline");
    let is_inside = |x: f64, y: f64| {
        let [x, y] = print_from_sheet.apply([x, y]);
        let columns = outline.columns_in_row(y);
        columns.is_some_and(|[first, last]| first <= x && x <= last)
    };
    assert!(is_inside(-4.0, -4.0) && is_inside(3.0, 3.3) && is_inside(-2.5, 4.1));
    assert!(!is_inside(-7.0, 0.0) && !is_inside(7.0, 0.0) && !is_inside(0.0, -7.0));
    assert_eq!(fitted(&self::print(14.0, 2.0).0).print_outline, None);
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

#[test]
fn a_missing_relief_has_significant_digits_in_any_unit() {
    let refused = FitError::NoRelief {
        relief: 0.000_004_7,
        extent: 0.019_915,
        min_relief: 0.005,
        searched: false,
    };
    assert_eq!(
        refused.to_string(),
        "no carving found: the likeliest side has a relief of 0.00000470 on an extent of 0.0199 (mesh units), a share below \
         fit.min_relief 0.005"
    );
}
