//! The highest surface under each pixel, looking straight down on a plane (orthographic z-buffer).

use super::bulk::{Bounds, bulk};
use crate::domain::{Affine2, Rigid3};
use crate::mesh::Mesh;
use crate::raster::Grid;

/// Height of a pixel that no surface covers.
pub(super) const NOTHING: f32 = f32::NEG_INFINITY;

/// Points of a set without faces are grown to this many times half their mean spacing, so that no holes stay.
const POINT_GROWTH: f64 = 1.5;

/// The mesh in the plane frame: x, y in the plane, z the height over it; mesh units.
#[derive(Debug)]
pub(super) struct Projected<'a> {
    points: Vec<[f64; 3]>,
    triangles: &'a [[u32; 3]],
}

/// Where the pixels of a rendering lie in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    /// Plane x, y to pixels.
    pub(super) px_from_plane: Affine2,
    /// Columns.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// Side of a pixel, mesh units.
    pub(super) unit_per_px: f64,
}

impl<'a> Projected<'a> {
    /// Moves every vertex into the plane frame.
    pub(super) fn new(mesh: &'a Mesh, plane_from_mesh: &Rigid3) -> Self {
        Self {
            points: mesh
                .vertices
                .iter()
                .map(|v| plane_from_mesh.apply(*v))
                .collect(),
            triangles: &mesh.triangles,
        }
    }

    /// Bounds in x and y of the bulk of the points.
    pub(super) fn bounds(&self) -> Bounds<2> {
        bulk(&self.points)
    }

    /// The highest z under each pixel's centre; [`NOTHING`] where the ray meets no surface.
    pub(super) fn render(&self, view: &View) -> Grid<f32> {
        let mut heights = Grid::new(view.width, view.height, NOTHING);
        if self.triangles.is_empty() {
            self.splat(view, &mut heights);
            return heights;
        }
        // On the way, since a list of corners would cost more time in memory than in sums.
        let corner = |i: u32| {
            let [x, y, z] = self.points[i as usize];
            let [x, y] = view.px_from_plane.apply([x, y]);
            [x, y, z]
        };
        for t in self.triangles {
            fill(t.map(corner), &mut heights);
        }
        heights
    }

    /// Each point as a small square.
    fn splat(&self, view: &View, heights: &mut Grid<f32>) {
        let [low, high] = self.bounds();
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let spacing_px = (area / self.points.len().max(1) as f64).sqrt() / view.unit_per_px;
        let reach = (spacing_px * 0.5 * POINT_GROWTH).max(0.5);
        for p in &self.points {
            let [x, y] = view.px_from_plane.apply([p[0], p[1]]);
            for row in pixels(y - reach, y + reach, view.height) {
                for column in pixels(x - reach, x + reach, view.width) {
                    raise(heights, column, row, p[2] as f32);
                }
            }
        }
    }
}

impl View {
    /// A view of the bounds whose longest side takes `longest_px` pixels, one of them free on each side.
    ///
    /// The bounds' middle is the view's, so a mesh turned by a right angle is seen by the same rays.
    /// With `mirrored`, x is reflected: what is carved in mirror writing then reads right. y points down either way.
    pub(super) fn around(bounds: Bounds<2>, longest_px: usize, mirrored: bool) -> Self {
        let [low, high] = bounds;
        let size = [high[0] - low[0], high[1] - low[1]];
        let unit_per_px = size[0].max(size[1]) / (longest_px.max(4) as f64 - 3.0);
        let scale = 1.0 / unit_per_px;
        // Rounding must not add a pixel to a side that takes a whole number of them.
        let side = |length: f64| (length * scale - 1e-6).ceil() as usize + 3;
        let [width, height] = size.map(side);
        let along = |axis: usize, side: usize, scale: f64| {
            let middle = f64::midpoint(low[axis], high[axis]);
            (side - 1) as f64 / 2.0 - scale * middle
        };
        let x_scale = if mirrored { -scale } else { scale };
        Self {
            px_from_plane: Affine2([
                [x_scale, 0.0, along(0, width, x_scale)],
                [0.0, -scale, along(1, height, -scale)],
            ]),
            width,
            height,
            unit_per_px,
        }
    }
}

