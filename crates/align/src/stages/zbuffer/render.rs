//! Renders a surface: the height of the first hit of each pixel's ray.

use super::block_fill::{fill_block, may_cover_centre};
use super::draw_effort::DrawEffort;
use super::surface::IndexedSurface;
use super::triangle_block::{AffineForm, LANES, TriangleBlock};
use super::triangle_fill::pixel_range;
use super::viewport::Viewport;
use mocban_core::domain::Rigid3;
use mocban_core::domain::cancel::{poll, polled};
use mocban_core::mesh::robust_bounds::bulk_along;
use mocban_core::raster::Grid;
use mocban_core::simd::{dispatch, max_f32};

/// Height of a pixel whose ray hits nothing.
pub(crate) const NO_HIT: f32 = f32::NEG_INFINITY;

/// Above this number of triangles per pixel, few blocks contain a pixel centre, and `fill_sparse_blocks` is used.
const SPARSE_TRIANGLES_PER_PIXEL: usize = 16;

/// Groups of 64 triangles between two polls for a cancellation.
const GROUPS_PER_POLL: usize = 64;

/// Each point is drawn as a square. Its side is this multiple of the mean point spacing, so the squares leave no holes.
const SPLAT_GROWTH: f64 = 1.5;

impl IndexedSurface {
    /// Renders the highest z of a plane frame at each pixel centre, in mesh units. Rays without a hit give [`NO_HIT`].
    pub(crate) fn render(&self, plane_from_mesh: &Rigid3, view: &Viewport) -> Grid<f32> {
        let mut heights = Grid::new(view.width, view.height, NO_HIT);
        self.rasterize(plane_from_mesh, view, |place, z| {
            let height = &mut heights.data_mut()[place];
            *height = max_f32(z, *height);
        });
        heights
    }

    /// Renders the heights of both sides. The back's frame is `plane_from_mesh` rotated by 180 degrees about its x
    /// axis.
    pub(crate) fn render_both_sides(
        &self,
        plane_from_mesh: &Rigid3,
        view: &Viewport,
    ) -> [Grid<f32>; 2] {
        let mut heights = Grid::new(view.width, view.height, [NO_HIT; 2]);
        self.rasterize(plane_from_mesh, view, |place, z| {
            let [front, back] = &mut heights.data_mut()[place];
            *front = max_f32(z, *front);
            *back = max_f32(-z, *back);
        });
        let last = view.height.saturating_sub(1);
        [
            heights.map(|[front, _]| *front),
            Grid::from_fn(view.width, view.height, |x, y| heights.at(x, last - y)[1]),
        ]
    }

    /// Returns the affine forms of a vertex's column, row and height.
    fn view_rows(&self, plane_from_mesh: &Rigid3, view: &Viewport) -> [AffineForm; 3] {
        let [x, y, z] = self.frame_rows(plane_from_mesh);
        let [[a, b, c], [d, e, f]] = view.px_from_plane.0;
        let mixed = |p: f64, q: f64, r: f64| {
            std::array::from_fn(|k| p * x[k] + q * y[k] + if k == 3 { r } else { 0.0 })
        };
        [mixed(a, b, c), mixed(d, e, f), z].map(|row: [f64; 4]| AffineForm(row.map(|v| v as f32)))
    }

    /// Calls `emit` with the index and the height of each pixel whose centre is inside a triangle. May also call it for
    /// other pixels that are tested; their height is NaN.
    fn rasterize(&self, plane_from_mesh: &Rigid3, view: &Viewport, emit: impl FnMut(usize, f32)) {
        if self.given_up.get() {
            return;
        }
        let rows = self.view_rows(plane_from_mesh, view);
        let size = [view.width, view.height];
        let mut effort = DrawEffort::new(view, self.triangle_count);
        if !self.has_faces {
            self.splat_points(&rows, size, emit);
        } else if self.triangle_count / SPARSE_TRIANGLES_PER_PIXEL > size[0] * size[1] {
            self.fill_sparse_blocks(&rows, size, &mut effort, emit);
        } else {
            self.fill_every_block(&rows, size, &mut effort, emit);
        }
        if !effort.is_left() {
            self.given_up.set();
        }
    }

    /// Returns whether a rendering was given up, because large triangles overlap too often. Renderings of the surface
    /// are then incomplete.
    pub(crate) fn overlaps_too_often(&self) -> bool {
        self.given_up.get()
    }

