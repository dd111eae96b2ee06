//! Masks strokes that are connected to the border of the area with data.
//!
//! Walls, frame lines and neighbouring characters run into the border and continue beyond it. Their overlap at a pose
//! is no evidence about the character, but could decide between two poses of a symmetric character.

use super::PyramidLevel;
use super::overlap::PlacedLevel;
use super::pyramid::BilinearCell;
use mocban_core::domain::Affine2;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Grid, Mask};

/// Amounts above this are strokes.
const MIN_STROKE: f32 = 0.3;
/// A stroke within this many working pixels of an unknown pixel counts as connected to the border.
const BORDER_PX: i64 = 2;
/// Border strokes are masked with a margin of this many working pixels, because the edges of strokes are soft.
const SOFT_EDGE_PX: usize = 3;
/// If more than this fraction of the stroke pixels is connected to the border, the character is assumed to be connected
/// too. Only a band along the border is masked then.
const MAX_BORDER_SHARE: f64 = 0.5;
/// Width of the band that is masked along the border, as a fraction of the level's longest side.
const BORDER_BAND: f64 = 0.1;
/// The border strokes of two levels agree if their overlap is at least this fraction of the overlap of all other
/// pixels. An overlap is the sum of each pixel's smaller amount, divided by the sum of each pixel's larger amount.
const MIN_RELATIVE_OVERLAP: f64 = 0.75;

/// Returns the valid mask of a level: 1 where it is known and not masked near the border, 0 elsewhere.
pub(super) fn valid_mask(level: &PyramidLevel) -> Grid<f32> {
    StrokeMasks::new(level).valid_mask(level)
}

/// Two levels at a pose, with the border strokes of each. If a stroke pixel lies on an inner stroke of the other level,
/// it belongs to the character and is not a border stroke.
pub(crate) struct BorderStrokes<'a> {
    levels: [&'a PyramidLevel; 2],
    strokes: [StrokeMasks; 2],
    moving_from_fixed: Affine2,
}

impl<'a> BorderStrokes<'a> {
    /// Finds the border strokes of a fixed and a moving level at the pose `fixed_from_moving`, which maps image pixels.
    /// Returns `None` if the pose has no inverse.
    pub(crate) fn find(levels: [&'a PyramidLevel; 2], fixed_from_moving: &Affine2) -> Option<Self> {
        let onto = |a: &PyramidLevel, b: &PyramidLevel, b_from_a: &Affine2| {
            let from_work = a.work_from_image.inverse()?;
            Some(b.work_from_image.after(b_from_a).after(&from_work))
        };
        let [fixed, moving] = levels;
        let moving_from_fixed = onto(fixed, moving, &fixed_from_moving.inverse()?)?;
        let [mut ink, mut relief] = levels.map(StrokeMasks::new);
        let [inner_ink, inner_relief] = [ink.interior(), relief.interior()];
        ink.unmark_matched(&inner_relief, &moving_from_fixed);
        relief.unmark_matched(&inner_ink, &onto(moving, fixed, fixed_from_moving)?);
        Some(Self {
            levels,
            strokes: [ink, relief],
            moving_from_fixed,
        })
    }

    /// Returns the fixed and the moving level with the border strokes masked.
    pub(crate) fn levels_without(&self) -> [PyramidLevel; 2] {
        [0, 1].map(|k: usize| {
            self.levels[k].restricted_to(self.strokes[k].valid_mask(self.levels[k]))
        })
    }

    /// Returns whether the border strokes overlap nearly as well as the character, see `MIN_RELATIVE_OVERLAP`. If so,
    /// both images show the same border strokes, which are then evidence for the pose too.
    pub(crate) fn agree(&self) -> bool {
        let [fixed, moving] = self.levels;
        let placed = PlacedLevel {
            moving,
            valid: &moving.weight,
            moving_from_fixed: self.moving_from_fixed,
        };
        let moving_border = self.strokes[1].border.to_weights();
        let mut sums = [[0.0_f64; 2]; 2];
        placed.each_common_pixel(&fixed.weight, |x, y, cell| {
            let is_border = self.strokes[0].border.at(x, y) || cell.value(&moving_border) > 0.5;
            let (ink, relief) = (fixed.amount.at(x, y), cell.value(&moving.amount));
            let [met, all] = &mut sums[usize::from(is_border)];
            *met += f64::from(ink.min(relief));
            *all += f64::from(ink.max(relief));
        });
        let [own, around] = sums.map(|[met, all]| met / all.max(1e-9));
        around >= MIN_RELATIVE_OVERLAP * own
    }
}

/// All strokes of a level, and the strokes that are connected to its border.
struct StrokeMasks {
    all: Mask,
    border: Mask,
}

impl StrokeMasks {
    fn new(level: &PyramidLevel) -> Self {
        let all = level.amount.map(|amount| *amount > MIN_STROKE);
        let unknown = level.weight.map(|weight| *weight == 0.0);
        let border = ConnectedComponents::label(&all).touching(&unknown, BORDER_PX);
        Self { all, border }
    }

    /// Returns 1 for strokes that are not connected to the border, 0 elsewhere.
    fn interior(&self) -> Grid<f32> {
        self.all
            .zip_map(&self.border, |stroke, border| stroke && !border)
            .to_weights()
    }

