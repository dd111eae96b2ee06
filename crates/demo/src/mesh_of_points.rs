//! A mesh that grows from a list of points and contains only the points in use.

use mocban_core::mesh::Mesh;

/// A mesh whose vertices are taken from a list of points. A point becomes a vertex when the first triangle uses it.
pub(super) struct MeshOfPoints<'a> {
    points: &'a [[f64; 3]],
    index: Vec<u32>,
    /// The mesh.
    pub mesh: Mesh,
}

impl<'a> MeshOfPoints<'a> {
    pub(super) fn new(points: &'a [[f64; 3]]) -> Self {
        Self {
            points,
            index: vec![u32::MAX; points.len()],
            mesh: Mesh::default(),
        }
    }

    /// Adds triangles.
    pub(super) fn add(&mut self, triangles: &[[usize; 3]]) {
        for triangle in triangles {
            let corners = triangle.map(|corner| self.vertex(corner));
            self.mesh.triangles.push(corners);
        }
    }

    /// Returns the vertex of a point, which is added if the mesh does not have it yet.
    pub(super) fn vertex(&mut self, point: usize) -> u32 {
        if self.index[point] == u32::MAX {
            self.index[point] = self.mesh.vertices.len() as u32;
            self.mesh.vertices.push(self.points[point]);
        }
        self.index[point]
    }
}
