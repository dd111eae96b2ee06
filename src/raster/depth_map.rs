//! The depth map: heights over the fitted surface, seen as the print is read.

use super::warp::warp_strokes;
use super::{Grid, Mask};
use crate::domain::{Affine2, DepthScale};

/// A 16-bit depth map. Level 0 holds no data; 1..=65535 are linear in height.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    /// Levels by pixel.
    pub levels: Grid<u16>,
    /// How levels and pixels are to be read.
    pub scale: DepthScale,
}

impl DepthMap {
    /// Height over the fitted surface at a pixel, mesh units; `None` where there is no data.
    pub fn height(&self, x: usize, y: usize) -> Option<f64> {
        match self.levels.at(x, y) {
            0 => None,
            level => Some(self.scale.height(level)),
        }
    }

    /// The levels of all pixels that hold data, row by row.
    pub fn valid_levels(&self) -> Vec<u16> {
        let levels = self.levels.data().iter().copied();
        levels.filter(|level| *level > 0).collect()
    }

    /// The strokes at a threshold: levels from `level` up. No data is no stroke.
    pub fn stroke_mask(&self, level: u16) -> Mask {
        self.levels.map(|found| *found >= level.max(1))
    }

    /// The strokes at some thresholds in another frame; `to_from` maps depth-map pixels to its pixels.
    pub fn warped_stroke_masks(
        &self,
        to_from: &Affine2,
        [width, height]: [usize; 2],
        levels: &[u16],
    ) -> Vec<Mask> {
        let levels: Vec<u16> = levels.iter().map(|level| (*level).max(1)).collect();
        warp_strokes(&self.levels, &levels, to_from, width, height)
    }

    /// A map from -1 to 0.3 mesh units of ten pixels each, for tests.
    #[cfg(test)]
    pub(crate) fn of_levels(levels: Grid<u16>) -> Self {
        Self {
            levels,
            scale: DepthScale {
                height_min: -1.0,
                height_per_level: 2e-5,
                mesh_unit_per_px: 0.1,
                depth_from_plane: crate::domain::Affine2::IDENTITY,
                bow: None,
                unit: None,
            },
        }
    }
}
