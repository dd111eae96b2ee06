//! Identity of a generated pair.

use mocban::demo::{DemoPair, PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;

use super::run::Input;

/// A pair by tier, seed and index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Case {
    /// Its tier.
    pub(super) tier: Tier,
    /// Seed of the data.
    pub(super) seed: u64,
    /// Index in the data.
    pub(super) index: u64,
    /// Approximate number of vertices of the scan. `None` means a random number.
    vertices: Option<u32>,
}

impl Case {
    /// Creates a case from tier, seed and index.
    pub(super) const fn new(tier: Tier, seed: u64, index: u64, vertices: Option<u32>) -> Self {
        Self {
            tier,
            seed,
            index,
            vertices,
        }
    }

    /// Returns the generator of the tier and seed.
    pub(super) fn pairs(&self) -> PairGenerator {
        PairGenerator::new(self.tier, self.seed).with_vertices(self.vertices)
    }

    /// Generates the pair and the files that the stages read.
    pub(super) fn make(&self) -> anyhow::Result<(DemoPair, Input)> {
        let pair = self.pairs().pair(self.index)?;
        let mesh = MeshFormat::StlBinary.encode(&pair.mesh);
        let print = pair.print.clone();
        Ok((pair, Input { mesh, print }))
    }
}
