//! Which pair of which data.

use mocban::demo::{DemoPair, PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;

use super::run::Input;

/// A pair by what it is made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Case {
    /// Its tier.
    pub(super) tier: Tier,
    /// Seed of the data.
    pub(super) seed: u64,
    /// Place in the data.
    pub(super) index: u64,
    /// About how many vertices the scan has, if that is not left to chance.
    vertices: Option<u32>,
}

impl Case {
    /// A pair by tier, seed and place.
    pub(super) const fn new(tier: Tier, seed: u64, index: u64, vertices: Option<u32>) -> Self {
        Self {
            tier,
            seed,
            index,
            vertices,
        }
    }

    /// All pairs of its kind.
    pub(super) fn pairs(&self) -> PairGenerator {
        PairGenerator::new(self.tier, self.seed).with_vertices(self.vertices)
    }

    /// Makes the pair and what the stages are given of it.
    pub(super) fn make(&self) -> anyhow::Result<(DemoPair, Input)> {
        let pair = self.pairs().pair(self.index)?;
        let mesh = MeshFormat::StlBinary.encode(&pair.mesh);
        let print = pair.print.clone();
        Ok((pair, Input { mesh, print }))
    }
}
