//! What is left out of a mesh: vertices without a position, and faces without three corners.
//!
//! Scanners and converters write NaN for a point that they did not measure, 0 0 0 in organized clouds, and others a number
//! that no scan has, such as 1e30 or the largest float. Smaller numbers are found where several vertices share one that is
//! far from the others, or one that is usual for missing heights.

use super::error::MeshError;
use super::extreme_vertices::ExtremeVertices;
use super::far_values::{VertexKind, find_far_values};
use super::{Mesh, Vertices};
use crate::domain::MeshLosses;
use crate::domain::cancel::polled;

/// Absolute values from this on, about 1e15, stand for a missing coordinate. No scan is so large in any unit: 1 m has 1e9
/// nanometres. The number is a power of two, so that it is the same in single precision.
const MISSING_FROM: f64 = (1_u64 << 50) as f64;

/// Absolute values below this multiple of the largest one that was noticed are not noticed.
const ROOM: f64 = 1.125;

/// A mesh as read.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshRead {
    /// The vertices with a position, and the faces between them.
    pub mesh: Mesh,
    /// What was left out.
    pub losses: MeshLosses,
}

/// Notices vertices that may have no position, while a file is read.
#[derive(Debug, Clone, Copy)]
pub(super) struct PositionCheck {
    are_all_positions: bool,
    /// Number of vertices at the origin.
    origins: u64,
    /// Absolute values below this one are not noticed. It grows a few times, so that almost all vertices are compared with it
    /// alone.
    bound: f64,
    /// The extreme ones of the vertices that were noticed. All others are at most [`ROOM`] times as far from the origin.
    pub(super) extremes: ExtremeVertices,
}

impl PositionCheck {
    /// Checks no vertex yet.
    pub(super) const NONE: Self = Self {
        are_all_positions: true,
        origins: 0,
        bound: 0.0,
        extremes: ExtremeVertices::NONE,
    };

    /// Checks all vertices of a mesh.
    pub(super) fn of(vertices: &Vertices) -> Self {
        let mut check = Self::NONE;
        match vertices {
            Vertices::Single(all) => polled(all.chunks(256)).for_each(|part| check.add(part)),
            Vertices::Double(all) => polled(all.chunks(256)).for_each(|part| check.add(part)),
        }
        check
    }

    /// Checks some more vertices that faces use.
    pub(super) fn add_used<T: CoordinateValue>(&mut self, positions: &[[T; 3]]) {
        if !are_below(positions, T::rounded(self.bound)) {
            self.add_far(positions);
        }
    }

    /// Checks some more vertices, of which one is outside of the bound.
    #[cold]
    fn add_far<T: CoordinateValue>(&mut self, positions: &[[T; 3]]) {
        self.are_all_positions &= are_positions(positions);
        let vertices = positions
            .iter()
            .map(|position| position.map(Into::<f64>::into));
        for vertex in vertices.filter(|vertex| is_position(*vertex)) {
            self.extremes.add(vertex);
        }
        self.bound = (ROOM * self.extremes.largest()).min(MISSING_FROM);
    }

    /// Checks some more vertices.
    #[inline]
    pub(super) fn add<T: CoordinateValue>(&mut self, positions: &[[T; 3]]) {
        let bound = T::rounded(self.bound);
        let values = positions.as_flattened().iter();
        if !values.fold(true, |usual, value| usual & value.is_usual(bound)) {
            self.add_used(positions);
            self.origins += origins(positions);
        }
    }

