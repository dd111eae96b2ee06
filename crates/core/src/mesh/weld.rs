//! Finds and merges repeated vertices, which formats without shared corners (STL) produce.

use foldhash::{HashMap, HashMapExt};

use super::{Mesh, Vertices};
use crate::domain::cancel::polled;

impl Mesh {
    /// Merges vertices with exactly equal coordinates into the first of them, and removes faces that thereby have two
    /// equal corners. The order of the remaining vertices and faces stays.
    ///
    /// ```
    /// use mocban_core::mesh::Mesh;
    ///
    /// let soup = Mesh {
    ///     vertices: vec![
    ///         [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0],
    ///         [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0],
    ///     ].into(),
    ///     triangles: vec![[0, 1, 2], [3, 4, 5]].into(),
    /// };
    /// let welded = soup.welded();
    /// assert_eq!(welded.vertices.len(), 4);
    /// assert_eq!(*welded.triangles, [[0, 1, 2], [1, 3, 2]]);
    /// ```
    #[must_use]
    pub fn welded(self) -> Self {
        let welded = self.position_numbers();
        let Self {
            vertices,
            triangles,
        } = self;
        let mut kept = Vec::new();
        for (place, number) in (0..).zip(polled(&welded)) {
            if *number as usize == kept.len() {
                kept.push(place);
            }
        }
        if kept.len() == vertices.len() {
            return Self {
                vertices,
                triangles,
            };
        }
        let faces = polled(triangles.iter());
        let faces = faces.map(|face| face.map(|corner| welded[corner as usize]));
        Self {
            triangles: faces
                .filter(|[a, b, c]| a != b && b != c && c != a)
                .collect(),
            vertices: vertices.select(&kept),
        }
    }

    /// Numbers the distinct positions of vertices from 0, in the order of the first vertex at each. Returns the number of
    /// each vertex's position.
    pub fn position_numbers(&self) -> Vec<u32> {
        let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.vertices.len() / 4);
        let number = |vertex: [f64; 3]| {
            // Adding zero makes negative zero positive, so that both are the same position.
            let key = vertex.map(|c| (c + 0.0).to_bits());
            let next = known.len() as u32;
            *known.entry(key).or_insert(next)
        };
        polled(self.vertices.iter()).map(number).collect()
    }
}

impl Vertices {
    /// Returns the vertices at the given places, in the same precision.
    pub(super) fn select(&self, places: &[u32]) -> Self {
        let places = polled(places).map(|place| *place as usize);
        match self {
            Self::Single(all) => Self::Single(places.map(|place| all[place]).collect()),
            Self::Double(all) => Self::Double(places.map(|place| all[place]).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use crate::mesh::{Mesh, Vertices};

    #[test]
    fn a_mesh_without_repeated_vertices_is_unchanged() {
        let mesh = Mesh {
            vertices: Vertices::Single(
                vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 2.0, 1.0]].into(),
            ),
            // A face with two equal corners of the file itself stays.
            triangles: vec![[0, 1, 2], [0, 0, 1]].into(),
        };
        assert_eq!(mesh.clone().welded(), mesh);
    }

    #[test]
    fn signed_zeros_are_one_position() {
        let mesh = Mesh {
            vertices: vec![[0.0, 1.0, 0.0], [-0.0, 1.0, 0.0]].into(),
            triangles: Vec::new().into(),
        };
        assert_eq!(mesh.welded().vertices.len(), 1);
    }

    proptest! {
        #[test]
        fn faces_keep_their_positions_and_no_vertex_repeats(
            soup in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(0_u8..3)), 1..40),
        ) {
            let vertices: Vec<[f32; 3]> = soup.iter().flatten().map(|p| p.map(f32::from)).collect();
            let mesh = Mesh::from_soup(Vertices::Single(vertices.into()));
            let whole = |mesh: &Mesh| {
                let corners = |face: &[u32; 3]| face.map(|k| mesh.vertices.at(k as usize));
                let faces = mesh.triangles.iter().map(corners);
                faces.filter(|[a, b, c]| a != b && b != c && c != a).collect::<Vec<_>>()
            };
            let welded = mesh.clone().welded();
            prop_assert_eq!(whole(&welded), whole(&mesh));
            let all: Vec<[f64; 3]> = welded.vertices.iter().collect();
            prop_assert!((0..all.len()).all(|k| !all[..k].contains(&all[k])));
        }
    }
}
