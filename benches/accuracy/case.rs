//! Identity of a generated pair.

use mocban::demo::{DemoPair, PairGenerator, Tier};
use mocban::domain::Affine2;
use mocban::mesh::write::MeshFormat;

use super::run::Input;
use super::small_print::shrink;

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
    /// Longest side of the print in pixels. `None` means its own size.
    print_px: Option<u32>,
}

impl Case {
    /// Creates a case.
    pub(super) const fn new(
        tier: Tier,
        seed: u64,
        index: u64,
        vertices: Option<u32>,
        print_px: Option<u32>,
    ) -> Self {
        Self {
            tier,
            seed,
            index,
            vertices,
            print_px,
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
        let input = self.input(mesh, pair.print.clone())?;
        Ok((pair, input))
    }

    /// Returns files as the stages read them, with the print in the size of the case.
    pub(super) fn input(&self, mesh: Vec<u8>, print: Vec<u8>) -> anyhow::Result<Input> {
        let small = self.print_px.map(|px| shrink(&print, px)).transpose()?;
        Ok(match small.flatten() {
            Some(small) => Input {
                mesh,
                print: small.file,
                full_from_print: small.full_from_small,
            },
            None => Input {
                mesh,
                print,
                full_from_print: Affine2::IDENTITY,
            },
        })
    }
}
