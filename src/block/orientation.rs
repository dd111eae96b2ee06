//! The direction of the face of a block, from one pass over its triangles.
//!
//! Most of the area of a carved block looks along the normal of its face: the face itself, the carved ground, and the
//! other side. So the eigenvector of the largest eigenvalue of the sum of n n^T, weighted by area, is the face normal,
//! whatever walls, table or holder were scanned too.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::error::BlockError;
use crate::domain::LengthUnit;
use crate::mesh::{MeshReadError, Triangle, TriangleStream};

/// Triangles that one task sums. Sums are added in a fixed order, so they do not depend on the number of threads.
const TASK: usize = 4096;
/// Typical long side of a block, mm. The unit is the one that brings the long side nearest to it.
const TYPICAL_LONG_SIDE_MM: f64 = 320.0;
/// Ratio of the side of a uniform rectangle to its standard deviation along that side: sqrt(12).
const SIDE_BY_DEVIATION: f64 = 3.464_101_615_137_754_6;
/// Half extent of the frame, in standard deviations of the area. A uniform rectangle ends at 1.73.
const REACH: f64 = 3.0;

/// The frame of a block: axes along the face, and the unit.
///
/// `u` and `v` span the face and `n` is its normal, with u x v = n. Seen from outside with v up, the carving is in mirror
/// writing; drawn with v down it reads as printed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Orientation {
    /// Millimetres per unit of the mesh.
    pub mm: f64,
    /// Centroid of the area, in mesh units.
    pub centre: [f64; 3],
    /// Unit axes u, v and n in the frame of the mesh.
    pub axes: [[f64; 3]; 3],
    /// Half extents along u, v and n that contain the block, mm.
    pub half_extent_mm: [f64; 3],
    /// Number of triangles.
    pub triangles: u64,
}

/// Sums over the area of triangles.
#[derive(Debug, Clone, Copy)]
struct AreaSums {
    /// Twice the area.
    area: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
    normals: Matrix3<f64>,
    bounds: [Vector3<f64>; 2],
}

impl AreaSums {
    const fn empty() -> Self {
        Self {
            area: 0.0,
            first: Vector3::new(0.0, 0.0, 0.0),
            second: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            normals: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            bounds: [
                Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
                Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
            ],
        }
    }

    /// Sums triangles, relative to `origin`.
    fn of(triangles: &[Triangle], origin: Vector3<f64>) -> Self {
        let mut sums = Self::empty();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| Vector3::from(corner) - origin);
            let normal = (b - a).cross(&(c - a));
            let area = normal.norm();
            sums.bounds[0] = sums.bounds[0].inf(&a).inf(&b).inf(&c);
            sums.bounds[1] = sums.bounds[1].sup(&a).sup(&b).sup(&c);
            if area <= 0.0 {
                continue;
            }
            let middle = (a + b + c) / 3.0;
            sums.area += area;
            sums.first += middle * area;
            sums.second += middle * middle.transpose() * area;
            sums.normals += normal * normal.transpose() / area;
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.first += other.first;
        self.second += other.second;
        self.normals += other.normals;
        self.bounds[0] = self.bounds[0].inf(&other.bounds[0]);
        self.bounds[1] = self.bounds[1].sup(&other.bounds[1]);
    }
}

impl Orientation {
    /// Finds the frame of a block in one pass over its triangles. If `unit` is `None`, the unit is the one of mm, cm,
    /// inch and m that brings the long side nearest to 320 mm.
    ///
    /// # Errors
    /// Returns an error if the mesh cannot be read or has no area.
    pub fn find(
        mesh: &mut dyn TriangleStream,
        unit: Option<LengthUnit>,
    ) -> Result<Self, BlockError> {
        let mut sums = AreaSums::empty();
        let mut count = 0;
        let mut origin = None;
        mesh.pass(&mut |triangles| {
            // Positions relative to the first corner keep their precision far from the origin.
            let origin = *origin.get_or_insert_with(|| Vector3::from(triangles[0][0]));
            let parts: Vec<AreaSums> = triangles
                .par_chunks(TASK)
                .map(|part| AreaSums::of(part, origin))
                .collect();
            for part in &parts {
                sums.add(part);
            }
            count += triangles.len() as u64;
            Ok::<(), MeshReadError>(())
        })?;
        let Some(origin) = origin.filter(|_| sums.area > 0.0) else {
            return Err(BlockError::NoArea { triangles: count });
        };
        Ok(Self::of_sums(&sums, origin, unit, count))
    }

    fn of_sums(
        sums: &AreaSums,
        origin: Vector3<f64>,
        unit: Option<LengthUnit>,
        triangles: u64,
    ) -> Self {
        let mean = sums.first / sums.area;
        let covariance = sums.second / sums.area - mean * mean.transpose();
        let normals = SymmetricEigen::new(sums.normals);
        let normal = normals.eigenvectors.column(normals.eigenvalues.imax());
        let n = with_fixed_sign(normal.into_owned());
        // The largest variance of the area within the plane of the face.
        let flat = Matrix3::identity() - n * n.transpose();
        let within = SymmetricEigen::new(flat * covariance * flat);
        let long = within.eigenvectors.column(within.eigenvalues.imax());
        let u = with_fixed_sign((flat * long).normalize());
        let v = n.cross(&u);
        let axes = [u, v, n];
        let deviation = |axis: &Vector3<f64>| axis.dot(&(covariance * axis)).max(0.0).sqrt();
        let long_side = SIDE_BY_DEVIATION * deviation(&u);
        let mm = unit.unwrap_or_else(|| nearest_unit(long_side)).mm();
        let half_extent_mm = axes.map(|axis| {
            let corner = |k: usize| {
                let bound = |axis: usize| sums.bounds[k >> axis & 1][axis];
                Vector3::new(bound(0), bound(1), bound(2)) - mean
            };
            let farthest = (0..8)
                .map(|k| axis.dot(&corner(k)).abs())
                .fold(0.0, f64::max);
            farthest.min(REACH * deviation(&axis).max(long_side / 20.0)) * mm
        });
        Self {
            mm,
            centre: (origin + mean).into(),
            axes: axes.map(Into::into),
            half_extent_mm,
            triangles,
        }
    }

    /// Returns the coordinates u, v and n of a point of the mesh, mm.
    #[inline]
    pub fn face_from_mesh(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = [0, 1, 2].map(|k: usize| (point[k] - self.centre[k]) * self.mm);
        self.axes
            .map(|axis| axis[0] * x + axis[1] * y + axis[2] * z)
    }

    /// Returns the frame of the other side: v and n are reversed.
    #[must_use]
    pub fn other_side(&self) -> Self {
        let [u, v, n] = self.axes;
        Self {
            axes: [u, v.map(|c| -c), n.map(|c| -c)],
            ..*self
        }
    }
}

/// Returns the unit in which the long side of a block is nearest to a typical one.
fn nearest_unit(long_side: f64) -> LengthUnit {
    let distance = |unit: &LengthUnit| (long_side * unit.mm() / TYPICAL_LONG_SIDE_MM).ln().abs();
    LengthUnit::ALL
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(LengthUnit::Mm)
}

/// Returns the axis or its opposite, so that its largest component is positive.
fn with_fixed_sign(axis: Vector3<f64>) -> Vector3<f64> {
    if axis[axis.iamax()] < 0.0 {
        -axis
    } else {
        axis
    }
}
