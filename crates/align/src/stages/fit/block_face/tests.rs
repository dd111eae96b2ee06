//! Tests of the fit of characters of blocks: one of a single stroke, and one of several.

use nalgebra::Vector3;

use super::{ExpectedFace, MAX_ANGLE, fit, fit_in_block};
use crate::stages::register::ExpectedPose;
use crate::stages::testing::{SyntheticSheet, print, settings, some_turn};
use crate::stages::{Print, Scan, depth, pipeline};
use mocban_core::domain::{FitOutcome, PrintFromMesh};
use mocban_core::mesh::Mesh;
use mocban_core::raster::{Grid, PrintImage};

/// Half of the sides of the cut mesh, mm.
const HALF_MM: [f64; 2] = [5.2, 1.7];
/// Vertices along its sides.
const COUNTS: [u32; 2] = [53, 18];
const PX_PER_MM: f64 = 14.0;

/// Returns the distance in mm to the tops of one stroke with a thicker end.
fn distance_to_stroke(x: f64, y: f64) -> f64 {
    let bar = (x.abs() - 4.3).max(0.0).hypot((y.abs() - 0.45).max(0.0));
    let end = ((x - 3.4).hypot(y + 0.45) - 0.75).max(0.0);
    bar.min(end)
}

/// Returns the mesh of the stroke with little ground around it, cut from its block. It is about as high as wide, so
/// its principal axes do not show the normal.
fn one_stroke(world: &SyntheticSheet) -> Mesh {
    let mut mesh = Mesh::default();
    let [columns, rows] = COUNTS;
    let place = |k: u32, axis: usize| {
        HALF_MM[axis] * (2.0 * f64::from(k) / f64::from(COUNTS[axis] - 1) - 1.0)
    };
    for k in 0..columns * rows {
        let [x, y] = [place(k % columns, 0), place(k / columns, 1)];
        let ground = 3.0 + 0.15 * (2.3 * x).sin() * (3.1 * y + x).cos();
        let wall = 2.2 * distance_to_stroke(x, y);
        let rough = 0.01 * (17.0 * x).sin() * (23.0 * y).cos();
        mesh.vertices
            .push(world.place(x, y, rough - wall.min(ground)));
        if k % columns > 0 && k / columns > 0 {
            mesh.triangles.push([k - columns - 1, k - columns, k]);
            mesh.triangles.push([k - columns - 1, k, k - 1]);
        }
    }
    mesh
}

/// Renders the print of the stroke.
fn print_of_stroke() -> Print {
    let size = HALF_MM.map(|half| (2.0 * half * PX_PER_MM) as usize);
    let rgb = Grid::from_fn(size[0], size[1], |x, y| {
        let [x, y] = [(x, 0), (y, 1)]
            .map(|(at, axis): (usize, usize)| at as f64 - (size[axis] - 1) as f64 / 2.0);
        // Ink falls off over one pixel at the edge.
        let ink = (1.0 - distance_to_stroke(x / PX_PER_MM, y / PX_PER_MM) * PX_PER_MM).max(0.0);
        [(52_000.0 - 42_000.0 * ink) as u16; 3]
    });
    PrintImage::from(rgb).into()
}

/// Returns the true map from the mesh to the print.
fn truth(world: &SyntheticSheet) -> PrintFromMesh {
    let size = HALF_MM.map(|half| (2.0 * half * PX_PER_MM) as usize);
    let [right, down, out] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        .map(|[x, y, z]: [f64; 3]| world.place(x, y, z));
    let row = |[x, y, z]: [f64; 3], scale: f64, at: f64| [scale * x, scale * y, scale * z, at];
    let middle = size.map(|side| (side - 1) as f64 / 2.0);
    PrintFromMesh([
        row(right, PX_PER_MM, middle[0]),
        row(down, PX_PER_MM, middle[1]),
        row(out, 1.0, 0.0),
    ])
}

