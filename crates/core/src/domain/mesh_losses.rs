//! What is left out of a mesh when it is read.

/// What was left out of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MeshLosses {
    /// Number of vertices without a position: a coordinate is NaN, infinite or 1e15 or more, several vertices without faces
    /// are at the origin, or many share a number that is far from the others.
    pub missing_vertices: u64,
    /// Number of faces with fewer than three corners in the file.
    pub incomplete_faces: u64,
}

impl MeshLosses {
    /// Says what was left out, one sentence each.
    pub fn sentences(self) -> Vec<String> {
        let said = [
            (
                "vertices without a position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside) were left out with their faces",
                self.missing_vertices,
            ),
            (
                "faces with fewer than three corners were left out",
                self.incomplete_faces,
            ),
        ];
        let said = said.into_iter().filter(|(_, number)| *number > 0);
        said.map(|(text, number)| format!("{text}: {number}"))
            .collect()
    }
}
