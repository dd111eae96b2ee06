//! A scan and its indexed surface, which fit and depth share.

use std::sync::OnceLock;

use super::zbuffer::IndexedSurface;
use mocban_core::domain::cancel::polled;
use mocban_core::domain::{MeshLosses, ScanRegion};
use mocban_core::mesh::{Mesh, MeshRead};

/// A mesh as read, and its surface, which is indexed on first use.
#[derive(Debug)]
pub struct Scan {
    mesh: Mesh,
    losses: MeshLosses,
    indexed: OnceLock<IndexedSurface>,
}

impl Scan {
    /// Returns the mesh as read.
    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns what was left out of the file's mesh.
    pub const fn losses(&self) -> MeshLosses {
        self.losses
    }

    /// Returns the faces with all corners in a region. For a mesh without faces, returns the points in the region.
    pub(super) fn mesh_in(&self, region: &ScanRegion) -> Mesh {
        part_of(&self.mesh, |corner| region.contains(corner))
    }

    /// Returns the surface, ready to be rendered along any direction.
    pub(super) fn indexed(&self) -> &IndexedSurface {
        self.indexed.get_or_init(|| IndexedSurface::new(&self.mesh))
    }
}

impl From<MeshRead> for Scan {
    fn from(MeshRead { mesh, losses }: MeshRead) -> Self {
        Self {
            mesh,
            losses,
            indexed: OnceLock::new(),
        }
    }
}

impl From<Mesh> for Scan {
    fn from(mesh: Mesh) -> Self {
        let losses = MeshLosses::default();
        MeshRead { mesh, losses }.into()
    }
}

/// Returns the faces with only corners that `keeps` accepts. For a mesh without faces, returns the accepted points.
pub(super) fn part_of(mesh: &Mesh, keeps: impl Fn([f64; 3]) -> bool) -> Mesh {
    let kept: Vec<bool> = polled(mesh.vertices.iter()).map(keeps).collect();
    let faces: Vec<[u32; 3]> = polled(mesh.triangles.iter().copied())
        .filter(|face| face.iter().all(|corner| kept[*corner as usize]))
        .collect();
    if mesh.triangles.is_empty() {
        let points = polled(mesh.vertices.iter()).zip(kept);
        let points = points.filter_map(|(point, kept)| kept.then_some(point));
        return Mesh {
            vertices: points.collect::<Vec<_>>().into(),
            triangles: Vec::new().into(),
        };
    }
    of_faces(mesh, &faces)
}

/// Returns the mesh of some faces, without the vertices that no face uses.
pub(super) fn of_faces(mesh: &Mesh, faces: &[[u32; 3]]) -> Mesh {
    let mut places = vec![u32::MAX; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let mut renumbered = Vec::with_capacity(faces.len());
    for face in polled(faces) {
        renumbered.push(face.map(|corner| {
            let place = &mut places[corner as usize];
            if *place == u32::MAX {
                *place = vertices.len() as u32;
                vertices.push(mesh.vertices.at(corner as usize));
            }
            *place
        }));
    }
    Mesh {
        vertices: vertices.into(),
        triangles: renumbered.into(),
    }
}
