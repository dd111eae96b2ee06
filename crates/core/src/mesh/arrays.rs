//! Meshes from arrays in memory, and back.

use super::missing::{CoordinateValue, are_positions};
use super::{Mesh, Vertices};
use crate::domain::cancel::{PollCounter, poll};
use crate::page_vec::PageVec;

/// Why arrays are no mesh. Positions count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshArrayError {
    /// There are no vertices.
    #[error("there are no vertices")]
    NoVertices,
    /// There are more vertices than indices of 32 bits.
    #[error("there are {0} vertices; at most 4294967295 can be used")]
    TooManyVertices(usize),
    /// A coordinate that is NaN or infinite.
    #[error(
        "vertex {vertex} (counted from 0) has the coordinate {value}, which is not a finite number; remove such vertices and their faces"
    )]
    NotFinite {
        /// Position of the vertex.
        vertex: usize,
        /// The coordinate.
        value: f64,
    },
    /// A face refers to a missing vertex.
    #[error(
        "face {face} refers to vertex {index}, but there are {vertices} vertices; both count from 0"
    )]
    IndexOutOfRange {
        /// Position of the face.
        face: usize,
        /// The index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
}

/// Positions in either precision.
#[derive(Debug, Clone, Copy)]
pub enum PositionSlice<'a> {
    /// Of 32 bits.
    Single(&'a [[f32; 3]]),
    /// Of 64 bits.
    Double(&'a [[f64; 3]]),
}

impl Mesh {
    /// Copies arrays to a mesh. Vertices keep their order. They become 32-bit floats if that changes none of them: the
    /// vertices of a file of 32-bit floats then give the same results, even if they were converted in between.
    ///
    /// ```
    /// use mocban_core::mesh::{Mesh, PositionSlice};
    ///
    /// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// let mesh = Mesh::from_arrays(PositionSlice::Double(&corners), &[[0, 1, 2]])?;
    /// assert_eq!(mesh.vertices.to_flat(), corners.as_flattened());
    /// assert!(Mesh::from_arrays(PositionSlice::Double(&corners), &[[0, 1, 3]]).is_err());
    /// # Ok::<(), mocban_core::mesh::MeshArrayError>(())
    /// ```
    ///
    /// # Errors
    /// Returns an error if there are no vertices, if a coordinate is not finite or if an index is out of range.
    pub fn from_arrays(
        positions: PositionSlice<'_>,
        faces: &[[u32; 3]],
    ) -> Result<Self, MeshArrayError> {
        let count = match positions {
            PositionSlice::Single(all) => {
                check_finite(all)?;
                all.len()
            }
            PositionSlice::Double(all) => {
                check_finite(all)?;
                all.len()
            }
        };
        if count == 0 {
            return Err(MeshArrayError::NoVertices);
        }
        let limit =
            u32::try_from(count).map_err(|_too_large| MeshArrayError::TooManyVertices(count))?;
        check_indices(faces, limit)?;
        let vertices = match positions {
            PositionSlice::Single(all) => Vertices::Single(PageVec::copied(all)),
            PositionSlice::Double(all) => exact_singles(all)
                .map_or_else(|| Vertices::Double(PageVec::copied(all)), Vertices::Single),
        };
        Ok(Self {
            vertices,
            triangles: PageVec::copied(faces),
        })
    }
}

impl Vertices {
    /// Copies all coordinates, three for each vertex.
    pub fn to_flat(&self) -> Vec<f64> {
        match self {
            Self::Single(all) => all.as_flattened().iter().map(|v| f64::from(*v)).collect(),
            Self::Double(all) => all.as_flattened().to_vec(),
        }
    }
}

/// Returns positions as 32-bit floats, or `None` if one of them would change.
fn exact_singles(all: &[[f64; 3]]) -> Option<PageVec<[f32; 3]>> {
    let mut singles = PageVec::with_capacity(all.len());
    for part in all.chunks(1 << 10) {
        poll();
        let is_exact = |value: &f64| f64::from(*value as f32) == *value;
        let values = part.as_flattened().iter();
        if !values.fold(true, |exact, value| exact & is_exact(value)) {
            return None;
        }
        singles.extend(
            part.iter()
                .map(|position| position.map(|value| value as f32)),
        );
    }
    Some(singles)
}

fn check_finite<T: CoordinateValue>(positions: &[[T; 3]]) -> Result<(), MeshArrayError> {
    for (block, part) in positions.chunks(1 << 10).enumerate() {
        poll();
        // A fast check. Numbers that stand for missing positions in files are positions here.
        if are_positions(part) {
            continue;
        }
        let mut values = part.as_flattened().iter().map(|value| (*value).into());
        if let Some(at) = values.position(|value: f64| !value.is_finite()) {
            return Err(MeshArrayError::NotFinite {
                vertex: (block << 10) + at / 3,
                value: part.as_flattened()[at].into(),
            });
        }
    }
    Ok(())
}

fn check_indices(faces: &[[u32; 3]], vertices: u32) -> Result<(), MeshArrayError> {
    let mut counter = PollCounter::default();
    for (face, corners) in faces.iter().enumerate() {
        counter.tick();
        if let Some(index) = corners.iter().find(|index| **index >= vertices) {
            return Err(MeshArrayError::IndexOutOfRange {
                face,
                index: *index,
                vertices: vertices as usize,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Mesh, MeshArrayError, PositionSlice, Vertices};

    #[test]
    fn arrays_of_either_precision_keep_their_order() {
        let single = [[0.1_f32, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
        let mesh = Mesh::from_arrays(PositionSlice::Single(&single), &[[2, 0, 1]]).expect("a mesh");
        assert_eq!(mesh.vertices.at(0)[0], f64::from(0.1_f32));
        assert_eq!(*mesh.triangles, [[2, 0, 1]]);
        let points = mesh.vertices.to_flat();
        let double = Mesh::from_arrays(PositionSlice::Double(points.as_chunks().0), &[]);
        let double = double.expect("points").vertices;
        assert!(matches!(&double, Vertices::Single(all) if **all == single));
        let finer = Mesh::from_arrays(PositionSlice::Double(&[[0.1; 3]]), &[]);
        let finer = finer.expect("points").vertices;
        assert!(matches!(&finer, Vertices::Double(all) if **all == [[0.1; 3]]));
    }

    #[test]
    fn the_first_wrong_vertex_or_face_is_named() {
        let mut many = vec![[0.0_f64; 3]; 5000];
        many[3000][1] = f64::NAN;
        let error = Mesh::from_arrays(PositionSlice::Double(&many), &[]).expect_err("not finite");
        assert!(
            error
                .to_string()
                .starts_with("vertex 3000 (counted from 0)"),
            "{error}"
        );
        let error = Mesh::from_arrays(PositionSlice::Double(&many[..3]), &[[0, 1, 2], [0, 3, 1]]);
        let wanted = MeshArrayError::IndexOutOfRange {
            face: 1,
            index: 3,
            vertices: 3,
        };
        assert_eq!(error, Err(wanted));
        let none = Mesh::from_arrays(PositionSlice::Single(&[]), &[]);
        assert_eq!(none, Err(MeshArrayError::NoVertices));
    }
}
