//! Cuts out the part of a scan near one of its large planes.
//!
//! Holes, through which the back or a table is seen, and debris beside the block can tilt the fit of a side by any
//! angle. The directions of the faces themselves are not affected.

use nalgebra::Vector3;

use super::directions::{Facet, SAME, angle};
use super::pca::frame;
use crate::stages::scan::part_of;
use mocban_core::domain::Rigid3;
use mocban_core::mesh::Mesh;

/// Heights of the cut part above and below the middle of the plane, as a fraction of the plane's longer side.
const REACH: f64 = 0.2;
/// Fraction of the area whose faces may lie outside of the cut part at either end of x and y.
const OUTSIDE: f64 = 0.01;
/// The cut part is widened by this fraction of its sides.
const WIDENED: f64 = 0.03;
/// This fraction of the area of all faces with about the given normal lies below the middle of the uppermost plane:
/// half of the area is on the back of a block, and half of the rest below the middle.
const MIDDLE: f64 = 0.75;
/// A smaller part is not a side.
const LEAST_VERTICES: usize = 64;

/// Returns the part of a scan near the uppermost large plane with a normal, and the frame of that plane. Returns `None`
/// if the part is small.
pub(super) fn near_plane(
    mesh: &Mesh,
    facets: &[Facet],
    normal: Vector3<f64>,
) -> Option<(Mesh, Rigid3)> {
    let level = frame(normal, Vector3::zeros());
    let mut places: Vec<([f64; 3], f64)> = facets
        .iter()
        .filter(|facet| angle(&facet.normal, &normal) < SAME)
        .map(|facet| (level.apply(facet.middle.into()), facet.area))
        .collect();
    let middle = quantile(&mut places, 2, MIDDLE)?;
    let side = |places: &mut Vec<_>, k| -> Option<[f64; 2]> {
        let [low, high] = [OUTSIDE, 1.0 - OUTSIDE].map(|share| quantile(places, k, share));
        Some([low?, high?])
    };
    let longer = |sides: [[f64; 2]; 2]| {
        let [x, y] = sides.map(|[low, high]| high - low);
        x.max(y)
    };
    let reach = REACH * longer([side(&mut places, 0)?, side(&mut places, 1)?]);
    places.retain(|(at, _)| (at[2] - middle).abs() < reach);
    let sides = [side(&mut places, 0)?, side(&mut places, 1)?].map(|[low, high]| {
        let margin = WIDENED * (high - low);
        [low - margin, high + margin]
    });
    let part = part_of(mesh, |corner| {
        let at = level.apply(corner);
        let inside = |k: usize| (sides[k][0]..=sides[k][1]).contains(&at[k]);
        inside(0) && inside(1) && (at[2] - middle).abs() < reach
    });
    let [x, y] = sides.map(|[low, high]| f64::midpoint(low, high));
    let centre = level.inverse().apply([x, y, middle]);
    (part.vertices.len() >= LEAST_VERTICES).then(|| (part, frame(normal, centre.into())))
}

/// Returns the coordinate `k` below which lies the fraction `share` of the weight. `None` without points.
fn quantile(places: &mut [([f64; 3], f64)], k: usize, share: f64) -> Option<f64> {
    places.sort_unstable_by(|a, b| a.0[k].total_cmp(&b.0[k]));
    let total: f64 = places.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    let found = places.iter().find(|(_, weight)| {
        below += weight;
        below >= share * total
    });
    found.map(|(at, _)| at[k])
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::near_plane;
    use crate::stages::fit::directions::facets;
    use mocban_core::mesh::Mesh;

    /// Adds a square of side `side` around `centre`, of two faces for each unit square, at the height of the centre.
    fn add_square(mesh: &mut Mesh, centre: [f64; 3], side: usize) {
        for at in 0..side * side {
            let [x, y] = [at % side, at / side].map(|k| k as f64 - side as f64 / 2.0);
            let first = mesh.vertices.len() as u32;
            for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let [a, b, c] = centre;
                mesh.vertices.push([a + x + u, b + y + v, c]);
            }
            let corners = [[0, 1, 2], [0, 2, 3]];
            let faces = corners.map(|face| face.map(|k: u32| first + k));
            mesh.triangles.extend(faces);
        }
    }

    #[test]
    fn the_part_has_the_face_without_its_back_and_debris() {
        let mut mesh = Mesh::default();
        add_square(&mut mesh, [0.0, 0.0, 1.0], 20);
        add_square(&mut mesh, [0.0, 0.0, -9.0], 20);
        add_square(&mut mesh, [60.0, 0.0, 1.0], 1);
        add_square(&mut mesh, [0.0, 0.0, 40.0], 1);
        let nearly_up = Vector3::new(0.08, -0.05, 1.0).normalize();
        let (part, frame) = near_plane(&mesh, &facets(&mesh), nearly_up).expect("a part");
        // Widened by 3 % at either end, so nothing of the face is cut off.
        assert_eq!(part.triangles.len(), 2 * 20 * 20);
        assert!(
            part.vertices
                .iter()
                .all(|[x, y, z]| { x.abs() <= 10.0 && y.abs() <= 10.0 && z == 1.0 })
        );
        let [_, _, height] = frame.apply([0.0, 0.0, 1.0]);
        assert!(height.abs() < 0.5, "{height}");
        assert!(near_plane(&mesh, &facets(&mesh), Vector3::x()).is_none());
    }
}
