//! The direction of the face of a block, from one or two passes over its triangles.
//!
//! Tops and carved ground of a face lie in a layer a few millimetres thick and look along its normal. The flanks of the
//! strokes can have a larger area, but they are spread over the whole block. So the normal is the direction along which
//! one thin layer contains the largest area that looks along it.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

use super::error::BlockError;
use super::scan_sums::{SampledTriangle, ScanPart, ScanSums};
use crate::scan_size::{TYPICAL_BLOCK_MM, nearest_unit};
use mocban_core::domain::LengthUnit;
use mocban_core::domain::cancel::poll;
use mocban_core::mesh::TriangleStream;
use mocban_core::mesh::robust_bounds::{bulk_box, is_in_box};

/// Ratio of the side of a uniform rectangle to its standard deviation along that side: sqrt(12).
const SIDE_BY_DEVIATION: f64 = 3.464_101_615_137_754_6;
/// Half extent of the frame, in standard deviations of the area. A uniform rectangle ends at 1.73.
const REACH: f64 = 3.0;
/// Margin of the extent, mm.
const EXTENT_MARGIN_MM: f64 = 3.0;
/// Thickness of the layer of a face, as a fraction of the long side: 12 mm of 320 mm.
const LAYER_SHARE: f64 = 0.0375;
/// Area looks along a direction if the cosine is at least this.
const ALONG: f64 = 0.85;
/// Steps that refine a direction.
const REFINEMENTS: usize = 4;

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

impl Orientation {
    /// Finds the frame of a block, and the part of the scan without specks. Passes over the triangles once, or twice if
    /// there are specks. If `unit` is `None`, the unit is the one of mm, cm, inch and m that brings the long side nearest
    /// to 320 mm.
    ///
    /// # Errors
    /// Returns an error if the mesh cannot be read, has no area or is too large to compute with.
    pub fn find(
        mesh: &mut dyn TriangleStream,
        unit: Option<LengthUnit>,
    ) -> Result<(Self, ScanPart), BlockError> {
        let mut part = ScanPart::whole();
        let mut sums = ScanSums::over(mesh, &part)?;
        let triangles = sums.triangles;
        let bulk = bulk_box(&sums.corners);
        if sums
            .area
            .bounds
            .iter()
            .any(|corner| !is_in_box(&bulk, corner))
        {
            part = ScanPart(Some(bulk));
            sums = ScanSums::over(mesh, &part)?;
        }
        let found = Self::of_sums(&sums, unit).ok_or(BlockError::NoArea { triangles })?;
        Ok((Self { triangles, ..found }, part))
    }