/// Fills the pixels whose centre lies in the triangle, borders included, with the plane through its corners.
///
/// Every crossing of an edge with a row is computed from the edge's lower to its upper end, so two triangles that
/// share an edge agree on it to the last bit and no pixel between them stays empty.
fn fill(corners: [[f64; 3]; 3], heights: &mut Grid<f32>) {
    let [a, b, c] = corners;
    // Most triangles of a scan are smaller than a pixel and hold no centre.
    let span = |k: usize, len| {
        let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        pixels(low, high, len)
    };
    let rows = span(1, heights.height());
    if rows.is_empty() || span(0, heights.width()).is_empty() {
        return;
    }
    let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    if doubled_area == 0.0 || !doubled_area.is_finite() {
        return;
    }
    let (u, v) = (b[2] - a[2], c[2] - a[2]);
    let dz_dx = (u * (c[1] - a[1]) - v * (b[1] - a[1])) / doubled_area;
    let dz_dy = (v * (b[0] - a[0]) - u * (c[0] - a[0])) / doubled_area;
    let z_low = a[2].min(b[2]).min(c[2]);
    let z_high = a[2].max(b[2]).max(c[2]);
    let width = heights.width();
    for row in rows {
        let Some((x_low, x_high)) = crossings(&corners, row as f64) else {
            continue;
        };
        let at_row = a[2] + (row as f64 - a[1]) * dz_dy;
        for column in pixels(x_low, x_high, width) {
            let z = at_row + (column as f64 - a[0]) * dz_dx;
            raise(heights, column, row, z.clamp(z_low, z_high) as f32);
        }
    }
}

/// First and last x at which the triangle's border meets a row.
fn crossings(corners: &[[f64; 3]; 3], y: f64) -> Option<(f64, f64)> {
    let mut span: Option<(f64, f64)> = None;
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let (low, high) = if (p[1], p[0]) <= (q[1], q[0]) {
            (p, q)
        } else {
            (q, p)
        };
        if y < low[1] || y > high[1] || low[1] == high[1] {
            continue;
        }
        let x = if y == high[1] {
            high[0]
        } else {
            low[0] + (y - low[1]) / (high[1] - low[1]) * (high[0] - low[0])
        };
        span = Some(span.map_or((x, x), |(a, b)| (a.min(x), b.max(x))));
    }
    span
}

/// Whole pixels from `low` to `high`, bounds included, cut to the grid.
///
/// Casts to narrow integers do the rounding: `ceil` and `floor` are calls.
#[inline]
fn pixels(low: f64, high: f64, len: usize) -> std::ops::Range<usize> {
    let cut = |v: f64| v.max(-1.0).min(len as f64) as i32;
    let (first, last) = (cut(low), cut(high));
    let first = (first + i32::from(f64::from(first) < low)).max(0);
    let end = (last + i32::from(f64::from(last) <= high)).min(len as i32);
    first as usize..end.max(first) as usize
}

