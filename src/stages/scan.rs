//! A scan and its indexed surface, which fit and depth share.

use std::sync::OnceLock;

use super::zbuffer::IndexedSurface;
use crate::mesh::Mesh;

/// A mesh as read, and its surface, which is indexed on first use.
#[derive(Debug)]
pub struct Scan {
    mesh: Mesh,
    indexed: OnceLock<IndexedSurface>,
}

impl Scan {
    /// Returns the mesh as read.
    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the surface, ready to be rendered along any direction.
    pub(super) fn indexed(&self) -> &IndexedSurface {
        self.indexed.get_or_init(|| IndexedSurface::new(&self.mesh))
    }
}

impl From<Mesh> for Scan {
    fn from(mesh: Mesh) -> Self {
        Self {
            mesh,
            indexed: OnceLock::new(),
        }
    }
}
