//! Every angle and scale of a band, the best shift of each by FFT: which few poses deserve a closer look.

use std::f64::consts::TAU;

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftDirection};

use super::Layer;
use super::layer::sample;
use crate::domain::Affine2;
use crate::raster::Grid;

/// Side of the square on which layers are correlated.
const SQUARE: usize = 64;
/// Working size for layers that go into the search; at the widest scales only their corners leave the square.
pub(in crate::stages) const SEARCH_PX: usize = 40;
/// Angles in a turn; two are looked at with one transform.
const ANGLES: usize = 72;
/// Ratio between neighbouring scales: the rim of a character moves by about one pixel.
const SCALE_STEP: f64 = 1.075;
/// Poses closer than this in angle (degrees) and scale (ratio) are one.
const SAME_ANGLE_DEG: f64 = 12.0;
const SAME_SCALE: f64 = 1.12;

/// What the search may try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::stages) struct Limits {
    /// Largest ratio, up or down, between the pictures' sizes.
    pub(in crate::stages) scale: f64,
    /// Largest shift between the pictures' middles, as a share of the size.
    pub(in crate::stages) shift: f64,
    /// How many poses to keep.
    pub(in crate::stages) keep: usize,
}

/// A pose that the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::stages) struct Found {
    /// Moving image pixels to fixed image pixels; mirrors when `mirrored`.
    pub(in crate::stages) fixed_from_moving: Affine2,
    /// Correlation of what both know, over what each holds: at most 1.
    pub(in crate::stages) score: f64,
    /// Whether the moving picture had to be mirrored.
    pub(in crate::stages) mirrored: bool,
}

/// One peak of the correlation.
#[derive(Debug, Clone, Copy)]
struct Peak {
    angle: f64,
    scale: f64,
    shift: [f64; 2],
    score: f64,
    mirrored: bool,
}

/// The best distinct poses, as read and mirrored, best first.
pub(in crate::stages) fn search(fixed: &Layer, moving: &Layer, limits: Limits) -> Vec<Found> {
    let transform = Transform::new();
    let mut target = transform.forward(&centred(fixed, None));
    for value in &mut target {
        *value = value.conj();
    }
    let fixed_norm = fixed.energy().sqrt();
    let steps = (limits.scale.ln() / SCALE_STEP.ln()).round() as i32;
    let mut peaks = Vec::new();
    for step in -steps..=steps {
        let scale = SCALE_STEP.powi(step);
        for half in 0..ANGLES / 2 {
            let angles = [half, half + ANGLES / 2].map(|k| k as f64 * TAU / ANGLES as f64);
            let turned = angles.map(|angle| centred(moving, Some((angle, scale))));
            let norms = [norm(&turned[0]), norm(&turned[1])];
            let spectrum = transform.forward_both(&turned);
            for mirrored in [false, true] {
                let surface = transform.correlate(&spectrum, &target, mirrored);
                for (k, angle) in angles.into_iter().enumerate() {
                    let (shift, height) = highest(&surface, k, limits.shift);
                    let score = f64::from(height) / (norms[k] * fixed_norm).max(1e-12);
                    peaks.push(Peak {
                        angle,
                        scale,
                        shift,
                        score,
                        mirrored,
                    });
                }
            }
        }
    }
    distinct(peaks, limits.keep)
        .into_iter()
        .map(|peak| peak.found(fixed, moving))
        .collect()
}