fn raise(heights: &mut Grid<f32>, x: usize, y: usize, z: f32) {
    if z > heights.at(x, y) {
        heights.set(x, y, z);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{NOTHING, Projected, View};
    use crate::domain::{Affine2, Rigid3};
    use crate::mesh::Mesh;

    const UPRIGHT: Rigid3 = Rigid3([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);

    /// The slow obvious twin: one ray at a time against every triangle.
    fn cast(mesh: &Mesh, view: &View, x: usize, y: usize) -> Option<(f64, bool)> {
        let mut best: Option<f64> = None;
        let mut near_edge = false;
        for t in &mesh.triangles {
            let corner = |k: usize| {
                let v = mesh.vertices[t[k] as usize];
                let [px, py] = view.px_from_plane.apply([v[0], v[1]]);
                [px - x as f64, py - y as f64, v[2]]
            };
            let p = [corner(0), corner(1), corner(2)];
            let cross = |a: [f64; 3], b: [f64; 3]| a[0] * b[1] - a[1] * b[0];
            let w = [cross(p[1], p[2]), cross(p[2], p[0]), cross(p[0], p[1])];
            let area: f64 = w.iter().sum();
            if area.abs() < 1e-9 {
                continue;
            }
            let w = w.map(|one| one / area);
            near_edge |= w.iter().any(|one| one.abs() < 1e-6);
            if w.iter().all(|one| *one >= 0.0) {
                let z = w[0] * p[0][2] + w[1] * p[1][2] + w[2] * p[2][2];
                best = Some(best.map_or(z, |b: f64| b.max(z)));
            }
        }
        best.map(|z| (z, near_edge))
    }

    fn soup() -> impl Strategy<Value = Mesh> {
        let coordinate = (0.0..10.0_f64, 0.0..10.0_f64, -1.0..1.0_f64);
        proptest::collection::vec((coordinate.clone(), coordinate.clone(), coordinate), 1..12)
            .prop_map(|triangles| {
                let mut mesh = Mesh::default();
                for (a, b, c) in triangles {
                    let first = mesh.vertices.len() as u32;
                    for (x, y, z) in [a, b, c] {
                        mesh.vertices.push([x, y, z]);
                    }
                    mesh.triangles.push([first, first + 1, first + 2]);
                }
                mesh
            })
    }

    proptest! {
        #[test]
        fn equals_a_ray_caster(mesh in soup()) {
            let projected = Projected::new(&mesh, &UPRIGHT);
            let view = View::around([[0.0, 0.0], [10.0, 10.0]], 24, true);
            let heights = projected.render(&view);
            for y in 0..view.height {
                for x in 0..view.width {
                    let got = heights.at(x, y);
                    match cast(&mesh, &view, x, y) {
                        Some((_, true)) => {}
                        Some((z, false)) => prop_assert!((f64::from(got) - z).abs() < 1e-5),
                        None => prop_assert!(got == NOTHING),
                    }
                }
            }
        }
    }

    #[test]
    fn a_fan_without_gaps_leaves_no_hole() {
        let mut mesh = Mesh {
            vertices: vec![[0.03, -0.07, 0.0]],
            triangles: Vec::new(),
        };
        let n = 97_u32;
        for k in 0..n {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(n);
            mesh.vertices
                .push([angle.cos() * 5.0, angle.sin() * 5.0, 0.0]);
            mesh.triangles.push([0, 1 + k, 1 + (k + 1) % n]);
        }
        let view = View {
            px_from_plane: Affine2::scale_shift(10.0, [60.0, 60.0]),
            width: 121,
            height: 121,
            unit_per_px: 0.1,
        };
        let heights = Projected::new(&mesh, &UPRIGHT).render(&view);
        for y in 0..121_i64 {
            for x in 0..121_i64 {
                let inside = (x - 60).pow(2) + (y - 60).pow(2) < 49 * 49;
                assert!(!inside || heights.at(x as usize, y as usize) == 0.0);
            }
        }
    }

    #[test]
    fn mirrored_view_reflects_x_only() {
        let plain = View::around([[0.0, 0.0], [10.0, 6.0]], 64, false);
        let mirrored = View::around([[0.0, 0.0], [10.0, 6.0]], 64, true);
        let [x, y] = plain.px_from_plane.apply([2.0, 1.0]);
        let [u, v] = mirrored.px_from_plane.apply([8.0, 1.0]);
        assert!((x - u).abs() < 1e-9 && (y - v).abs() < 1e-9);
        assert!(plain.px_from_plane.determinant() < 0.0);
        assert!(mirrored.px_from_plane.determinant() > 0.0);
    }

    #[test]
    fn points_without_faces_cover_their_area() {
        let vertices = (0..40 * 40)
            .map(|i| [f64::from(i % 40), f64::from(i / 40), 1.0])
            .collect();
        let mesh = Mesh {
            vertices,
            triangles: Vec::new(),
        };
        let projected = Projected::new(&mesh, &UPRIGHT);
        let view = View::around(projected.bounds(), 128, false);
        let heights = projected.render(&view);
        let covered = heights.data().iter().filter(|z| **z == 1.0).count();
        assert!(covered > 120 * 120, "{covered}");
    }
}
