//! The ground on which a picture can be judged: what it knows, without what runs into its border.
//!
//! Walls, frame lines and neighbours do, and go on beyond it. Which of them happens to lie on which tells nothing of the
//! character, yet would decide where a symmetric one reads as well turned or in the mirror.

use super::PyramidLevel;
use super::pyramid::{Between, sample};
use crate::domain::Affine2;
use crate::raster::{Grid, Mask};
use crate::stages::components::ConnectedComponents;

/// Amounts above this are strokes.
const STROKE: f32 = 0.3;
/// Strokes that come so near to what is unknown may go on beyond it, pixels.
const BORDER_PX: i64 = 2;
/// Their soft rim goes with them, pixels.
const RIM_PX: usize = 3;
/// Where more than this share of the strokes runs into the border, the character does or hangs on what does; then
/// this share of the size along the border is left out instead.
const MOST_STRAYS: f64 = 0.5;
const BAND: f64 = 0.1;
/// The border strokes agree when they meet this many times as much of each other as the character does.
const AS_WELL: f64 = 0.75;

/// 1 where a layer is known and free of what runs into its border, 0 elsewhere.
pub(super) fn own_ground(layer: &PyramidLevel) -> Grid<f32> {
    Strokes::of(layer).ground(layer)
}

/// Two layers at a pose, and what of them runs into the border. What the other layer has strokes for that do not is no
/// stray: there it is the character that hangs on its surroundings.
pub(in crate::stages) struct BorderStrokes<'a> {
    layers: [&'a PyramidLevel; 2],
    strokes: [Strokes; 2],
    moving_from_fixed: Affine2,
}

impl<'a> BorderStrokes<'a> {
    /// Of a fixed and a moving layer; `None` for a map that cannot be turned round.
    pub(in crate::stages) fn of(
        layers: [&'a PyramidLevel; 2],
        fixed_from_moving: &Affine2,
    ) -> Option<Self> {
        let onto = |a: &PyramidLevel, b: &PyramidLevel, b_from_a: &Affine2| {
            let from_work = a.work_from_image.inverse()?;
            Some(b.work_from_image.after(b_from_a).after(&from_work))
        };
        let [fixed, moving] = layers;
        let moving_from_fixed = onto(fixed, moving, &fixed_from_moving.inverse()?)?;
        let [mut ink, mut wood] = layers.map(Strokes::of);
        let [own_ink, own_wood] = [ink.own(), wood.own()];
        ink.keep(&own_wood, &moving_from_fixed);
        wood.keep(&own_ink, &onto(moving, fixed, fixed_from_moving)?);
        Some(Self {
            layers,
            strokes: [ink, wood],
            moving_from_fixed,
        })
    }

    /// The layers without them.
    pub(in crate::stages) fn without(&self) -> [PyramidLevel; 2] {
        [0, 1].map(|k: usize| self.layers[k].known_on(self.strokes[k].ground(self.layers[k])))
    }

    /// Whether they lie on each other as well as the rest does. Then they are of one state of the block, and tell the pose
    /// as well as the character.
    pub(in crate::stages) fn agree(&self) -> bool {
        let [fixed, moving] = self.layers;
        let strays = self.strokes[1]
            .strays
            .map(|stray| f32::from(u8::from(*stray)));
        let mut sums = [[0.0_f64; 2]; 2];
        let size = [moving.weight.width(), moving.weight.height()];
        for y in 0..fixed.weight.height() {
            for x in (0..fixed.weight.width()).filter(|x| fixed.weight.at(*x, y) > 0.0) {
                let there = self.moving_from_fixed.apply([x as f64, y as f64]);
                let there = Between::of(size, there).filter(|at| at.value(&moving.weight) >= 0.5);
                let Some(there) = there else {
                    continue;
                };
                let stray = self.strokes[0].strays.at(x, y) || there.value(&strays) > 0.5;
                let (ink, wood) = (fixed.amount.at(x, y), there.value(&moving.amount));
                let [met, all] = &mut sums[usize::from(stray)];
                *met += f64::from(ink.min(wood));
                *all += f64::from(ink.max(wood));
            }
        }
        let [own, around] = sums.map(|[met, all]| met / all.max(1e-9));
        around >= AS_WELL * own
    }
}

/// What a layer shows, and what of it runs into the border.
struct Strokes {
    all: Mask,
    strays: Mask,
}

impl Strokes {
    fn of(layer: &PyramidLevel) -> Self {
        let all = layer.amount.map(|amount| *amount > STROKE);
        let unknown = layer.weight.map(|weight| *weight == 0.0);
        let strays = ConnectedComponents::label(&all).touching(&unknown, BORDER_PX);
        Self { all, strays }
    }

    /// 1 where strokes do not run into the border.
    fn own(&self) -> Grid<f32> {
        let own = |x, y| f32::from(u8::from(self.all.at(x, y) && !self.strays.at(x, y)));
        Grid::from_fn(self.all.width(), self.all.height(), own)
    }

