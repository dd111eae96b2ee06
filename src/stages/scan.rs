//! A scan and its surface, which fit and depth both look at and which is made ready once.

use std::sync::OnceLock;

use super::zbuffer::IndexedSurface;
use crate::mesh::Mesh;

/// A scan as the stages see it: the mesh as read, and its surface once somebody has looked at it.
#[derive(Debug)]
pub struct Scan {
    mesh: Mesh,
    shell: OnceLock<IndexedSurface>,
}

impl Scan {
    /// The mesh as read.
    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The surface ready to be looked at along any direction.
    pub(super) fn shell(&self) -> &IndexedSurface {
        self.shell.get_or_init(|| IndexedSurface::new(&self.mesh))
    }
}

impl From<Mesh> for Scan {
    fn from(mesh: Mesh) -> Self {
        Self {
            mesh,
            shell: OnceLock::new(),
        }
    }
}
