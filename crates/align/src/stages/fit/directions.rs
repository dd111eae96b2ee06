//! Directions from which the carved side of a scan may be seen.

use nalgebra::Vector3;

use super::pca::Axes;
use mocban_core::mesh::Mesh;

/// Largest number of faces that are sampled.
const SAMPLES: usize = 30_000;
/// Normals within this angle, in radians, belong to the same plane.
pub(super) const SAME: f64 = 0.26;
/// Directions closer than this angle, in radians, count as one, because the fit of a side corrects smaller tilts.
const DISTINCT: f64 = 0.2;
/// A plane is large if the faces with normals within [`SAME`] of its normal have at least this fraction of the area of
/// all sampled faces.
const LEAST_AREA: f64 = 0.04;
/// Largest number of large planes.
const PLANES: usize = 6;
/// Normals are grouped by the cells of a cube's surface. Each face of the cube has this many cells along a side.
const CELLS: i32 = 12;

/// A sampled face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    pub(super) middle: Vector3<f64>,
    pub(super) normal: Vector3<f64>,
    pub(super) area: f64,
}

/// Samples every n-th face in the order of the file, so that at most [`SAMPLES`] remain. Leaves out faces without area.
pub(super) fn facets(mesh: &Mesh) -> Vec<Facet> {
    let stride = mesh.triangles.len().div_ceil(SAMPLES).max(1);
    let faces = mesh.triangles.iter().step_by(stride);
    let facet = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|corner| Vector3::from(mesh.vertices.at(corner as usize)));
        let normal = (b - a).cross(&(c - a));
        let area = normal.norm() / 2.0;
        (area > 0.0).then(|| Facet {
            middle: (a + b + c) / 3.0,
            normal: normal / (2.0 * area),
            area,
        })
    };
    faces.filter_map(facet).collect()
}

/// Returns the principal axes and the normals of the largest planes, each in both directions.
pub(super) fn candidates(axes: &Axes, facets: &[Facet]) -> Vec<Vector3<f64>> {
    let [first, second, least] = axes.directions;
    let mut lines = vec![least];
    for normal in large_planes(facets).into_iter().chain([second, first]) {
        if lines.iter().all(|line| angle(line, &normal) > DISTINCT) {
            lines.push(normal);
        }
    }
    lines.iter().flat_map(|line| [*line, -line]).collect()
}

/// Returns the unit normals of at most [`PLANES`] large planes, roughly from the largest to the smallest: each starts
/// at the cell with the largest area among the faces that belong to no earlier plane. Opposite normals count as one.
pub(super) fn large_planes(facets: &[Facet]) -> Vec<Vector3<f64>> {
    let total: f64 = facets.iter().map(|facet| facet.area).sum();
    let mut left: Vec<Facet> = facets.to_vec();
    let mut planes = Vec::new();
    while planes.len() < PLANES && !left.is_empty() {
        let mut normal = fullest_cell(&left);
        // The mean of all near normals is closer to the plane's normal than the mean of one cell.
        let mut area = 0.0;
        for _ in 0..3 {
            let mut sum = Vector3::zeros();
            area = 0.0;
            for facet in left
                .iter()
                .filter(|facet| angle(&facet.normal, &normal) < SAME)
            {
                let same_way = facet.normal.dot(&normal).signum();
                sum += facet.normal * (same_way * facet.area);
                area += facet.area;
            }
            if sum.norm() > 0.0 {
                normal = sum.normalize();
            }
        }
        if area < LEAST_AREA * total {
            break;
        }
        left.retain(|facet| angle(&facet.normal, &normal) >= SAME);
        planes.push(normal);
    }
    planes
}

/// Returns the mean normal of the cell with the largest area.
fn fullest_cell(facets: &[Facet]) -> Vector3<f64> {
    let side = CELLS as usize;
    let mut cells = vec![(0.0, Vector3::zeros()); 3 * side * side];
    for facet in facets {
        let axis = facet.normal.iamax();
        let normal = facet.normal * facet.normal[axis].signum();
        let cell = |k: usize| {
            let share = normal[(axis + k) % 3] / normal[axis];
            let place = (f64::midpoint(share, 1.0) * f64::from(CELLS)) as usize;
            place.min(side - 1)
        };
        let (area, sum) = &mut cells[(axis * side + cell(1)) * side + cell(2)];
        *area += facet.area;
        *sum += normal * facet.area;
    }
    let fullest = cells.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    fullest.map_or_else(Vector3::z, |(_, sum)| sum.normalize())
}

/// Returns the angle in radians between two lines, given as unit vectors, from 0 to a right angle.
pub(super) fn angle(one: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    one.dot(other).abs().min(1.0).acos()
}
