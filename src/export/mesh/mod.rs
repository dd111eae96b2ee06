//! Scans in the frame of their prints, as PLY, GLB, and files for CloudCompare and MeshLab.

mod glb;
mod matrix;
mod placed_mesh;
mod placement;
mod ply;
