//! Centroid and covariance of a surface, weighted by area, so that they do not depend on the triangulation.

use nalgebra::{Matrix3, Vector3};

use super::surface::IndexedSurface;
use super::triangle_block::{LANES, LaneArray, TriangleBlock};
use mocban_core::domain::cancel::poll;
use mocban_core::mesh::robust_bounds::Bounds;
use mocban_core::simd::dispatch;

/// The distinct products of two axes.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
/// Number of blocks that are summed in single precision before the sum is added to a double-precision total.
const BLOCKS_PER_SUM: usize = 32;
/// Sums between two polls for a cancellation.
const SUMS_PER_POLL: usize = 64;

/// Centroid (mesh units) and covariance (mesh units squared) of a surface, in the mesh's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    pub(crate) centre: Vector3<f64>,
    pub(crate) covariance: Matrix3<f64>,
}

impl Moments {
    /// Computes the moments of the triangles inside the bulk (the range of the scan without specks). Returns `None` if
    /// there are no faces, or if the area is zero.
    pub(crate) fn of(surface: &IndexedSurface) -> Option<Self> {
        if !surface.has_faces {
            return None;
        }
        let bulk = BulkBox::new(surface);
        let mut sums = [0.0; SUM_COUNT];
        dispatch!({
            for (run, blocks) in surface.blocks.chunks(BLOCKS_PER_SUM).enumerate() {
                if run.is_multiple_of(SUMS_PER_POLL) {
                    poll();
                }
                let mut part = [[0.0; LANES]; SUM_COUNT];
                for (k, block) in blocks.iter().enumerate() {
                    let first = (run * BLOCKS_PER_SUM + k) * LANES;
                    bulk.add(block, surface.triangle_count - first, &mut part);
                }
                for (sum, part) in sums.iter_mut().zip(part) {
                    *sum += part.iter().map(|v| f64::from(*v)).sum::<f64>();
                }
            }
        });
        let [total, x, y, z, xx, xy, xz, yy, yz, zz] = sums;
        if total <= 0.0 || !total.is_finite() {
            return None;
        }
        let centre = Vector3::new(x, y, z) / (3.0 * total);
        // Second moment of a triangle: (sum of the corners' outer products + outer product of the corners' sum) / 12.
        let second = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) / (12.0 * total);
        let unit = bulk.extent;
        Some(Self {
            centre: Vector3::from(surface.origin) + centre * unit,
            covariance: (second - centre * centre.transpose()) * (unit * unit),
        })
    }
}

/// Number of sums: area, three of first degree, six of second.
const SUM_COUNT: usize = 10;

/// The bulk box about the origin.
struct BulkBox {
    extent: f64,
    /// Half sides, as fractions of the extent.
    half: [f32; 3],
}

impl BulkBox {
    fn new(surface: &IndexedSurface) -> Self {
        let [low, high]: Bounds<3> = surface.bulk;
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let extent = sides.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        Self {
            extent,
            half: sides.map(|side| (side / extent / 2.0 * (1.0 + f64::from(f32::EPSILON))) as f32),
        }
    }

    /// Adds the first `count` triangles of a block. Skips triangles with a corner outside the bulk.
    #[inline(always)]
    fn add(&self, block: &TriangleBlock, count: usize, sums: &mut [[f32; LANES]; SUM_COUNT]) {
        let per_extent = (1.0 / self.extent) as f32;
        let corner = |corner: &[LaneArray; 3], lane: usize| {
            [
                corner[0][lane] * per_extent,
                corner[1][lane] * per_extent,
                corner[2][lane] * per_extent,
            ]
        };
        let [first, second, third] = block;
        for lane in 0..LANES {
            let [a, b, c] = [
                corner(first, lane),
                corner(second, lane),
                corner(third, lane),
            ];
            let mut inside = lane < count;
            for axis in 0..3 {
                let half = self.half[axis];
                inside &= a[axis].abs() <= half;
                inside &= b[axis].abs() <= half;
                inside &= c[axis].abs() <= half;
            }
            let p = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
            let q = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
            let cross = [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ];
            let squared = cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2];
            let area = if inside { squared.sqrt() } else { 0.0 };
            let sum = [a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]];
            sums[0][lane] += area;
            for axis in 0..3 {
                sums[1 + axis][lane] += area * sum[axis];
            }
            for (k, (i, j)) in PAIRS.into_iter().enumerate() {
                let outer = a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j];
                sums[4 + k][lane] += area * outer;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Moments;
    use crate::stages::zbuffer::IndexedSurface;
    use mocban_core::mesh::Mesh;