fn turned(k: u64) -> SyntheticSheet {
    SyntheticSheet {
        turn: some_turn(k),
        ..SyntheticSheet::default()
    }
}

fn face_of(world: &SyntheticSheet) -> ExpectedFace {
    ExpectedFace {
        normal: world.normal().into(),
    }
}

fn angle_deg(found: &FitOutcome, normal: &Vector3<f64>) -> f64 {
    let [x, y, z, _] = found.plane_from_mesh.0[2];
    Vector3::new(x, y, z).angle(normal).to_degrees()
}

#[test]
fn the_block_decides_the_plane_of_a_single_stroke() {
    let mut lost = 0;
    for k in 0..3 {
        let world = turned(k);
        let scan = Scan::from(one_stroke(&world));
        let (print, params, face) = (print_of_stroke(), settings().fit, face_of(&world));
        let alone = fit(&scan, Some(&print), None, &params);
        let found = fit_in_block(&scan, Some(&print), None, &face, &params).expect("a plane");
        let angle = angle_deg(&found, &world.normal());
        assert!(found.curvature.is_none() || alone.as_ref() == Ok(&found));
        if alone.as_ref() == Ok(&found) {
            assert!(
                angle < MAX_ANGLE.to_degrees(),
                "{angle} degrees in pose {k}"
            );
            continue;
        }
        lost += 1;
        assert!(angle < 1.0, "{angle} degrees in pose {k}");
        let [_, _, height] = found.plane_from_mesh.apply(world.place(-2.0, 0.0, 0.0));
        assert!(height.abs() < 0.1, "{height} mm");
        assert!((0.5..3.2).contains(&found.relief), "{}", found.relief);
    }
    assert!(lost > 0, "the fit alone finds the plane in every pose");
}

#[test]
fn a_single_stroke_is_aligned_where_the_block_expects_it() {
    let (world, settings) = (turned(2), settings());
    let (scan, print) = (Scan::from(one_stroke(&world)), print_of_stroke());
    let face = face_of(&world);
    let plane = pipeline::fit(&scan, Some(&print), None, Some(&face), &settings).expect("a plane");
    let map = depth::depth(&scan, &plane, None, &settings.depth).expect("a map");
    let normalized = pipeline::normalize(&map, &print, &settings).expect("masks");
    let depth_from_plane = &map.scale.depth_from_plane;
    let truth = truth(&world);
    let pose = truth.print_from_depth(depth_from_plane, &plane.plane_from_mesh);
    let expected = ExpectedPose {
        print_from_depth: pose.expect("an invertible view"),
        confidence: 1.0,
    };
    let registered = pipeline::register(&map, &normalized, Some(&expected), &settings);
    for metric in registered.expect("an alignment").outcome.metrics {
        let found = PrintFromMesh::new(
            &metric.print_from_depth,
            depth_from_plane,
            &plane.plane_from_mesh,
        );
        for [x, y] in [[-4.0, 0.0], [4.0, 0.0], [3.4, -1.0]] {
            let point = world.place(x, y, 0.0);
            let [[u, v, _], [p, q, _]] = [&found, &truth].map(|map| map.apply(point));
            let error = (u - p).hypot(v - q);
            assert!(error < 3.0, "{error} px at {x} {y}, {}", metric.metric);
        }
    }
}

#[test]
fn several_strokes_decide_their_plane_against_the_block() {
    let world = turned(4);
    let scan = Scan::from(world.mesh());
    let (print, _) = print(14.0, 2.0);
    let params = settings().fit;
    let own = fit(&scan, Some(&print), None, &params).expect("a plane");
    let aside = Vector3::<f64>::from(world.place(1.0, 0.0, 0.0));
    for lean in [0.0, 0.1, 0.2] {
        let face = ExpectedFace {
            normal: (world.normal() + aside * lean).into(),
        };
        let found = fit_in_block(&scan, Some(&print), None, &face, &params);
        assert_eq!(found.as_ref(), Ok(&own), "{lean}");
    }
}