    /// Leaves out vertices without a position, and faces that use them. `incomplete_faces` were left out before.
    ///
    /// Several vertices at the origin have no position if no face uses them; one may be a point.
    ///
    /// # Errors
    /// Returns an error if nothing is left.
    pub(super) fn without_missing(
        self,
        mesh: Mesh,
        kind: VertexKind,
        incomplete_faces: u64,
    ) -> Result<MeshRead, MeshError> {
        let losses = |missing_vertices| MeshLosses {
            missing_vertices,
            incomplete_faces,
        };
        let far_values = find_far_values(&mesh.vertices, kind, &self.extremes, is_position);
        let are_positions = self.are_all_positions && far_values.0.is_empty();
        if are_positions && (self.origins < 2 || !has_unused_origin(&mesh)) {
            let losses = losses(0);
            return Ok(MeshRead { mesh, losses });
        }
        let Mesh {
            vertices,
            mut triangles,
        } = mesh;
        let is_kept = |vertex| is_position(vertex) && !far_values.are_at(vertex);
        let is_kept_vertex: Vec<bool> = polled(vertices.iter()).map(is_kept).collect();
        let mut uses = vec![Use::None; is_kept_vertex.len()];
        let is_points = triangles.is_empty();
        triangles = polled(triangles.iter().copied())
            .filter(|corners| {
                let corners = corners.map(|corner| corner as usize);
                let is_kept = corners.iter().all(|corner| is_kept_vertex[*corner]);
                for corner in corners {
                    uses[corner] = uses[corner].max(if is_kept { Use::Kept } else { Use::Removed });
                }
                is_kept
            })
            .collect();
        let (mut kept, mut missing) = (Vec::new(), 0);
        for (index, vertex) in (0..).zip(polled(vertices.iter())) {
            let used = uses[index as usize];
            let is_unused_origin = used == Use::None && self.origins > 1 && is_origin(vertex);
            if !is_kept_vertex[index as usize] || is_unused_origin {
                missing += 1;
            } else if used != Use::Removed {
                kept.push(index);
            }
        }
        if kept.is_empty() || (triangles.is_empty() && !is_points) {
            let vertices = is_kept_vertex.len() as u64;
            return Err(MeshError::NothingLeft { missing, vertices });
        }
        let mut new_index = vec![0; is_kept_vertex.len()];
        for (new, old) in (0..).zip(polled(&kept)) {
            new_index[*old as usize] = new;
        }
        for index in polled(triangles.as_flattened_mut()) {
            *index = new_index[*index as usize];
        }
        let vertices = vertices.select(&kept);
        let mesh = Mesh {
            vertices,
            triangles,
        };
        let losses = losses(missing);
        Ok(MeshRead { mesh, losses })
    }
}

/// A coordinate of 32 or 64 bits, which is 0 by default.
pub(super) trait CoordinateValue: Copy + Into<f64> + PartialEq + Default {
    /// Returns whether a value does not stand for a missing coordinate.
    fn is_coordinate(self) -> bool;

    /// Returns a number in the precision of coordinates.
    fn rounded(value: f64) -> Self;

    /// Returns whether an absolute value is below a bound.
    fn is_below(self, bound: Self) -> bool;

    /// Returns whether a value is not 0 and below a bound.
    #[inline]
    fn is_usual(self, bound: Self) -> bool {
        (self != Self::default()) & self.is_below(bound)
    }
}

impl CoordinateValue for f32 {
    #[inline]
    fn is_coordinate(self) -> bool {
        self.abs() < MISSING_FROM as Self
    }

    #[inline]
    fn rounded(value: f64) -> Self {
        value as Self
    }

    #[inline]
    fn is_below(self, bound: Self) -> bool {
        self.abs() < bound
    }
}

impl CoordinateValue for f64 {
    #[inline]
    fn is_coordinate(self) -> bool {
        self.abs() < MISSING_FROM
    }

    #[inline]
    fn rounded(value: f64) -> Self {
        value
    }

    #[inline]
    fn is_below(self, bound: Self) -> bool {
        self.abs() < bound
    }
}

/// Returns whether no coordinate is missing.
#[inline(never)] // As a loop of its own, it is vectorized.
pub(super) fn are_positions<T: CoordinateValue>(positions: &[[T; 3]]) -> bool {
    let values = positions.as_flattened().iter();
    values.fold(true, |all, value| all & value.is_coordinate())
}

/// Returns whether the absolute values of all coordinates are below a bound.
#[inline(never)] // Like `are_positions`.
fn are_below<T: CoordinateValue>(positions: &[[T; 3]], bound: T) -> bool {
    let values = positions.as_flattened().iter();
    values.fold(true, |all, value| all & value.is_below(bound))
}

/// Returns the number of positions at the origin.
fn origins<T: CoordinateValue>(positions: &[[T; 3]]) -> u64 {
    if !has_adjacent_zeros(positions.as_flattened()) {
        return 0;
    }
    let is_origin = |position: &&[T; 3]| **position == [T::default(); 3];
    positions.iter().filter(is_origin).count() as u64
}

/// Returns whether a value and the next one are 0, as at every origin.
#[inline(never)] // Like `are_positions`.
fn has_adjacent_zeros<T: CoordinateValue>(values: &[T]) -> bool {
    let zero = T::default();
    let pairs = values.iter().zip(values.iter().skip(1));
    pairs.fold(false, |found, (a, b)| found | ((*a == zero) & (*b == zero)))
}

