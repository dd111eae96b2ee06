//! Writes the mesh of a block row by row, so that the memory does not grow with the file.

use std::io::{self, Write};

use super::ply_file::write_ply;
use super::solid::BlockSolid;
use super::stl_file::write_stl;

/// Format of a block's mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockMeshFormat {
    /// Binary STL.
    Stl,
    /// Binary PLY, little-endian, with indexed vertices.
    Ply,
}

impl BlockMeshFormat {
    /// Returns the extension of the file's name.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Ply => "ply",
        }
    }
}

/// Writes the mesh of a block.
pub(super) fn write_solid(
    solid: &BlockSolid,
    format: BlockMeshFormat,
    out: &mut impl Write,
) -> io::Result<()> {
    match format {
        BlockMeshFormat::Stl => write_stl(solid, out),
        BlockMeshFormat::Ply => write_ply(solid, out),
    }
}
