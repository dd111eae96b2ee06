//! Other carved pieces in the scan of a block, as when several are scanned together.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::carving::carve;
use super::glyph::Glyphs;
use super::polygon::Polygon;
use super::scanner::{ScanStyle, scan};
use super::scene::Scene;
use mocban_core::mesh::Mesh;

/// Adds one or two pieces beside a block. `mesh` is the scan of the block, in the block frame, mm. Each piece shows
/// another character, is turned by any angle about the z axis, and lies up to 1.5 mm higher or lower.
pub(super) fn add_other_pieces(
    mesh: &mut Mesh,
    glyphs: &Glyphs,
    scene: &Scene,
    style: &ScanStyle,
    rng: &mut ChaCha8Rng,
) {
    let block = mesh.clone();
    let first = rng.random_range(0.0..std::f64::consts::TAU);
    for k in 0..rng.random_range(1..3_u32) {
        let other = scene.another(glyphs, rng);
        let surface = carve(&other, &other.artwork.strokes, rng);
        let margin_mm = rng.random_range(0.3..0.75);
        let outline = Polygon::around(other.artwork.stroke_bounds, margin_mm, 1.1, rng);
        let mut piece = scan(&surface, &outline, style, rng);
        let turn = rng.random_range(0.0..std::f64::consts::TAU);
        let slope = [0; 2].map(|_: i32| rng.random_range(-0.05..0.05));
        let (sin, cos) = turn.sin_cos();
        let lift = rng.random_range(-1.5..1.5);
        piece.vertices.map_in_place(|[x, y, z]| {
            let tilted = z + slope[0] * x + slope[1] * y + lift;
            [cos * x - sin * y, sin * x + cos * y, tilted]
        });
        let direction = first + f64::from(k) * std::f64::consts::PI + rng.random_range(-0.6..0.6);
        let [dx, dy] = [direction.cos(), direction.sin()];
        let away = reach(&block, [dx, dy]) + reach(&piece, [-dx, -dy]) + rng.random_range(0.5..5.0);
        let start = mesh.vertices.len() as u32;
        for [x, y, z] in piece.vertices.iter() {
            mesh.vertices.push([x + away * dx, y + away * dy, z]);
        }
        let faces = piece.triangles.iter().map(|face| face.map(|k| start + k));
        mesh.triangles.extend(faces);
    }
}

/// Returns the largest coordinate of a mesh along a unit direction in x and y.
fn reach(mesh: &Mesh, [dx, dy]: [f64; 2]) -> f64 {
    let along = mesh.vertices.iter().map(|[x, y, _]| dx * x + dy * y);
    along.fold(f64::NEG_INFINITY, f64::max)
}
