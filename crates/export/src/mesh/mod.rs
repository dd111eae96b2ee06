//! Scans in the frame of their prints, as PLY, GLB, and files for `CloudCompare` and `MeshLab`.

mod glb;
mod matrix;
mod meshlab;
mod placed_mesh;
mod placement;
mod ply;
mod scan_files;

pub(super) use glb::texture_coordinates;
pub(super) use placed_mesh::PlacedMesh;
pub(super) use placement::MeshPlacement;
pub(super) use scan_files::{ScanFiles, ScanTitle};
