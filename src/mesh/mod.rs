//! Scanned surfaces in their own frame and unit, and the readers that bring them in.

pub mod write;

/// Triangles over vertices, in the mesh's own frame and unit. A point set has no triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions, all finite.
    pub vertices: Vec<[f64; 3]>,
    /// Indices into `vertices`, wound as in the file.
    pub triangles: Vec<[u32; 3]>,
}
