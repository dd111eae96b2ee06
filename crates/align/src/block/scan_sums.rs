//! What one pass over the triangles of a block collects: sums over their area, a sample, and how far they reach.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use mocban_core::domain::cancel::ThreadToken;
use mocban_core::mesh::robust_bounds::{Bounds, is_in_box};
use mocban_core::mesh::{MeshReadError, Triangle, TriangleStream};

/// Triangles that one task sums. Sums are added in a fixed order, so they do not depend on the number of threads.
const TASK: usize = 4096;
/// Every 32nd triangle is kept for the direction of the face and for the extent of the block, unless the mesh has
/// only a few.
const SAMPLE_STEP: usize = 32;
/// The corners of every 128th triangle show how far the scan reaches.
const CORNER_STEP: usize = 128;
const FEW_TRIANGLES: usize = 1 << 16;

/// Sums over the area of triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct AreaSums {
    /// Lowest and highest coordinates of all corners, in the frame of the mesh.
    pub(super) bounds: Bounds<3>,
    /// Twice the area.
    pub(super) area: f64,
    pub(super) first: Vector3<f64>,
    pub(super) second: Matrix3<f64>,
    pub(super) normals: Matrix3<f64>,
}

/// A triangle of the sample: its first corner relative to the origin, and its normal times twice its area.
pub(super) type SampledTriangle = [Vector3<f32>; 2];

impl AreaSums {
    const fn empty() -> Self {
        Self {
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            area: 0.0,
            first: Vector3::new(0.0, 0.0, 0.0),
            second: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            normals: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        }
    }

    /// Sums the triangles that belong to the scan, relative to `origin`.
    fn of(triangles: &[Triangle], origin: Vector3<f64>, part: &ScanPart) -> Self {
        let mut sums = Self::empty();
        for triangle in triangles.iter().filter(|triangle| part.has(triangle)) {
            sums.enclose([triangle[0], triangle[1], triangle[2]]);
            let [a, b, c] = triangle.map(|corner| Vector3::from(corner) - origin);
            let normal = (b - a).cross(&(c - a));
            let area = normal.norm();
            if area <= 0.0 {
                continue;
            }
            let middle = (a + b + c) / 3.0;
            sums.area += area;
            sums.first += middle * area;
            // Exact for a triangle of any size.
            let corners = a * a.transpose() + b * b.transpose() + c * c.transpose();
            sums.second += (corners + middle * middle.transpose() * 9.0) * (area / 12.0);
            sums.normals += normal * normal.transpose() / area;
        }
        sums
    }

    /// Extends the bounds to points.
    fn enclose<const N: usize>(&mut self, points: [[f64; 3]; N]) {
        let [low, high] = &mut self.bounds;
        for point in points {
            for k in 0..3 {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
    }

    fn add(&mut self, other: &Self) {
        self.enclose(other.bounds);
        self.area += other.area;
        self.first += other.first;
        self.second += other.second;
        self.normals += other.normals;
    }
}

/// The part of a scan without specks: vertices that are so far away that they cannot belong to the block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanPart(pub(super) Option<Bounds<3>>);

impl ScanPart {
    /// Returns the whole scan.
    pub const fn whole() -> Self {
        Self(None)
    }

    /// Returns whether all corners of a triangle belong to the part.
    #[inline]
    pub fn has(&self, triangle: &Triangle) -> bool {
        (self.0.as_ref())
            .is_none_or(|bounds| triangle.iter().all(|corner| is_in_box(bounds, corner)))
    }
}

/// What one pass over a part of a scan collects.
pub(super) struct ScanSums {
    pub(super) area: AreaSums,
    pub(super) triangles: u64,
    /// First corner of the first triangle. Positions relative to it keep their precision far from the origin.
    pub(super) origin: Option<Vector3<f64>>,
    pub(super) sample: Vec<SampledTriangle>,
    /// Corners of every 128th triangle, in the frame of the mesh.
    pub(super) corners: Vec<[f64; 3]>,
}

impl ScanSums {
    /// Passes over a part of a scan.
    pub(super) fn over(
        mesh: &mut dyn TriangleStream,
        part: &ScanPart,
    ) -> Result<Self, MeshReadError> {
        let mut sums = Self {
            area: AreaSums::empty(),
            triangles: 0,
            origin: None,
            sample: Vec::new(),
            corners: Vec::new(),
        };
        mesh.pass(&mut |triangles| {
            sums.add(triangles, part);
            Ok(())
        })?;
        Ok(sums)
    }

    fn add(&mut self, triangles: &[Triangle], part: &ScanPart) {
        let is_small = self.triangles == 0 && triangles.len() < FEW_TRIANGLES;
        self.triangles += triangles.len() as u64;
        let first = || triangles.iter().find(|triangle| part.has(triangle));
        let origin = self.origin.or_else(|| first().map(|first| first[0].into()));
        self.origin = origin;
        let Some(origin) = origin else {
            return;
        };
        let token = ThreadToken::current();
        let parts: Vec<AreaSums> = triangles
            .par_chunks(TASK)
            .map(|triangles| token.scope(|| AreaSums::of(triangles, origin, part)))
            .collect();
        for part in &parts {
            self.area.add(part);
        }
        let step = if is_small { 1 } else { SAMPLE_STEP };
        let sampled = triangles.iter().step_by(step);
        for triangle in sampled.filter(|triangle| part.has(triangle)) {
            let [a, b, c] = triangle.map(|corner| Vector3::from(corner) - origin);
            let normal = (b - a).cross(&(c - a));
            self.sample
                .push([a, normal].map(nalgebra::Matrix::cast::<f32>));
        }
        let step = if is_small { 1 } else { CORNER_STEP };
        let sampled = triangles.iter().step_by(step);
        let sampled = sampled.filter(|triangle| part.has(triangle));
        self.corners.extend(sampled.flatten());
    }
}
