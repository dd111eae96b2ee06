//! Debris of a scan: far outlier vertices and floating pieces.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::normal;
use super::polygon::Polygon;
use mocban_core::mesh::Mesh;

/// Moves random vertices by 0.3 to 4 mm along the viewing direction, and by less across it.
pub(super) fn add_far_spikes(mesh: &mut Mesh, spikes: u32, rng: &mut ChaCha8Rng) {
    for _ in 0..spikes {
        if mesh.vertices.is_empty() {
            return;
        }
        let index = rng.random_range(0..mesh.vertices.len());
        let [x, y, z] = mesh.vertices.at(index);
        let far_mm = rng.random_range(0.3..4.0) * if rng.random_bool(0.6) { 1.0 } else { -1.0 };
        let [dx, dy] = [0.15, 0.15].map(|share| share * far_mm * normal(rng));
        mesh.vertices.set(index, [x + dx, y + dy, z + far_mm]);
    }
}

/// Adds floating lumps around the block. Each has less than 1 % of the faces of an ordinary scan.
pub(super) fn add_blobs(mesh: &mut Mesh, blobs: u32, outline: &Polygon, rng: &mut ChaCha8Rng) {
    let bounds = outline.bounds();
    for _ in 0..blobs {
        let [u, v] = [0, 1].map(|i| rng.random_range(bounds.min[i] - 3.0..bounds.max[i] + 3.0));
        // A lump above or below the scanned area can hide the surface, so lumps there are small.
        let is_over = outline.contains([u, v]);
        let radius_mm = rng.random_range(0.05..if is_over { 0.2 } else { 0.9 });
        let side = if rng.random_bool(0.7) { 1.0 } else { -1.0 };
        let z = side * rng.random_range(1.8..9.0);
        add_lump(mesh, [-u, -v, z], radius_mm, rng);
    }
}

/// Adds a rough ellipsoid.
fn add_lump(mesh: &mut Mesh, centre: [f64; 3], radius_mm: f64, rng: &mut ChaCha8Rng) {
    let (rows, columns) = (rng.random_range(3..8_u32), rng.random_range(5..14_u32));
    let radii = [0; 3].map(|_: i32| radius_mm * rng.random_range(0.4..1.0));
    let start = mesh.vertices.len() as u32;
    for row in 0..=rows {
        let polar = std::f64::consts::PI * f64::from(row) / f64::from(rows);
        for column in 0..columns {
            let around = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
            let way = [
                polar.sin() * around.cos(),
                polar.sin() * around.sin(),
                polar.cos(),
            ];
            let rough = 1.0 + 0.15 * normal(rng);
            mesh.vertices
                .push([0, 1, 2].map(|i| centre[i] + radii[i] * rough * way[i]));
        }
    }
    for [a, b, c, d] in ring_quads(start, rows, columns) {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
}

/// Returns the quads between `rings` + 1 closed rings of `spokes` vertices each, which are numbered from `first` ring by
/// ring.
pub(super) fn ring_quads(first: u32, rings: u32, spokes: u32) -> impl Iterator<Item = [u32; 4]> {
    let quad = move |ring: u32, spoke: u32| {
        let [this, next] = [ring, ring + 1].map(|ring| first + ring * spokes);
        let after = (spoke + 1) % spokes;
        [this + spoke, next + spoke, next + after, this + after]
    };
    (0..rings).flat_map(move |ring| (0..spokes).map(move |spoke| quad(ring, spoke)))
}