/// Returns whether a vertex that no face uses is at the origin.
fn has_unused_origin(mesh: &Mesh) -> bool {
    let mut is_used = vec![false; mesh.vertices.len()];
    for part in polled(mesh.triangles.chunks(256)) {
        for corner in part.as_flattened() {
            is_used[*corner as usize] = true;
        }
    }
    polled(mesh.vertices.iter().zip(is_used)).any(|(vertex, is_used)| !is_used && is_origin(vertex))
}

/// Returns whether no coordinate is missing.
pub(super) fn is_position(position: [f64; 3]) -> bool {
    position.into_iter().all(CoordinateValue::is_coordinate)
}

fn is_origin(position: [f64; 3]) -> bool {
    position == [0.0; 3]
}

/// The faces that use a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    None,
    /// Only faces that are left out.
    Removed,
    /// At least one that is kept.
    Kept,
}

#[cfg(test)]
mod tests {
    use super::PositionCheck;
    use crate::mesh::far_values::VertexKind;
    use crate::mesh::{Mesh, MeshError, Vertices};

    const NAN: [f64; 3] = [1.0, f64::NAN, 0.0];

    fn without_missing(
        vertices: Vec<[f64; 3]>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<(Mesh, u64), MeshError> {
        let mesh = Mesh {
            vertices: vertices.into(),
            triangles: triangles.into(),
        };
        let check = PositionCheck::of(&mesh.vertices);
        check
            .without_missing(mesh, VertexKind::Shared, 0)
            .map(|read| (read.mesh, read.losses.missing_vertices))
    }

    #[test]
    fn faces_go_with_their_vertices_and_others_are_renumbered() {
        let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]];
        // The last vertex is used only by the face that is left out.
        let vertices = vec![NAN, a, b, c, d, [9.0; 3]];
        let (mesh, missing) =
            without_missing(vertices, vec![[1, 2, 3], [0, 1, 5], [2, 4, 3]]).expect("sound");
        assert_eq!(missing, 1);
        assert_eq!(mesh.vertices, vec![a, b, c, d].into());
        assert_eq!(*mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    }

    #[test]
    fn one_point_at_the_origin_stays_and_several_without_faces_go() {
        let points = vec![[0.0; 3], [1.0; 3], [0.0, -0.0, 0.0], [2.0; 3]];
        let (mesh, missing) = without_missing(points[..2].to_vec(), Vec::new()).expect("sound");
        assert_eq!((mesh.vertices.len(), missing), (2, 0));
        let (mesh, missing) = without_missing(points.clone(), Vec::new()).expect("sound");
        assert_eq!(
            (mesh.vertices, missing),
            (vec![[1.0; 3], [2.0; 3]].into(), 2)
        );
        let (mesh, missing) = without_missing(points, vec![[0, 1, 3]]).expect("sound");
        assert_eq!((mesh.vertices.len(), missing), (3, 1));
    }

    #[test]
    fn numbers_that_no_scan_has_stand_for_missing_positions() {
        for far in [
            2e15,
            -1e30,
            f64::from(f32::MAX),
            f64::MIN,
            f64::NEG_INFINITY,
        ] {
            let points = vec![[1.0; 3], [2.0, far, 0.5], [3.0, 1e9, -1e14], [far; 3]];
            let (mesh, missing) = without_missing(points, Vec::new()).expect("sound");
            let kept = vec![[1.0; 3], [3.0, 1e9, -1e14]];
            assert_eq!((mesh.vertices, missing), (kept.into(), 2), "{far}");
        }
        let singles = vec![[1.0_f32; 3], [f32::MAX, 0.0, 0.0]];
        let check = PositionCheck::of(&Vertices::Single(singles.into()));
        assert!(!check.are_all_positions);
    }

    #[test]
    fn a_mesh_of_which_nothing_is_left_is_refused() {
        let [all, faces] = [vec![], vec![[0, 1, 2]]].map(|triangles| {
            let vertices = vec![NAN, [1.0; 3], [2.0, 1.0, 0.0]];
            without_missing(vertices, triangles)
        });
        assert!(all.is_ok());
        let refused = faces.expect_err("no face").to_string();
        assert_eq!(
            refused,
            "1 of 3 vertices have no position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside), and without them nothing is left"
        );
    }
}