    /// Removes the border pixels that lie on `others`, the inner strokes of the other level.
    fn unmark_matched(&mut self, others: &Grid<f32>, other_from_this: &Affine2) {
        let size = [others.width(), others.height()];
        self.border = Mask::from_fn(self.border.width(), self.border.height(), |x, y| {
            let there = || BilinearCell::at(size, other_from_this.apply([x as f64, y as f64]));
            self.border.at(x, y) && there().is_none_or(|cell| cell.value(others) == 0.0)
        });
    }

    /// Returns 1 where the level is known and not masked near the border, 0 elsewhere.
    fn valid_mask(&self, level: &PyramidLevel) -> Grid<f32> {
        if self.border.count() as f64 > MAX_BORDER_SHARE * self.all.count() as f64 {
            without_border_band(&level.weight)
        } else {
            without_border_strokes(&level.weight, &self.border)
        }
    }
}

fn without_border_strokes(weight: &Grid<f32>, border: &Mask) -> Grid<f32> {
    let mut valid = weight.clone();
    let (width, height) = (weight.width(), weight.height());
    let around =
        |at: usize, size: usize| at.saturating_sub(SOFT_EDGE_PX)..(at + SOFT_EDGE_PX + 1).min(size);
    for y in 0..height {
        for x in (0..width).filter(|x| border.at(*x, y)) {
            for row in around(y, height) {
                let columns = around(x, width);
                valid.data_mut()[row * width..][columns].fill(0.0);
            }
        }
    }
    valid
}

fn without_border_band(weight: &Grid<f32>) -> Grid<f32> {
    let reach = (BORDER_BAND * weight.width().max(weight.height()) as f64).round() as usize;
    let (width, height) = (weight.width(), weight.height());
    let is_inner = |at: usize, side: usize| at >= reach && at + reach < side;
    Grid::from_fn(width, height, |x, y| {
        let is_known = |x, y| weight.at(x, y) > 0.0;
        let is_kept = is_inner(x, width)
            && is_inner(y, height)
            && is_known(x - reach, y)
            && is_known(x + reach, y)
            && is_known(x, y - reach)
            && is_known(x, y + reach);
        if is_kept { weight.at(x, y) } else { 0.0 }
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::BorderStrokes;
    use crate::stages::pose::{ImagePyramid, PyramidLevel, SoftMask};
    use mocban_core::domain::Affine2;
    use mocban_core::raster::{Grid, Mask};

    pub(crate) const SIDE: usize = 64;
    /// A cross in the middle, and bars at the left and the right border.
    const CROSS: [[usize; 4]; 2] = [[16, 30, 48, 35], [30, 16, 35, 48]];
    const LEFT: [usize; 4] = [0, 0, 6, SIDE];
    const RIGHT: [usize; 4] = [SIDE - 6, 0, SIDE, SIDE];
    /// Connects the cross to the left bar.
    const BRIDGE: [usize; 4] = [4, 30, 20, 35];

    /// Draws bars, each given as `[left, top, right, bottom]` in pixels. Right and bottom are exclusive.
    pub(crate) fn level(bars: &[[usize; 4]]) -> PyramidLevel {
        let on = |x, y| {
            let mut bars = bars.iter();
            bars.any(|[l, t, r, b]| (*l..*r).contains(&x) && (*t..*b).contains(&y))
        };
        let soft = SoftMask {
            amount: Grid::from_fn(SIDE, SIDE, |x, y| f32::from(u8::from(on(x, y)))),
            known: Mask::new(SIDE, SIDE, true),
        };
        let base = ImagePyramid::new(&soft, SIDE).expect("something is known");
        base.level(SIDE, 0.8)
    }

    fn at_identity<'a>(fixed: &'a PyramidLevel, moving: &'a PyramidLevel) -> BorderStrokes<'a> {
        let around = BorderStrokes::find([fixed, moving], &Affine2::IDENTITY);
        around.expect("the identity has an inverse")
    }

    fn amount(level: &PyramidLevel, x: usize, y: usize) -> f32 {
        let [x, y] = level.work_from_image.apply([x as f64, y as f64]);
        level.amount.at(x.round() as usize, y.round() as usize)
    }

    #[test]
    fn strokes_at_the_border_are_masked_in_both_levels() {
        let with = |bar| level(&[CROSS[0], CROSS[1], bar]);
        let [ink, relief] = at_identity(&with(LEFT), &with(RIGHT)).levels_without();
        for level in [&ink, &relief] {
            assert!(amount(level, 32, 32) > 0.9);
            assert_eq!(amount(level, 2, 10) + amount(level, SIDE - 3, 10), 0.0);
        }
    }

    #[test]
    fn border_strokes_agree_only_where_they_overlap() {
        let with = |bar| level(&[CROSS[0], CROSS[1], bar]);
        assert!(at_identity(&with(LEFT), &with(LEFT)).agree());
        assert!(!at_identity(&with(LEFT), &with(RIGHT)).agree());
    }

    #[test]
    fn a_character_connected_to_a_frame_line_in_one_level_is_kept() {
        let bridged = level(&[CROSS[0], CROSS[1], BRIDGE, LEFT]);
        let free = level(&[CROSS[0], CROSS[1]]);
        let [ink, relief] = at_identity(&bridged, &free).levels_without();
        assert!(amount(&ink, 32, 32) > 0.9 && amount(&ink, 32, 44) > 0.9);
        assert!(amount(&relief, 32, 32) > 0.9);
        assert_eq!(amount(&ink, 2, 10), 0.0);
    }
}
