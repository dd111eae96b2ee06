//! The paper's fit, step by step (III-A): PCA, sides, upper set, spaced selection, RANSAC, PCA.

use std::collections::HashMap;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::stages::fit::{Axes, FitError, FitParams, frame, quantile};
use crate::stages::scan::Scan;
use mocban_core::domain::cancel::{PollCounter, poll, polled};
use mocban_core::domain::{FitOutcome, SideEvidence};
use mocban_core::mesh::Vertices;

/// Fits a plane to the highest points on the carved side (III-A). The plane frame is in mesh units.
///
/// # Errors
/// Returns an error if the vertices span no surface, nothing is carved, or RANSAC finds no plane.
pub(crate) fn fit(scan: &Scan, params: &FitParams) -> Result<FitOutcome, FitError> {
    let mesh = scan.mesh();
    if mesh.vertices.len() < 3 {
        return Err(FitError::TooFewPoints(mesh.vertices.len()));
    }
    let points = distinct(&mesh.vertices);
    let all = Axes::of_points(points.iter().map(|p| (*p, 1.0)));
    all.require_surface(mesh)?;
    let extent = (all.variances.iter().sum::<f64>() * 12.0).sqrt() / std::f64::consts::SQRT_2;
    let (upper, outward, flatness) = upper_set(&points, &all);
    let taken = spaced_selection(&upper, &all, params.spacing * extent, params.spaced_points);
    let distance = params.ransac_distance * extent;
    let inliers = ransac(&taken, distance, params)?;
    let plane = Axes::of_points(inliers.iter().map(|p| (*p, 1.0)));
    let normal = if plane.normal().dot(&outward) < 0.0 {
        -plane.normal()
    } else {
        plane.normal()
    };
    let height = |p: &[f64; 3]| (Vector3::from(*p) - plane.centre).dot(&normal);
    let mut below: Vec<f64> = polled(&points).map(|p| -height(p)).collect();
    let relief = quantile(&mut below, 0.75).max(0.0);
    if relief < params.min_relief * extent {
        return Err(FitError::NoRelief {
            relief,
            extent,
            min_relief: params.min_relief,
            searched: false,
        });
    }
    let squares: f64 = inliers.iter().map(|p| height(p).powi(2)).sum();
    let middle = all.centre + normal * (plane.centre - all.centre).dot(&normal);
    Ok(FitOutcome {
        plane_from_mesh: frame(normal, middle),
        curvature: None,
        curvature_height: 0.0,
        inlier_ratio: inliers.len() as f64 / taken.len() as f64,
        rms: (squares / inliers.len() as f64).sqrt(),
        relief,
        side: SideEvidence {
            winding: None,
            flatness,
            confidence: flatness,
        },
        region: None,
        print_outline: None,
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
        missing_vertices: None,
        incomplete_faces: None,
    })
}

/// Returns each distinct point once, so that a triangle soup and an indexed mesh give the same plane.
fn distinct(vertices: &Vertices) -> Vec<[f64; 3]> {
    let mut points: Vec<[f64; 3]> = polled(vertices.iter()).collect();
    let mut counter = PollCounter::default();
    points.sort_by(|a, b| {
        counter.tick();
        let along = |axis: usize| a[axis].total_cmp(&b[axis]);
        along(0).then(along(1)).then(along(2))
    });
    points.dedup();
    points
}

/// Splits the points at the PCA plane. Returns the carved side (the upper set T), its outward normal, and the
/// confidence, 0..=1. On the carved side, points are closer to their own centroid on average: ground reaches the rim
/// all around, while strokes stay near the middle.
fn upper_set(points: &[[f64; 3]], all: &Axes) -> (Vec<[f64; 3]>, Vector3<f64>, f64) {
    let normal = all.normal();
    let (above, below): (Vec<_>, Vec<_>) =
        polled(points).partition(|p| (Vector3::from(**p) - all.centre).dot(&normal) > 0.0);
    let (up, down) = (mean_distance(&above), mean_distance(&below));
    let sureness = (up - down).abs() / (up + down).max(f64::MIN_POSITIVE);
    if up <= down {
        (above, normal, sureness)
    } else {
        (below, -normal, sureness)
    }
}

/// Returns the mean distance of points to their own centroid.
fn mean_distance(points: &[[f64; 3]]) -> f64 {
    let n = points.len().max(1) as f64;
    let vectors = || polled(points).map(|p| Vector3::from(*p));
    let centroid = vectors().sum::<Vector3<f64>>() / n;
    vectors().map(|p| (p - centroid).norm()).sum::<f64>() / n
}

/// Selects up to `wanted` points, the farthest from the plane first. Skips points within `spacing` of a selected point.
fn spaced_selection(upper: &[[f64; 3]], all: &Axes, spacing: f64, wanted: u32) -> Vec<[f64; 3]> {
    let normal = all.normal();
    let height = |p: &[f64; 3]| (Vector3::from(*p) - all.centre).dot(&normal).abs();
    let mut order: Vec<(f64, [f64; 3])> = polled(upper).map(|p| (height(p), *p)).collect();
    let mut counter = PollCounter::default();
    order.sort_by(|a, b| {
        counter.tick();
        b.0.total_cmp(&a.0)
    });
    let cell = |p: &[f64; 3]| p.map(|v| (v / spacing).floor() as i64);
    let mut near: HashMap<[i64; 3], Vec<[f64; 3]>> = HashMap::new();
    let mut taken = Vec::new();
    for (_, p) in order {
        poll();
        if taken.len() == wanted as usize {
            break;
        }
        let [i, j, k] = cell(&p);
        let crowded = (-1..=1)
            .flat_map(|a| (-1..=1).flat_map(move |b| (-1..=1).map(move |c| [a, b, c])))
            // Specks may be further away than the largest number of a cell; their neighbours are of no importance.
            .map(|[a, b, c]| [i.wrapping_add(a), j.wrapping_add(b), k.wrapping_add(c)])
            .filter_map(|c| near.get(&c))
            .flatten()
            .any(|q| (Vector3::from(*q) - Vector3::from(p)).norm() <= spacing);
        if !crowded {
            near.entry([i, j, k]).or_default().push(p);
            taken.push(p);
        }
    }
    taken
}

/// Draws planes through three random points. Returns the inliers of the plane with the most inliers.
fn ransac(
    taken: &[[f64; 3]],
    distance: f64,
    params: &FitParams,
) -> Result<Vec<[f64; 3]>, FitError> {
    let too_few = |inliers| FitError::TooFewInliers {
        inliers,
        taken: taken.len(),
        needs: 3,
    };
    if taken.len() < 3 {
        return Err(too_few(taken.len()));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(params.seed);
    let point = |i: usize| Vector3::from(taken[i]);
    let near = |a: Vector3<f64>, normal: Vector3<f64>| {
        let is_near = move |p: &&[f64; 3]| (Vector3::from(**p) - a).dot(&normal).abs() < distance;
        taken.iter().filter(is_near)
    };
    let mut best: (usize, Vector3<f64>, Vector3<f64>) = (0, point(0), Vector3::zeros());
    for _ in 0..params.ransac_draws {
        poll();
        let [a, b, c] = [0; 3].map(|_: i32| point(rng.random_range(0..taken.len())));
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-300) else {
            continue;
        };
        let count = near(a, normal).count();
        if count > best.0 {
            best = (count, a, normal);
        }
    }
    let (count, a, normal) = best;
    if count < 3 {
        return Err(too_few(count));
    }
    Ok(near(a, normal).copied().collect())
}