    /// Takes for no strays what lies on strokes of another layer.
    fn keep(&mut self, others: &Grid<f32>, other_from_this: &Affine2) {
        for y in 0..self.strays.height() {
            for x in 0..self.strays.width() {
                if self.strays.at(x, y) {
                    let there = other_from_this.apply([x as f64, y as f64]);
                    self.strays.set(x, y, sample(others, there) == 0.0);
                }
            }
        }
    }

    /// 1 where the layer is known and free of strays, 0 elsewhere.
    fn ground(&self, layer: &PyramidLevel) -> Grid<f32> {
        if self.strays.count() as f64 > MOST_STRAYS * self.all.count() as f64 {
            without_band(&layer.weight)
        } else {
            without_strays(&layer.weight, &self.strays)
        }
    }
}

fn without_strays(weight: &Grid<f32>, strays: &Mask) -> Grid<f32> {
    let mut ground = weight.clone();
    let (width, height) = (weight.width(), weight.height());
    let around = |at: usize, size: usize| at.saturating_sub(RIM_PX)..(at + RIM_PX + 1).min(size);
    for y in 0..height {
        for x in (0..width).filter(|x| strays.at(*x, y)) {
            for row in around(y, height) {
                let columns = around(x, width);
                ground.data_mut()[row * width..][columns].fill(0.0);
            }
        }
    }
    ground
}

fn without_band(weight: &Grid<f32>) -> Grid<f32> {
    let reach = (BAND * weight.width().max(weight.height()) as f64).round() as i64;
    let around = [(reach, 0), (-reach, 0), (0, reach), (0, -reach)];
    Grid::from_fn(weight.width(), weight.height(), |x, y| {
        let (i, j) = (x as i64, y as i64);
        let is_known = |(dx, dy): &(i64, i64)| weight.get(i + dx, j + dy).is_some_and(|w| w > 0.0);
        if around.iter().all(is_known) {
            weight.at(x, y)
        } else {
            0.0
        }
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::BorderStrokes;
    use crate::domain::Affine2;
    use crate::raster::{Grid, Mask};
    use crate::stages::pose::{ImagePyramid, PyramidLevel, SoftMask};

    pub(in crate::stages::pose) const SIDE: usize = 64;
    /// A cross in the middle, and bars that run into the left and the right border.
    const CROSS: [[usize; 4]; 2] = [[16, 30, 48, 35], [30, 16, 35, 48]];
    const LEFT: [usize; 4] = [0, 0, 6, SIDE];
    const RIGHT: [usize; 4] = [SIDE - 6, 0, SIDE, SIDE];
    /// Joins the cross to the left bar.
    const BRIDGE: [usize; 4] = [4, 30, 20, 35];

    /// Bars as boxes of left, top, right and bottom, right and bottom not in them.
    pub(in crate::stages::pose) fn layer(bars: &[[usize; 4]]) -> PyramidLevel {
        let on = |x, y| {
            let mut bars = bars.iter();
            bars.any(|[l, t, r, b]| (*l..*r).contains(&x) && (*t..*b).contains(&y))
        };
        let soft = SoftMask {
            amount: Grid::from_fn(SIDE, SIDE, |x, y| f32::from(u8::from(on(x, y)))),
            known: Mask::new(SIDE, SIDE, true),
        };
        let base = ImagePyramid::new(&soft, SIDE).expect("something is known");
        base.layer(SIDE, 0.8)
    }

    fn as_they_lie<'a>(fixed: &'a PyramidLevel, moving: &'a PyramidLevel) -> BorderStrokes<'a> {
        let around = BorderStrokes::of([fixed, moving], &Affine2::IDENTITY);
        around.expect("the map can be turned round")
    }

    fn amount(layer: &PyramidLevel, x: usize, y: usize) -> f32 {
        let [x, y] = layer.work_from_image.apply([x as f64, y as f64]);
        layer.amount.at(x.round() as usize, y.round() as usize)
    }

    #[test]
    fn what_runs_into_the_border_is_left_out_of_both() {
        let with = |bar| layer(&[CROSS[0], CROSS[1], bar]);
        let [ink, wood] = as_they_lie(&with(LEFT), &with(RIGHT)).without();
        for layer in [&ink, &wood] {
            assert!(amount(layer, 32, 32) > 0.9);
            assert_eq!(amount(layer, 2, 10) + amount(layer, SIDE - 3, 10), 0.0);
        }
    }

    #[test]
    fn surroundings_agree_where_they_stand_alike_only() {
        let with = |bar| layer(&[CROSS[0], CROSS[1], bar]);
        assert!(as_they_lie(&with(LEFT), &with(LEFT)).agree());
        assert!(!as_they_lie(&with(LEFT), &with(RIGHT)).agree());
    }

    #[test]
    fn a_character_that_hangs_on_a_frame_line_in_one_picture_stays() {
        let bridged = layer(&[CROSS[0], CROSS[1], BRIDGE, LEFT]);
        let free = layer(&[CROSS[0], CROSS[1]]);
        let [ink, wood] = as_they_lie(&bridged, &free).without();
        assert!(amount(&ink, 32, 32) > 0.9 && amount(&ink, 32, 44) > 0.9);
        assert!(amount(&wood, 32, 32) > 0.9);
        assert_eq!(amount(&ink, 2, 10), 0.0);
    }
}