    /// Returns the frame, or `None` without any area that can be computed with.
    fn of_sums(sums: &ScanSums, unit: Option<LengthUnit>) -> Option<Self> {
        let (triangles, sample, origin) = (sums.triangles, &sums.sample, sums.origin?);
        let sums = &sums.area;
        let mean = sums.first / sums.area;
        let covariance = sums.second / sums.area - mean * mean.transpose();
        // Other matrices have no eigenvalues.
        let is_finite = |matrix: &Matrix3<f64>| matrix.iter().all(|value| value.is_finite());
        if sums.area <= 0.0 || !is_finite(&covariance) || !is_finite(&sums.normals) {
            return None;
        }
        let spread = SymmetricEigen::new(covariance);
        let long_side = SIDE_BY_DEVIATION * spread.eigenvalues.max().max(0.0).sqrt();
        let n = SymmetricEigen::new(sums.normals)
            .eigenvectors
            .column_iter()
            .chain(spread.eigenvectors.column_iter())
            .map(|candidate| {
                poll();
                let n = refined(candidate.into_owned(), sample);
                (n, layer_area(&n, sample, LAYER_SHARE * long_side))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(Vector3::z(), |(n, _)| with_fixed_sign(n));
        // The largest variance of the area within the plane of the face.
        let flat = Matrix3::identity() - n * n.transpose();
        let within = SymmetricEigen::new(flat * covariance * flat);
        let long = within.eigenvectors.column(within.eigenvalues.imax());
        let u = with_fixed_sign((flat * long).normalize());
        let v = n.cross(&u);
        let axes = [u, v, n];
        let deviation = |axis: &Vector3<f64>| axis.dot(&(covariance * axis)).max(0.0).sqrt();
        let long_side = SIDE_BY_DEVIATION * deviation(&u);
        let unit = unit.unwrap_or_else(|| nearest_unit(long_side, TYPICAL_BLOCK_MM));
        let mm = unit.mm();
        let half_extent_mm = axes.map(|axis| {
            let distance =
                |[corner, _]: &SampledTriangle| axis.dot(&(corner.cast::<f64>() - mean)).abs();
            let farthest = sample.iter().map(distance).fold(0.0, f64::max);
            let farthest = farthest + EXTENT_MARGIN_MM / mm;
            farthest.min(REACH * deviation(&axis).max(long_side / 20.0)) * mm
        });
        Some(Self {
            mm,
            centre: (origin + mean).into(),
            axes: axes.map(Into::into),
            half_extent_mm,
            triangles,
        })
    }

    /// Returns the coordinates u, v and n of a point of the mesh, mm.
    #[inline]
    pub fn face_from_mesh(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = [0, 1, 2].map(|k: usize| (point[k] - self.centre[k]) * self.mm);
        self.axes
            .map(|axis| axis[0] * x + axis[1] * y + axis[2] * z)
    }

    /// Returns the point of the mesh with the coordinates u, v and n in mm.
    pub fn mesh_from_face(&self, face: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k: usize| {
            let along = (self.axes.iter().zip(face)).map(|(axis, at)| axis[k] * at);
            self.centre[k] + along.sum::<f64>() / self.mm
        })
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

/// Moves a direction to the mean direction of the area that looks along it.
fn refined(direction: Vector3<f64>, sample: &[SampledTriangle]) -> Vector3<f64> {
    let mut n = direction;
    for _ in 0..REFINEMENTS {
        let mut sum = Vector3::zeros();
        for [_, normal] in sample {
            let normal = normal.cast::<f64>();
            let along = normal.dot(&n);
            if along.abs() >= ALONG * normal.norm() {
                sum += normal * along.signum();
            }
        }
        n = sum.try_normalize(0.0).unwrap_or(n);
    }
    n
}

/// Returns the largest area in a layer of the given thickness that looks along a direction.
fn layer_area(n: &Vector3<f64>, sample: &[SampledTriangle], thickness: f64) -> f64 {
    let mut heights: Vec<(f64, f64)> = sample
        .iter()
        .map(|[corner, normal]| (corner.cast::<f64>().dot(n), normal.cast::<f64>()))
        .filter(|(_, normal)| normal.dot(n).abs() >= ALONG * normal.norm())
        .map(|(height, normal)| (height, normal.norm()))
        .collect();
    heights.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut first, mut area, mut largest) = (0, 0.0, 0.0_f64);
    for (height, added) in &heights {
        area += added;
        while height - heights[first].0 > thickness {
            area -= heights[first].1;
            first += 1;
        }
        largest = largest.max(area);
    }
    largest
}

/// Returns the axis or its opposite, so that its largest component is positive.
fn with_fixed_sign(axis: Vector3<f64>) -> Vector3<f64> {
    if axis[axis.iamax()] < 0.0 {
        -axis
    } else {
        axis
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::{Orientation, ScanPart};
    use crate::block::BlockError;
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::{Mesh, Vertices};

    /// A plate of 320 x 200 x 20 mm in any pose, in a unit of `mm` millimetres.
    fn plate(mm: f64) -> (Mesh, Rotation3<f64>) {
        let rotation = Rotation3::from_euler_angles(0.7, -0.4, 1.9);
        let corner = |k: usize| {
            let half = [160.0, 100.0, 10.0];
            let sign = |axis: usize| if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
            Vector3::new(sign(0) * half[0], sign(1) * half[1], sign(2) * half[2])
        };
        let place = |k: usize| (rotation * corner(k) + Vector3::new(900.0, -50.0, 30.0)) / mm;
        let vertices: Vertices = (0..8).map(|k| place(k).into()).collect();
        let quads = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        let triangles = quads
            .iter()
            .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
            .collect();
        (
            Mesh {
                vertices,
                triangles,
            },
            rotation,
        )
    }

    #[test]
    fn axes_and_unit_of_a_plate_are_found() {
        for unit in LengthUnit::ALL {
            let (mesh, rotation) = plate(unit.mm());
            let (found, _) = Orientation::find(&mut &mesh, None).unwrap();
            assert_eq!(found.mm, unit.mm());
            let normal = Vector3::from(found.axes[2]).dot(&(rotation * Vector3::z()));
            let long = Vector3::from(found.axes[0]).dot(&(rotation * Vector3::x()));
            assert!(normal.abs() > 0.9999 && long.abs() > 0.9999);
            let [u, v, n] = found.axes.map(Vector3::from);
            assert!((u.cross(&v) - n).norm() < 1e-9);
            assert!((found.half_extent_mm[0] - 163.0).abs() < 1.0, "{found:?}");
        }
    }

    #[test]
    fn a_given_unit_is_used() {
        let (mesh, _) = plate(1.0);
        let (found, _) = Orientation::find(&mut &mesh, Some(LengthUnit::Cm)).unwrap();
        assert_eq!(found.mm, 10.0);
    }

    /// A carved face of 320 x 200 mm in triangles of 1.6 mm, and a part of its back.
    fn scan() -> Mesh {
        const SIZE: [u32; 2] = [201, 126];
        let vertex = |k: u32| {
            let [x, y] = [k % SIZE[0], k / SIZE[0]];
            let height = if (x / 3 + y / 2) % 2 == 0 { 0.0 } else { -2.0 };
            [1.6 * f64::from(x), 1.6 * f64::from(y), height]
        };
        let cells = (0..SIZE[0] * (SIZE[1] - 1)).filter(|k| k % SIZE[0] < SIZE[0] - 1);
        Mesh {
            vertices: (0..SIZE[0] * SIZE[1]).map(vertex).collect(),
            triangles: cells
                .flat_map(|k| {
                    let below = k + SIZE[0];
                    [[k, k + 1, below], [k + 1, below + 1, below]]
                })
                .collect(),
        }
    }

    #[test]
    fn specks_far_away_change_neither_unit_nor_frame() {
        let mut clean = scan();
        // The same triangles as below, without those at the vertex that is moved.
        let moved = 12_000;
        let without: Vec<[u32; 3]> = clean
            .triangles
            .iter()
            .map(|face| if face.contains(&moved) { [0; 3] } else { *face })
            .collect();
        clean.triangles = without.into();
        let (usual, whole) = Orientation::find(&mut &clean, None).unwrap();
        assert_eq!((usual.mm, whole), (1.0, ScanPart::whole()));
        for far in [1e3, 1e6, 1e7, 1e30, 1e300] {
            let mut vertex = scan();
            vertex.vertices.set(moved as usize, [10.0, -far, far]);
            let mut triangle = clean.clone();
            let first = triangle.vertices.len() as u32;
            triangle.vertices.extend([
                [far, 0.0, 0.0],
                [far, far / 3.0, 0.0],
                [far, 0.0, far / 2.0],
            ]);
            triangle.triangles.push([first, first + 1, first + 2]);
            for mesh in [vertex, triangle] {
                let (found, part) = Orientation::find(&mut &mesh, None).unwrap();
                assert!(!part.has(&[[10.0, -far, far]; 3]));
                let counted = Orientation {
                    triangles: usual.triangles,
                    ..found
                };
                assert_eq!(counted, usual, "{far}");
            }
        }
    }

    #[test]
    fn a_scan_that_begins_with_a_speck_keeps_its_frame() {
        let clean = scan();
        let mut vertices: Vec<[f64; 3]> = vec![[1e9; 3], [1e9, 0.0, 0.0], [0.0, 1e9, 0.0]];
        vertices.extend(clean.vertices.iter());
        let faces = clean.triangles.iter().map(|face| face.map(|k| k + 3));
        let speck = Mesh {
            triangles: std::iter::once([0, 1, 2]).chain(faces).collect(),
            vertices: vertices.into(),
        };
        let [(usual, _), (found, _)] =
            [clean, speck].map(|mesh| Orientation::find(&mut &mesh, None).unwrap());
        assert_eq!(found.mm, usual.mm);
        for k in 0..3 {
            assert!((found.half_extent_mm[k] - usual.half_extent_mm[k]).abs() < 1.0);
            let [a, b] = [found, usual].map(|frame| Vector3::from(frame.axes[k]));
            assert!(a.dot(&b) > 0.999_99);
        }
    }

    #[test]
    fn coordinates_whose_squares_are_infinite_are_refused() {
        let mut mesh = scan();
        mesh.vertices
            .map_in_place(|vertex| vertex.map(|c| c * 1e200));
        let refused = Orientation::find(&mut &mesh, None);
        assert!(matches!(refused, Err(BlockError::NoArea { .. })));
    }

    #[test]
    fn a_mesh_without_area_is_refused() {
        let mesh = Mesh {
            vertices: [[0.0; 3]; 3].into_iter().collect(),
            triangles: [[0, 1, 2]].into_iter().collect(),
        };
        let refused = Orientation::find(&mut &mesh, None);
        assert!(matches!(refused, Err(BlockError::NoArea { triangles: 1 })));
    }
}
