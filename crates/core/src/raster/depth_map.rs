//! The depth map: heights over the fitted surface, mirrored so that it reads like the print.

use super::warp_mask::warp_level_sets;
use super::{Grid, Mask};
use crate::domain::cancel::poll;
use crate::domain::{Affine2, DepthScale, Levelling};

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

    /// Returns the map with heights over the surface of a levelling. The scale stays the same: heights beyond its range
    /// get its first or last level.
    #[must_use]
    pub fn levelled(&self, levelling: &Levelling) -> Self {
        let [width, height] = [self.levels.width(), self.levels.height()];
        let cells = |side: usize| -> Vec<(usize, f64)> {
            let places =
                (0..side).map(|at| Levelling::cell::<{ Levelling::NODES }>(at as f64, side));
            places.collect()
        };
        let (columns, rows) = (cells(width), cells(height));
        let mut levels = self.levels.clone();
        for (levels, row) in levels.data_mut().chunks_exact_mut(width.max(1)).zip(rows) {
            poll();
            for (level, column) in levels.iter_mut().zip(&columns) {
                if *level > 0 {
                    let height = levelling.height_between([*column, row]);
                    let moved = f64::from(*level) - height / self.scale.height_per_level;
                    *level = nearest_level(moved);
                }
            }
        }
        Self {
            levels,
            scale: self.scale.clone(),
        }
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

/// Returns the nearest level with data, the higher one of two. A level is not negative, so a cast rounds down; `f64::round`
/// would be a function call.
#[inline(always)]
pub(super) fn nearest_level(level: f64) -> u16 {
    let level = level.clamp(1.0, 65_535.0);
    let below = level as u16;
    below + u16::from(level - f64::from(below) >= 0.5)
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

#[cfg(test)]
mod tests {
    use super::{DepthMap, Grid};
    use crate::domain::Levelling;

    #[test]
    fn a_levelled_map_has_the_height_over_the_levelling_at_each_pixel() {
        let levels = Grid::from_fn(
            7,
            7,
            |x, y| if x == y { 0 } else { 30_000 + 100 * x as u16 },
        );
        let map = DepthMap::of_levels(levels);
        let mut levelling = Levelling::default();
        for row in &mut levelling.heights {
            *row = std::array::from_fn(|x| 0.05 * x as f64);
        }
        let levelled = map.levelled(&levelling);
        for (x, y) in (0..49).map(|at| (at % 7, at / 7)) {
            let wanted = map.height(x, y).map(|height| height - 0.05 * x as f64);
            match (levelled.height(x, y), wanted) {
                (Some(found), Some(wanted)) => assert!((found - wanted).abs() < 2e-5),
                (found, wanted) => assert_eq!(found, wanted),
            }
        }
        levelling.heights[0] = [-9.0; Levelling::NODES];
        assert_eq!(map.levelled(&levelling).levels.at(1, 0), u16::MAX);
    }
}
