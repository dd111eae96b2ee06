//! Limits the memory of a block and all running pairs together. `memory_estimate` estimates that of a pair.

use std::fmt;
use std::path::PathBuf;

use super::input_reads::ReadItem;
use super::memory_estimate::{mesh_bytes, print_bytes};
use mocban_catalog::PairAttributes;
use mocban_core::domain::Stage;
use mocban_core::raster;
use mocban_store::Project;

/// Memory that is reserved for running pairs and a block, in estimated bytes.
#[derive(Debug)]
pub(super) struct MemoryBudget {
    limit: Option<u64>,
    reserved: u64,
}

impl MemoryBudget {
    /// Nothing is reserved yet. With `None` there is no limit.
    pub(super) const fn new(limit: Option<u64>) -> Self {
        Self { limit, reserved: 0 }
    }

    /// Returns whether there is a limit.
    pub(super) const fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    /// Reserves bytes for a pair or a block. Returns `false` if the limit does not allow it. One that needs more than
    /// the limit is accepted if nothing else is reserved.
    pub(super) fn reserve(&mut self, bytes: u64) -> bool {
        let reserved = self.reserved.saturating_add(bytes);
        let fits = self.reserved == 0 || self.limit.is_none_or(|limit| reserved <= limit);
        if fits {
            self.reserved = reserved;
        }
        fits
    }

    /// Returns the limit, if a pair or a block needs more than it allows in total.
    fn exceeded_by(&self, bytes: u64) -> Option<u64> {
        self.limit.filter(|limit| bytes > *limit)
    }

    /// Warns if a pair or a block needs more than the limit allows in total.
    pub(super) fn warn_if_exceeded(&self, what: fmt::Arguments<'_>, bytes: u64) {
        if let Some(limit) = self.exceeded_by(bytes) {
            let (need, limit) = (bytes >> 20, limit >> 20);
            tracing::warn!(
                "{what} may need {need} MiB, more than the {limit} MiB of --memory: it runs with no other pair beside it"
            );
        }
    }

    /// Ends a reservation.
    pub(super) const fn release(&mut self, bytes: u64) {
        self.reserved = self.reserved.saturating_sub(bytes);
    }
}

/// A pair whose memory is estimated.
pub(super) struct EstimatedPair {
    pub(super) project: Project,
    pub(super) attributes: PairAttributes,
    /// Next stage.
    pub(super) from: Stage,
    pub(super) limits: raster::ImageLimits,
    /// Memory for its maps and masks.
    pub(super) map_bytes: u64,
}

impl ReadItem for EstimatedPair {
    type Output = u64;

    fn read(&self) -> u64 {
        let inputs = input_bytes(&self.project, &self.attributes, self.from, &self.limits);
        self.map_bytes.saturating_add(inputs)
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.attributes.mesh_path)
    }
}

/// Estimates the memory in bytes that mesh and print of a pair need if it continues at stage `from`. A missing file counts
/// as empty, because its pair soon fails.
fn input_bytes(
    project: &Project,
    pair: &PairAttributes,
    from: Stage,
    images: &raster::ImageLimits,
) -> u64 {
    let mesh = match from {
        Stage::Fit | Stage::Depth => mesh_bytes(&project.input(&pair.mesh_path)),
        Stage::Normalize | Stage::Register => 0,
    };
    let print = match from {
        Stage::Fit | Stage::Depth | Stage::Normalize => {
            print_bytes(&project.input(&pair.print_path), images)
        }
        Stage::Register => 0,
    };
    mesh.saturating_add(print)
}

#[cfg(test)]
mod tests {
    use super::{EstimatedPair, MemoryBudget, input_bytes};
    use crate::input_reads::ReadItem as _;
    use crate::memory_estimate::{MAP_PIXEL_BYTES, PAIR_BYTES, map_bytes};
    use crate::tests::values;
    use mocban_align::stages::depth::{DepthParams, ResolutionBy};
    use mocban_core::domain::Stage;
    use mocban_core::raster;
    use mocban_store::Project;

    #[test]
    fn reservations_stay_within_the_limit_except_for_one_pair_that_exceeds_it() {
        let mut budget = MemoryBudget::new(Some(10));
        assert!(budget.reserve(4) && budget.reserve(6));
        assert!(!budget.reserve(1));
        budget.release(4);
        assert!(!budget.reserve(11), "others still hold some");
        budget.release(6);
        assert!(budget.reserve(11));
        assert!(!budget.reserve(1), "the large pair runs with no other");
        budget.release(11);
        assert!(budget.reserve(1));
        assert_eq!(budget.exceeded_by(11), Some(10));
        assert_eq!(budget.exceeded_by(10), None);
    }

    #[test]
    fn without_a_limit_every_reservation_is_granted() {
        let mut budget = MemoryBudget::new(None);
        assert!(budget.reserve(u64::MAX) && budget.reserve(u64::MAX));
    }

    #[test]
    fn the_estimate_follows_the_files_that_the_remaining_stages_read() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let write = |name: &str, bytes: usize| {
            std::fs::write(dir.path().join(name), vec![0; bytes]).expect("a file");
        };
        write("1.obj", 1000);
        write("1.jpg", 100);
        let attributes = values::pair_attributes("1.obj", "1.jpg");
        let few = raster::ImageLimits {
            max_pixels: 10,
            ..raster::ImageLimits::SUGGESTED
        };
        let from = |stage, limits| input_bytes(&project, &attributes, stage, limits);
        let print = 100 * 8 * 30 + 100;
        assert_eq!(
            from(Stage::Fit, &raster::ImageLimits::SUGGESTED),
            6000 + print
        );
        assert_eq!(
            from(Stage::Normalize, &raster::ImageLimits::SUGGESTED),
            print
        );
        assert_eq!(from(Stage::Normalize, &few), 10 * 30 + 100);
        assert_eq!(from(Stage::Register, &few), 0);
    }

    #[test]
    fn the_estimate_follows_the_size_of_the_depth_map() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let estimate = |depth: &DepthParams| {
            let pair = EstimatedPair {
                project: Project::create(dir.path()).expect("a project"),
                attributes: values::pair_attributes("none.obj", "none.jpg"),
                from: Stage::Register,
                limits: raster::ImageLimits::SUGGESTED,
                map_bytes: map_bytes(depth),
            };
            pair.read()
        };
        let by_side = |longest_px| DepthParams {
            resolution_by: ResolutionBy::LongestSide,
            longest_px,
            px_per_mm: 40.0,
        };
        for (longest_px, pixels) in [(512, 512_u64.pow(2)), (16_384, 1 << 28)] {
            let more = (pixels - 512 * 512) * MAP_PIXEL_BYTES;
            assert_eq!(estimate(&by_side(longest_px)), PAIR_BYTES + more);
        }
        let by_mm = DepthParams {
            resolution_by: ResolutionBy::PxPerMm,
            ..by_side(512)
        };
        let more = (2003_u64.pow(2) - 512 * 512) * MAP_PIXEL_BYTES;
        assert_eq!(estimate(&by_mm), PAIR_BYTES + more);
    }
}