    /// Fills every block that may contain a pixel centre, as long as `effort` is left.
    fn fill_every_block(
        &self,
        rows: &[AffineForm; 3],
        size: [usize; 2],
        effort: &mut DrawEffort,
        mut emit: impl FnMut(usize, f32),
    ) {
        let [u, v, _] = rows;
        dispatch!({
            let groups = self.bounds.iter().zip(self.blocks.chunks(LANES));
            for (group, (bounds, blocks)) in groups.enumerate() {
                if group.is_multiple_of(GROUPS_PER_POLL) {
                    poll();
                }
                if !effort.is_left() {
                    return;
                }
                let (across, down) = (bounds.range_along(u), bounds.range_along(v));
                let candidates = may_cover_centre([&across, &down], size);
                for (block, candidates) in blocks.iter().zip(candidates) {
                    if candidates {
                        fill_block(block, rows, size, effort, &mut emit);
                    }
                }
            }
        });
    }

    /// Fills the same blocks as [`Self::fill_every_block`]. This is faster if few blocks contain a pixel centre. The
    /// hardware prefetcher does not fetch such distant blocks, so a group of them is read before it is filled.
    fn fill_sparse_blocks(
        &self,
        rows: &[AffineForm; 3],
        size: [usize; 2],
        effort: &mut DrawEffort,
        mut emit: impl FnMut(usize, f32),
    ) {
        const GROUPS: usize = 16;
        let [u, v, _] = rows;
        let mut few: Vec<&TriangleBlock> = Vec::with_capacity(GROUPS * LANES);
        dispatch!({
            let blocks = self.blocks.chunks(GROUPS * LANES);
            for (bounds, blocks) in self.bounds.chunks(GROUPS).zip(blocks) {
                poll();
                if !effort.is_left() {
                    return;
                }
                few.clear();
                for (bounds, blocks) in bounds.iter().zip(blocks.chunks(LANES)) {
                    let (across, down) = (bounds.range_along(u), bounds.range_along(v));
                    let candidates = may_cover_centre([&across, &down], size);
                    let pairs = blocks.iter().zip(candidates);
                    few.extend(
                        pairs
                            .filter(|(_, candidates)| *candidates)
                            .map(|(block, _)| block),
                    );
                }
                let mut seen = 0.0;
                for block in &few {
                    // One number per cache line.
                    let numbers = block.as_flattened().as_flattened();
                    seen += numbers.iter().step_by(16).sum::<f32>();
                }
                std::hint::black_box(seen);
                for block in &few {
                    fill_block(block, rows, size, effort, &mut emit);
                }
            }
        });
    }