    /// Rows of small triangles that each triangle is cut into.
    const ROWS: usize = 40;

    /// Computes reference moments: cuts each triangle into small ones, and weights their centroids by area.
    fn of_small_triangles(mesh: &Mesh) -> ([f64; 3], [[f64; 3]; 3]) {
        let mut middles = Vec::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices.at(i as usize));
            let at =
                |u: f64, v: f64| [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
            let [p, q] = [b, c].map(|d| [0, 1, 2].map(|k| d[k] - a[k]));
            let side = |i: usize, j: usize| p[i] * q[j] - p[j] * q[i];
            let area = (side(0, 1).powi(2) + side(1, 2).powi(2) + side(2, 0).powi(2)).sqrt();
            let step = 1.0 / ROWS as f64;
            for i in 0..ROWS {
                for j in 0..ROWS - i {
                    let (u, v) = (i as f64 * step, j as f64 * step);
                    middles.push((at(u + step / 3.0, v + step / 3.0), area));
                    if i + j + 1 < ROWS {
                        middles.push((at(u + step / 1.5, v + step / 1.5), area));
                    }
                }
            }
        }
        let total: f64 = middles.iter().map(|(_, area)| area).sum();
        let mean = |value: &dyn Fn(&[f64; 3]) -> f64| {
            let sum: f64 = middles
                .iter()
                .map(|(place, area)| area * value(place))
                .sum();
            sum / total
        };
        let centre = [0, 1, 2].map(|k| mean(&|place| place[k]));
        let spread = |i: usize, j: usize| mean(&|p| (p[i] - centre[i]) * (p[j] - centre[j]));
        (centre, [0, 1, 2].map(|i| [0, 1, 2].map(|j| spread(i, j))))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn moments_equal_sums_over_many_small_triangles(
            places in prop::collection::vec(prop::array::uniform3(-3.0..5.0_f64), 9..40),
        ) {
            let triangles = (0..places.len() as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
            let mesh = Mesh { vertices: places.into(), triangles };
            let found = Moments::of(&IndexedSurface::new(&mesh)).expect("there is area");
            let (centre, covariance) = of_small_triangles(&mesh);
            for i in 0..3 {
                prop_assert!((found.centre[i] - centre[i]).abs() < 1e-4);
                for (j, two) in covariance[i].iter().enumerate() {
                    let one = found.covariance[(i, j)];
                    prop_assert!((one - two).abs() < 5e-3, "{one} {two}");
                }
            }
        }
    }

    #[test]
    fn distant_specks_are_excluded() {
        let grid = |i: u32| [f64::from(i % 60), f64::from(i / 60), 0.0];
        let mut vertices: Vec<[f64; 3]> = (0..3600).map(grid).collect();
        let mut triangles: Vec<[u32; 3]> = (0..3500)
            .filter(|i| i % 60 < 59)
            .map(|i| [i, i + 1, i + 60])
            .collect();
        let plain = Mesh {
            vertices: vertices.clone().into(),
            triangles: triangles.clone().into(),
        };
        vertices.extend([[5e4, 0.0, 0.0], [5e4, 9e3, 0.0], [6e4, 0.0, 9e3]]);
        triangles.push([3600, 3601, 3602]);
        let flecked = Mesh {
            vertices: vertices.into(),
            triangles: triangles.into(),
        };
        let of = |mesh: &Mesh| Moments::of(&IndexedSurface::new(mesh)).expect("there is area");
        let apart = of(&plain).centre - of(&flecked).centre;
        assert!(apart.norm() < 1e-3, "{apart}");
    }
}