impl Peak {
    /// In image pixels: image to its layer, about the middle, then to the fixed layer and back to its image.
    fn found(&self, fixed: &Layer, moving: &Layer) -> Found {
        let [cx, cy] = moving.centre();
        let [fx, fy] = fixed.centre();
        let to_middle = Affine2::scale_shift(1.0, [-cx, -cy]);
        let turn = Affine2::similarity(self.scale, self.angle, [0.0, 0.0]);
        let mirror = Affine2([
            [if self.mirrored { -1.0 } else { 1.0 }, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        let shift = Affine2::scale_shift(1.0, [fx + self.shift[0], fy + self.shift[1]]);
        let layer_from_layer = shift.after(&mirror).after(&turn).after(&to_middle);
        let fixed_image = fixed.work_from_image.inverse().unwrap_or(Affine2::IDENTITY);
        Found {
            fixed_from_moving: fixed_image
                .after(&layer_from_layer)
                .after(&moving.work_from_image),
            score: self.score,
            mirrored: self.mirrored,
        }
    }
}

/// The best peaks of which no two are the same pose; mirrored ones compete among themselves.
fn distinct(mut peaks: Vec<Peak>, keep: usize) -> Vec<Peak> {
    peaks.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Peak> = Vec::new();
    for peak in peaks {
        let same = |other: &Peak| {
            let turn = (peak.angle - other.angle).to_degrees().rem_euclid(360.0);
            let apart = turn.min(360.0 - turn);
            let ratio = (peak.scale / other.scale).max(other.scale / peak.scale);
            peak.mirrored == other.mirrored && apart < SAME_ANGLE_DEG && ratio < SAME_SCALE
        };
        let of_kind = kept
            .iter()
            .filter(|other| other.mirrored == peak.mirrored)
            .count();
        let room = if peak.mirrored {
            keep.div_ceil(3)
        } else {
            keep
        };
        if of_kind < room && !kept.iter().any(same) {
            kept.push(peak);
        }
    }
    kept
}

/// The layer's values in the middle of the square, turned and scaled about its own middle.
fn centred(layer: &Layer, turn: Option<(f64, f64)>) -> Grid<f32> {
    let middle = (SQUARE / 2) as f64;
    let [cx, cy] = layer.centre();
    let (angle, scale) = turn.unwrap_or((0.0, 1.0));
    let place =
        Affine2::similarity(scale, angle, [0.0, 0.0]).after(&Affine2::scale_shift(1.0, [-cx, -cy]));
    let place = Affine2::scale_shift(1.0, [middle, middle]).after(&place);
    let Some(back) = place.inverse() else {
        return Grid::new(SQUARE, SQUARE, 0.0);
    };
    // Layers are smooth at this size, so one look a pixel does even where the scale shrinks them.
    let (dx, dy) = (back.0[0][0], back.0[1][0]);
    let mut values = Grid::new(SQUARE, SQUARE, 0.0);
    for row in 0..SQUARE {
        let [mut x, mut y] = back.apply([0.0, row as f64]);
        for column in 0..SQUARE {
            values.set(column, row, sample(&layer.value, [x, y]) as f32);
            x += dx;
            y += dy;
        }
    }
    values
}

fn norm(values: &Grid<f32>) -> f64 {
    values
        .data()
        .iter()
        .map(|v| f64::from(*v).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// Highest correlation within the shift limit, of the real (0) or imaginary (1) part: shift in pixels and value.
fn highest(surface: &[Complex32], part: usize, limit: f64) -> ([f64; 2], f32) {
    let reach = (limit * SEARCH_PX as f64).round() as i64;
    let mut best = ([0.0; 2], f32::NEG_INFINITY);
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let row = dy.rem_euclid(SQUARE as i64) as usize;
            let column = dx.rem_euclid(SQUARE as i64) as usize;
            let value = surface[row * SQUARE + column];
            let value = if part == 0 { value.re } else { value.im };
            if value > best.1 {
                best = ([dx as f64, dy as f64], value);
            }
        }
    }
    best
}

/// Two-dimensional transforms of the square.
struct Transform {
    forward: Radix4<f32>,
    inverse: Radix4<f32>,
}

impl Transform {
    fn new() -> Self {
        // The square's side is a power of four. A planner would compile every algorithm it could choose from.
        Self {
            forward: Radix4::new(SQUARE, FftDirection::Forward),
            inverse: Radix4::new(SQUARE, FftDirection::Inverse),
        }
    }

    fn forward(&self, values: &Grid<f32>) -> Vec<Complex32> {
        let mut data: Vec<_> = values
            .data()
            .iter()
            .map(|v| Complex32::new(*v, 0.0))
            .collect();
        both_ways(&self.forward, &mut data);
        data
    }

    /// Two real squares in one transform: the second rides along as the imaginary part.
    fn forward_both(&self, [a, b]: &[Grid<f32>; 2]) -> Vec<Complex32> {
        let pairs = a.data().iter().zip(b.data());
        let mut data: Vec<_> = pairs.map(|(re, im)| Complex32::new(*re, *im)).collect();
        both_ways(&self.forward, &mut data);
        data
    }

    /// Correlation with the (conjugated) target; mirrored in x by reading the spectrum backwards along x.
    ///
    /// A shift by s shows up at s. The square is `SQUARE` wide and its middle at `SQUARE / 2`, so mirroring about
    /// column 0 of the transform keeps the middle.
    fn correlate(
        &self,
        spectrum: &[Complex32],
        conjugated: &[Complex32],
        mirrored: bool,
    ) -> Vec<Complex32> {
        let scale = 1.0 / (SQUARE * SQUARE) as f32;
        let mut product = Vec::with_capacity(SQUARE * SQUARE);
        for y in 0..SQUARE {
            for x in 0..SQUARE {
                let from = if mirrored { (SQUARE - x) % SQUARE } else { x };
                product.push(spectrum[y * SQUARE + from] * conjugated[y * SQUARE + x] * scale);
            }
        }
        both_ways(&self.inverse, &mut product);
        // The product above is the correlation read backwards: its value at -s belongs to shift s.
        reversed(&product)
    }
}

fn reversed(values: &[Complex32]) -> Vec<Complex32> {
    let back = |i: usize| (SQUARE - i) % SQUARE;
    (0..SQUARE * SQUARE)
        .map(|i| values[back(i / SQUARE) * SQUARE + back(i % SQUARE)])
        .collect()
}

/// Rows, then columns.
fn both_ways(fft: &Radix4<f32>, data: &mut [Complex32]) {
    fft.process(data);
    transpose(data);
    fft.process(data);
    transpose(data);
}

fn transpose(data: &mut [Complex32]) {
    for y in 0..SQUARE {
        for x in 0..y {
            data.swap(y * SQUARE + x, x * SQUARE + y);
        }
    }
}