    /// Fills a square for each point.
    fn splat_points(
        &self,
        rows: &[AffineForm; 3],
        size: [usize; 2],
        mut emit: impl FnMut(usize, f32),
    ) {
        let of_row = |row: &AffineForm| -> Vec<f32> {
            let blocks = polled(self.blocks.iter());
            blocks.flat_map(|block| row.at_lanes(&block[0])).collect()
        };
        let [xs, ys, zs] = rows.each_ref().map(of_row);
        let length = |places: &[f32]| {
            let [low, high] = bulk_along(places);
            high - low
        };
        let spacing_px = (length(&xs) * length(&ys) / xs.len().max(1) as f64).sqrt();
        let reach = (spacing_px * 0.5 * SPLAT_GROWTH).max(0.5) as f32;
        for ((x, y), z) in polled(xs.iter().zip(&ys).zip(zs)) {
            for row in pixel_range(y - reach, y + reach, size[1]) {
                for column in pixel_range(x - reach, x + reach, size[0]) {
                    emit(row * size[0] + column, z);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{DrawEffort, IndexedSurface, NO_HIT, Viewport};
    use mocban_core::domain::{Affine2, Rigid3};
    use mocban_core::mesh::Mesh;

    const UPRIGHT: Rigid3 = Rigid3([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);

    /// Tests one ray against every triangle, as a reference implementation. Returns the height, the tolerance for
    /// single precision (larger for slivers), and whether the ray is too close to an edge to decide.
    fn cast(mesh: &Mesh, view: &Viewport, x: usize, y: usize) -> (Option<f64>, f64, bool) {
        let mut best: Option<f64> = None;
        let (mut tolerance, mut near_edge) = (1e-5_f64, false);
        for t in &mesh.triangles {
            let corner = |k: usize| {
                let v = mesh.vertices.at(t[k] as usize);
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
            let unsure = 5e-4 / area.abs();
            near_edge |= w.iter().any(|one| one.abs() < unsure.max(1e-4));
            if w.iter().all(|one| *one >= 0.0) {
                let z = w[0] * p[0][2] + w[1] * p[1][2] + w[2] * p[2][2];
                best = Some(best.map_or(z, |b: f64| b.max(z)));
                tolerance = tolerance.max(2.0 * unsure);
            }
        }
        (best, tolerance, near_edge)
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
            let view = Viewport::around([[0.0, 0.0], [10.0, 10.0]], 24, true);
            let heights = IndexedSurface::new(&mesh).render(&UPRIGHT, &view);
            for y in 0..view.height {
                for x in 0..view.width {
                    let got = heights.at(x, y);
                    match cast(&mesh, &view, x, y) {
                        (_, _, true) => {}
                        (Some(z), tolerance, false) => {
                            prop_assert!((f64::from(got) - z).abs() < tolerance);
                        }
                        (None, _, false) => prop_assert!(got == NO_HIT),
                    }
                }
            }
        }
    }

    proptest! {
        #[test]
        fn sparse_blocks_are_filled_like_all_blocks(mesh in soup(), turn in 0.0..3.0_f64, more in 1..300_usize) {
            // Many small copies side by side, most of which contain no pixel centre.
            let mut many = Mesh::default();
            for copy in 0..more {
                let at = |[x, y, z]: [f64; 3]| {
                    [(copy % 17) as f64 + x / 9.0, (copy / 17) as f64 + y / 9.0, z]
                };
                let first = many.vertices.len() as u32;
                many.vertices.extend(mesh.vertices.iter().map(at));
                many.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
            }
            let frame = Rigid3::to_frame(
                [[turn.cos(), turn.sin(), 0.0], [-turn.sin(), turn.cos(), 0.0], [0.0, 0.0, 1.0]],
                [0.0; 3],
            );
            let surface = IndexedSurface::new(&many);
            let view = Viewport::around(surface.bounds(&frame), 16, false);
            let rows = surface.view_rows(&frame, &view);
            let size = [view.width, view.height];
            let mut filled = [Vec::new(), Vec::new()];
            let mut effort = [0; 2].map(|_: i32| DrawEffort::new(&view, surface.triangle_count));
            let [first, second] = &mut effort;
            surface.fill_every_block(&rows, size, first, |place, z| filled[0].push((place, z.to_bits())));
            surface.fill_sparse_blocks(&rows, size, second, |place, z| filled[1].push((place, z.to_bits())));
            prop_assert_eq!(&filled[0], &filled[1]);
        }
    }

    #[test]
    fn a_closed_fan_is_rendered_without_holes() {
        let mut mesh = Mesh {
            vertices: vec![[0.03, -0.07, 0.0]].into(),
            triangles: Vec::new().into(),
        };
        let n = 97_u32;
        for k in 0..n {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(n);
            mesh.vertices
                .push([angle.cos() * 5.0, angle.sin() * 5.0, 0.0]);
            mesh.triangles.push([0, 1 + k, 1 + (k + 1) % n]);
        }
        let view = Viewport {
            px_from_plane: Affine2::scale_shift(10.0, [60.0, 60.0]),
            width: 121,
            height: 121,
            unit_per_px: 0.1,
        };
        let heights = IndexedSurface::new(&mesh).render(&UPRIGHT, &view);
        for y in 0..121_i64 {
            for x in 0..121_i64 {
                let inside = (x - 60).pow(2) + (y - 60).pow(2) < 49 * 49;
                assert!(!inside || heights.at(x as usize, y as usize) == 0.0);
            }
        }
    }

    #[test]
    fn points_without_faces_cover_their_area() {
        let vertices = (0..40 * 40)
            .map(|i| [f64::from(i % 40), f64::from(i / 40), 1.0])
            .collect();
        let mesh = Mesh {
            vertices,
            triangles: Vec::new().into(),
        };
        let surface = IndexedSurface::new(&mesh);
        let view = Viewport::around(surface.bounds(&UPRIGHT), 128, false);
        let heights = surface.render(&UPRIGHT, &view);
        let covered = heights.data().iter().filter(|z| **z == 1.0).count();
        assert!(covered > 120 * 120, "{covered}");
    }
}
