//! Triangle meshes and their vertices.

use crate::domain::cancel::polled;
use crate::page_vec::PageVec;

/// A triangle mesh in its own frame and unit. A point set is a mesh without triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions of corners and points.
    pub vertices: Vertices,
    /// Indices into `vertices`, with the winding of the file.
    pub triangles: PageVec<[u32; 3]>,
}

impl Mesh {
    /// Creates a mesh in which vertices 0 to 2 form the first triangle, vertices 3 to 5 the second, and so on.
    pub fn from_soup(vertices: Vertices) -> Self {
        let triangles = polled((0..vertices.len() as u32).step_by(3))
            .map(|first| [first, first + 1, first + 2])
            .collect();
        Self {
            vertices,
            triangles,
        }
    }
}

/// Finite positions in the mesh's own frame and unit. 32-bit floats stay 32-bit, because memory traffic dominates the
/// run time.
#[derive(Debug, Clone)]
pub enum Vertices {
    /// From files of 32-bit floats, as scanners write.
    Single(PageVec<[f32; 3]>),
    /// From text and 64-bit floats.
    Double(PageVec<[f64; 3]>),
}

impl Vertices {
    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(all) => all.len(),
            Self::Double(all) => all.len(),
        }
    }

    /// Returns whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns a vertex; panics if it is out of range.
    #[inline]
    pub fn at(&self, place: usize) -> [f64; 3] {
        match self {
            Self::Single(all) => all[place].map(f64::from),
            Self::Double(all) => all[place],
        }
    }

    /// Iterates over the vertices in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + Clone {
        (0..self.len()).map(|place| self.at(place))
    }

    /// Appends a vertex; converts all to double precision.
    pub fn push(&mut self, vertex: [f64; 3]) {
        self.make_double().push(vertex);
    }

    /// Replaces a vertex; panics if it is out of range.
    pub fn set(&mut self, place: usize, vertex: [f64; 3]) {
        self.make_double()[place] = vertex;
    }

    /// Applies a function to each vertex.
    pub fn map_in_place(&mut self, other: impl Fn([f64; 3]) -> [f64; 3]) {
        for vertex in polled(self.make_double().iter_mut()) {
            *vertex = other(*vertex);
        }
    }

    /// Converts to double precision, so that any position can be stored.
    fn make_double(&mut self) -> &mut PageVec<[f64; 3]> {
        if let Self::Single(_) = self {
            *self = polled(self.iter()).collect();
        }
        match self {
            Self::Double(all) => all,
            Self::Single(_) => unreachable!("converted above"),
        }
    }
}

impl Default for Vertices {
    fn default() -> Self {
        Self::Double(PageVec::default())
    }
}

/// Equal if the positions are, in either precision.
impl PartialEq for Vertices {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl From<Vec<[f64; 3]>> for Vertices {
    fn from(all: Vec<[f64; 3]>) -> Self {
        Self::Double(all.into())
    }
}

impl FromIterator<[f64; 3]> for Vertices {
    fn from_iter<I: IntoIterator<Item = [f64; 3]>>(all: I) -> Self {
        Self::Double(all.into_iter().collect())
    }
}

impl Extend<[f64; 3]> for Vertices {
    fn extend<I: IntoIterator<Item = [f64; 3]>>(&mut self, more: I) {
        self.make_double().extend(more);
    }
}

#[cfg(test)]
mod tests {
    use super::Vertices;

    #[test]
    fn both_precisions_hold_the_same_positions() {
        let single = Vertices::Single(vec![[0.1_f32, 2.0, -3.5], [4.0, 5.0, 6.25]].into());
        let mut double: Vertices = single.iter().collect();
        assert_eq!(single, double);
        assert_eq!(single.at(0)[0], f64::from(0.1_f32));
        let mut more = single.clone();
        for vertices in [&mut more, &mut double] {
            vertices.push([0.1, 0.2, 0.3]);
            vertices.map_in_place(|[x, y, z]| [z, x, y]);
            vertices.extend([[7.0; 3]]);
            vertices.set(1, [0.7; 3]);
        }
        assert_eq!(more, double);
        assert_eq!(more.at(2), [0.3, 0.1, 0.2]);
        assert_ne!(single, more);
        assert_eq!((single.len(), more.len()), (2, 4));
    }
}
