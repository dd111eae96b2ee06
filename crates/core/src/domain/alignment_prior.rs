//! The alignment that the registration of a whole block expects of one of its characters.

use serde::{Deserialize, Serialize};

use super::transform::PrintFromMesh;

/// The expected alignment of a pair that was cut from a block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AlignmentPrior {
    /// Maps points of the mesh to pixels of the print. Row 3 has the normal of the block's face.
    pub print_from_mesh: PrintFromMesh,
    /// How sure the block is of it, 0..=1; 0 if an earlier version stored it.
    #[serde(default)]
    pub confidence: f64,
}
