//! Size limits of input files.

use serde::{Deserialize, Serialize};

use crate::mesh::MeshLimits;
use crate::raster::ImageLimits;

/// Size limits above which an input file is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputLimits {
    /// Limits of mesh files.
    pub mesh: MeshLimits,
    /// Limits of print images.
    pub image: ImageLimits,
}

impl InputLimits {
    /// The suggested limits of both.
    pub const SUGGESTED: Self = Self {
        mesh: MeshLimits::SUGGESTED,
        image: ImageLimits::SUGGESTED,
    };
}
