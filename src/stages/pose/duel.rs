//! Two poses judged on the same ground.
//!
//! Walls, frame lines and neighbours run into the border of a scan or a print. Where a symmetric character reads as well
//! turned or in the mirror, which of them happens to lie on which would decide; so they are left out, and only what both
//! poses lay on known paper counts.

use super::Layer;
use super::layer::sample;
use crate::domain::Affine2;
use crate::raster::Grid;
use crate::stages::components::Components;

/// Amounts above this are strokes.
const STROKE: f32 = 0.3;
/// Strokes that come so near to what is unknown may go on beyond it, pixels.
const BORDER_PX: i64 = 2;
/// Their soft rim goes with them, pixels.
const RIM_PX: i64 = 3;
/// Where more than this share of the strokes runs into the border, it is the character itself that is cut.
const MOST_STRAYS: f64 = 0.45;

/// A moving picture with where the fixed one's pixels lie in it.
pub(super) struct Side<'a> {
    pub(super) moving: &'a Layer,
    pub(super) moving_from_fixed: Affine2,
}

/// The scores of two poses over what is known at both: correlation times the share of the moving picture's amount that
/// meets the fixed one's, 0..=1.
pub(super) fn duel(fixed: &Layer, sides: [Side<'_>; 2]) -> [f64; 2] {
    let paper = own_ground(fixed);
    let grounds = [0, 1].map(|k: usize| own_ground(sides[k].moving));
    let mut sums = [Sums::default(); 2];
    for y in 0..paper.height() {
        for x in 0..paper.width() {
            if paper.at(x, y) == 0.0 {
                continue;
            }
            let place = [x as f64, y as f64];
            let there = [0, 1].map(|k: usize| sides[k].moving_from_fixed.apply(place));
            if (0..2).any(|k| sample(&grounds[k], there[k]) < 0.5) {
                continue;
            }
            let ink = [fixed.value.at(x, y), fixed.amount.at(x, y)];
            for (k, sums) in sums.iter_mut().enumerate() {
                let Layer { value, amount, .. } = sides[k].moving;
                sums.add(ink, [value, amount].map(|of| sample(of, there[k])));
            }
        }
    }
    sums.map(|sums| sums.score())
}

/// 1 where a picture is known and free of strokes that run into its border.
fn own_ground(layer: &Layer) -> Grid<f32> {
    let strokes = layer.amount.map(|amount| *amount > STROKE);
    let unknown = layer.weight.map(|weight| *weight == 0.0);
    let strays = Components::of(&strokes).near(&unknown, BORDER_PX);
    if strays.count() as f64 > MOST_STRAYS * strokes.count() as f64 {
        return layer.weight.clone();
    }
    let is_near_stray = |x: usize, y: usize| {
        let reach = -RIM_PX..=RIM_PX;
        let at = |dx, dy| strays.get(x as i64 + dx, y as i64 + dy).unwrap_or(false);
        reach.clone().any(|dy| reach.clone().any(|dx| at(dx, dy)))
    };
    Grid::from_fn(strokes.width(), strokes.height(), |x, y| {
        if is_near_stray(x, y) {
            0.0
        } else {
            layer.weight.at(x, y)
        }
    })
}

/// Sums over the pixels of two pictures.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    /// Of the values, their squares and their products.
    values: [f64; 2],
    squares: [f64; 2],
    products: f64,
    /// Of the moving amount, and of what of it meets the fixed one's.
    amount: f64,
    met: f64,
}

impl Sums {
    /// Takes in value and amount of the fixed and the moving picture.
    fn add(&mut self, fixed: [f32; 2], moving: [f32; 2]) {
        let values = [fixed[0], moving[0]].map(f64::from);
        self.n += 1.0;
        for (k, value) in values.into_iter().enumerate() {
            self.values[k] += value;
            self.squares[k] += value * value;
        }
        self.products += values[0] * values[1];
        self.amount += f64::from(moving[1]);
        self.met += f64::from(moving[1].min(fixed[1]));
    }

    fn score(&self) -> f64 {
        let [a, b] = self.values;
        let n = self.n.max(1.0);
        let spread = |k: usize| (self.squares[k] - self.values[k].powi(2) / n).max(1e-9);
        let correlation = (self.products - a * b / n) / (spread(0) * spread(1)).sqrt();
        correlation.max(0.0) * self.met / self.amount.max(1e-9)
    }
}
