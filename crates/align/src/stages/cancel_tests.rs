//! Tests that every stage ends soon after it is cancelled, and refuses scans that would take minutes to draw.

use std::fmt::Write as _;

use super::depth::depth;
use super::fit::{FitError, fit};
use super::testing::{SyntheticSheet, paper_settings, print, settings};
use super::{Print, Scan, Settings, pipeline};
use mocban_core::domain::cancel::{CancelToken, Cancelled};
use mocban_core::mesh::{Mesh, MeshLimits, read};

/// Moments at which each stage is cancelled, as fractions of its polls in eighths.
const EIGHTHS: [u64; 4] = [0, 2, 5, 8];

/// Runs a stage to its end, then cancels it at some of its polls. It must end at this poll and leave its inputs usable.
fn check<T: PartialEq + std::fmt::Debug>(name: &str, least_polls: u64, stage: impl Fn() -> T) -> T {
    let whole = CancelToken::default();
    let result = whole.run(&stage).expect("not cancelled");
    let polls = whole.polls();
    assert!(polls >= least_polls, "{name} polls only {polls} times");
    for eighths in EIGHTHS {
        let at = (polls * eighths / 8).max(1);
        let token = CancelToken::cancelled_at(at);
        let ended = token.run(&stage);
        assert!(ended == Err(Cancelled), "{name} at {at} of {polls}");
        assert_eq!(
            token.polls(),
            at,
            "{name} goes on after the poll that cancels it"
        );
    }
    assert!(stage() == result, "{name} after it was cancelled");
    result
}

fn check_all(settings: &Settings, least_polls: [u64; 4]) {
    let mesh = SyntheticSheet::default().mesh();
    let (print, _) = print(14.0, 2.0);
    let [of_fit, of_depth, of_normalize, of_register] = least_polls;
    let image = print.image().clone();
    let fitted = check("fit", of_fit, || {
        // Scan and print keep what they compute on first use.
        let (scan, print) = (Scan::from(mesh.clone()), Print::from(image.clone()));
        pipeline::fit(&scan, Some(&print), None, None, settings).expect("a plane")
    });
    let map = check("depth", of_depth, || {
        let scan = Scan::from(mesh.clone());
        depth(&scan, &fitted, None, &settings.depth).expect("a map")
    });
    let normalized = check("normalize", of_normalize, || {
        let print = Print::from(image.clone());
        pipeline::normalize(&map, &print, settings)
            .expect("masks")
            .outcome
    });
    let whole = pipeline::normalize(&map, &print, settings).expect("masks");
    assert_eq!(whole.outcome, normalized);
    check("register", of_register, || {
        let registered = pipeline::register(&map, &whole, None, settings).expect("a pose");
        registered.outcome
    });
}

#[test]
fn every_stage_ends_at_the_poll_at_which_it_is_cancelled() {
    check_all(&settings(), [1_000, 300, 1_000, 1_000]);
}

#[test]
fn every_stage_of_the_paper_ends_at_the_poll_at_which_it_is_cancelled() {
    check_all(&paper_settings(), [50, 300, 300, 1_000]);
}

/// Triangles of hostile meshes.
const COUNT: u32 = 500_000;

/// A sheet with a carving, below which lies what makes it hostile.
fn hostile(add: impl FnOnce(&mut Mesh)) -> Mesh {
    let mut mesh = SyntheticSheet::default().mesh();
    add(&mut mesh);
    mesh
}

/// Returns a circle of points of radius 6 mm below the sheet.
fn circle(count: u32) -> impl Iterator<Item = [f64; 3]> {
    (0..count).map(move |k| {
        let angle = f64::from(k) * std::f64::consts::TAU / f64::from(count);
        [6.0 * angle.cos(), 6.0 * angle.sin(), -2.0]
    })
}

/// Fits a scan, which is refused, and returns how many polls it takes.
fn refused(mesh: Mesh, print: &Print) -> u64 {
    let triangles = mesh.triangles.len();
    let token = CancelToken::default();
    let scan = Scan::from(mesh);
    let fitted = token.run(|| fit(&scan, Some(print), None, &settings().fit));
    assert_eq!(fitted, Ok(Err(FitError::Overlap(triangles))));
    token.polls()
}

#[test]
fn faces_that_cover_each_other_thousands_of_times_are_refused_after_little_work() {
    let (print, _) = print(14.0, 2.0);
    let fan = hostile(|mesh| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.push([0.0, 0.0, -2.0]);
        mesh.vertices.extend(circle(COUNT));
        let corner = |k: u32| first + 1 + k % COUNT;
        mesh.triangles
            .extend((0..COUNT).map(|k| [first, corner(k), corner(k + 1)]));
    });
    let repeated = hostile(|mesh| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(circle(3));
        let face = [first, first + 1, first + 2];
        mesh.triangles
            .extend(std::iter::repeat_n(face, COUNT as usize));
    });
    let sheet = SyntheticSheet::default().mesh();
    let token = CancelToken::default();
    let usual = token.run(|| fit(&Scan::from(sheet), Some(&print), None, &settings().fit).is_ok());
    assert_eq!(usual, Ok(true));
    for mesh in [fan, repeated] {
        let polls = refused(mesh, &print);
        assert!(polls < 2 * token.polls(), "{polls} polls");
    }
}

#[test]
fn a_polygon_of_many_corners_is_refused_after_little_work() {
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {COUNT}\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uint uint vertex_indices\nend_header\n"
    );
    for [x, y, z] in circle(COUNT) {
        writeln!(ply, "{x:.4} {y:.4} {z}").expect("written");
    }
    ply.push_str(&COUNT.to_string());
    (0..COUNT).for_each(|k| write!(ply, " {k}").expect("written"));
    let mesh = read(ply.as_bytes(), "polygon.ply", &MeshLimits::SUGGESTED).expect("a mesh");
    assert_eq!(mesh.triangles.len(), COUNT as usize - 2);
    refused(mesh, &print(14.0, 2.0).0);
}

#[test]
fn coordinates_whose_squares_are_infinite_are_refused_by_name() {
    let mut mesh = SyntheticSheet::default().mesh();
    mesh.vertices
        .map_in_place(|vertex| vertex.map(|c| c * 1e200));
    mesh.triangles = Vec::new().into();
    let count = mesh.vertices.len();
    let refused = fit(&mesh.into(), None, None, &settings().fit);
    assert_eq!(refused, Err(FitError::TooLarge(count)));
}
