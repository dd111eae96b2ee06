//! The depth map: heights over the fitted surface, mirrored so that it reads like the print.

use super::warp_mask::warp_level_sets;
use super::{Grid, Mask};
use crate::domain::cancel::poll;
use crate::domain::{Affine2, DepthScale};

/// Levels that are copied between two polls for a cancellation.
const LEVELS_PER_POLL: usize = 1 << 16;

/// A 16-bit depth map. Level 0 means no data. Levels 1..=65535 are linear in height.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    /// Level of each pixel.
    pub levels: Grid<u16>,
    /// Scale of levels and pixels.
    pub scale: DepthScale,
}

impl DepthMap {
    /// Returns the height over the fitted surface at a pixel, in mesh units, or `None` without data.
    pub fn height(&self, x: usize, y: usize) -> Option<f64> {
        match self.levels.at(x, y) {
            0 => None,
            level => Some(self.scale.height(level)),
        }
    }

    /// Returns the levels of all pixels with data, row by row.
    pub fn valid_levels(&self) -> Vec<u16> {
        let mut valid = Vec::new();
        for part in self.levels.data().chunks(LEVELS_PER_POLL) {
            poll();
            valid.extend(part.iter().copied().filter(|level| *level > 0));
        }
        valid
    }

    /// Returns the stroke mask at a threshold: the pixels whose level is at least `level`. Pixels without data are never
    /// set.
    pub fn stroke_mask(&self, level: u16) -> Mask {
        self.levels.map(|found| *found >= level.max(1))
    }

    /// Returns the stroke masks at several thresholds, warped into another frame of `width` x `height` pixels.
    /// `to_from` maps depth-map pixels to pixels of that frame.
    pub fn warped_stroke_masks(
        &self,
        to_from: &Affine2,
        [width, height]: [usize; 2],
        levels: &[u16],
    ) -> Vec<Mask> {
        let levels: Vec<u16> = levels.iter().map(|level| (*level).max(1)).collect();
        warp_level_sets(&self.levels, &levels, to_from, width, height)
    }
}

#[cfg(any(test, feature = "test-helpers"))]
mod testing {
    use super::{Affine2, DepthMap, DepthScale, Grid};

    impl DepthMap {
        /// Returns a map from -1 to 0.3 mesh units with ten pixels per unit.
        pub fn of_levels(levels: Grid<u16>) -> Self {
            Self {
                levels,
                scale: DepthScale {
                    height_min: -1.0,
                    height_per_level: 2e-5,
                    mesh_unit_per_px: 0.1,
                    depth_from_plane: Affine2::IDENTITY,
                    curvature: None,
                    unit: None,
                },
            }
        }
    }
}
