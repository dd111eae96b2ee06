//! Every angle and scale of a band, the best shift of each by FFT: which few poses deserve a closer look.

use std::f64::consts::TAU;
use std::sync::Arc;

use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

use super::PyramidLevel;
use crate::domain::Affine2;
use crate::simd::{dispatch, index, whole_below};

/// Pixels that are looked at side by side.
const LANES: usize = 8;
/// Side of the square on which layers are correlated.
const SQUARE: usize = 32;
/// Working size for layers that go into the search; at the widest scales only their corners leave the square.
pub(super) const SEARCH_PX: usize = 20;
/// Largest shift between the pictures' middles, as a share of the size.
const SHIFT: f64 = 0.35;
/// Angles in a quarter turn. The four that quarter turns make of one are looked at together.
const ANGLES: usize = 9;
/// Ratio between neighbouring scales: the rim of a character moves by about one pixel.
const SCALE_STEP: f64 = 1.15;
/// Poses closer than this in angle (degrees) and scale (ratio) are one.
const SAME_ANGLE_DEG: f64 = 12.0;
const SAME_SCALE: f64 = 1.12;

/// Refined poses closer than this in angle (degrees) and scale (logarithm) have met.
const NEAR_DEG: f64 = 3.0;
const NEAR_RATIO: f64 = 0.04;

/// How many poses of each reading to keep; a reading of which none is kept is not looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::stages) struct BeamWidth {
    /// As the pictures are.
    pub(in crate::stages) upright: usize,
    /// With the moving picture mirrored.
    pub(in crate::stages) mirrored: usize,
}

impl BeamWidth {
    /// How many of one reading.
    pub(super) const fn of(self, mirrored: bool) -> usize {
        if mirrored {
            self.mirrored
        } else {
            self.upright
        }
    }
}

/// What the search may try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::stages) struct SearchRange {
    /// Largest ratio, up or down, between the pictures' sizes.
    pub(in crate::stages) max_scale: f64,
    /// How many poses to keep.
    pub(in crate::stages) beam_width: BeamWidth,
}

/// A pose that the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::stages) struct PoseCandidate {
    /// Moving image pixels to fixed image pixels; mirrors when `mirrored`.
    pub(in crate::stages) fixed_from_moving: Affine2,
    /// Correlation of what both know, over what each holds: at most 1.
    pub(in crate::stages) score: f64,
    /// Whether the moving picture had to be mirrored.
    pub(in crate::stages) mirrored: bool,
}

impl PoseCandidate {
    /// By how much two poses are turned from each other, degrees, 0..=180.
    pub(in crate::stages) fn rotation_to(&self, other: &Self) -> f64 {
        let angle = |pose: &Self| pose.fixed_from_moving.angle_deg();
        let turn = (angle(self) - angle(other)).rem_euclid(360.0);
        turn.min(360.0 - turn)
    }

    /// Whether two poses turn and scale alike.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        let scale = |pose: &Self| pose.fixed_from_moving.scale();
        let ratio = (scale(self) / scale(other)).ln().abs();
        self.mirrored == other.mirrored && self.rotation_to(other) < NEAR_DEG && ratio < NEAR_RATIO
    }
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
pub(super) fn search(
    fixed: &PyramidLevel,
    moving: &PyramidLevel,
    limits: SearchRange,
) -> Vec<PoseCandidate> {
    let mut transform = Transform::new();
    let target = transform.target(&centred(fixed, None));
    let fixed_norm = fixed.energy().sqrt();
    let steps = (limits.max_scale.ln() / SCALE_STEP.ln()).round() as i32;
    let readings: Vec<bool> = [false, true]
        .into_iter()
        .filter(|mirrored| limits.beam_width.of(*mirrored) > 0)
        .collect();
    let mut peaks = Vec::new();
    for step in -steps..=steps {
        let scale = SCALE_STEP.powi(step);
        for k in 0..ANGLES {
            let angle = k as f64 * TAU / (4 * ANGLES) as f64;
            let turned = centred(moving, Some((angle, scale)));
            let norm = norm(&turned);
            transform.take(&turned);
            for quarter in [false, true] {
                if quarter {
                    transform.turn();
                }
                for mirrored in readings.iter().copied() {
                    let surface = transform.correlate(&target, mirrored);
                    for part in 0..2 {
                        let (shift, height) = highest(surface, part);
                        let turns = usize::from(quarter) + 2 * part;
                        peaks.push(Peak {
                            angle: angle + turns as f64 * TAU / 4.0,
                            scale,
                            shift,
                            score: f64::from(height) / (norm * fixed_norm).max(1e-12),
                            mirrored,
                        });
                    }
                }
            }
        }
    }
    distinct(peaks, limits.beam_width)
        .into_iter()
        .map(|peak| peak.found(fixed, moving))
        .collect()
}

impl Peak {
    /// In image pixels: image to its layer, about the middle, then to the fixed layer and back to its image.
    fn found(&self, fixed: &PyramidLevel, moving: &PyramidLevel) -> PoseCandidate {
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
        PoseCandidate {
            fixed_from_moving: fixed_image
                .after(&layer_from_layer)
                .after(&moving.work_from_image),
            score: self.score,
            mirrored: self.mirrored,
        }
    }
}

/// The best peaks of which no two are the same pose; mirrored ones compete among themselves.
fn distinct(mut peaks: Vec<Peak>, keep: BeamWidth) -> Vec<Peak> {
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
        if of_kind < keep.of(peak.mirrored) && !kept.iter().any(same) {
            kept.push(peak);
        }
    }
    kept
}

/// The layer's values in the middle of the square, turned and scaled about its own middle.
fn centred(layer: &PyramidLevel, turn: Option<(f64, f64)>) -> Vec<f32> {
    let middle = (SQUARE / 2) as f64;
    let [cx, cy] = layer.centre();
    let (angle, scale) = turn.unwrap_or((0.0, 1.0));
    let place =
        Affine2::similarity(scale, angle, [0.0, 0.0]).after(&Affine2::scale_shift(1.0, [-cx, -cy]));
    let place = Affine2::scale_shift(1.0, [middle, middle]).after(&place);
    let Some(back) = place.inverse() else {
        return vec![0.0; SQUARE * SQUARE];
    };
    let (width, height) = (layer.value.width(), layer.value.height());
    let data = layer.value.data();
    let [to_right, to_end] = [width - 1, height - 1].map(|last| last as f32);
    let [x_of, y_of] = back.0.map(|row| row.map(|v| v as f32));
    let mut values = vec![0.0; SQUARE * SQUARE];
    let (runs, _) = values.as_chunks_mut::<LANES>();
    // Layers are smooth at this size, so one look a pixel does even where the scale shrinks them.
    dispatch(
        #[inline(always)]
        || {
            for (run, values) in runs.iter_mut().enumerate() {
                let (row, column) = (run * LANES / SQUARE, run * LANES % SQUARE);
                let (mut from, mut beyond) = ([0; LANES], [[0.0; LANES]; 2]);
                let mut inside = [0.0; LANES];
                for k in 0..LANES {
                    let (column, row) = ((column + k) as f32, row as f32);
                    let x = x_of[0] * column + x_of[1] * row + x_of[2];
                    let y = y_of[0] * column + y_of[1] * row + y_of[2];
                    let is_inside = (x >= 0.0) & (y >= 0.0) & (x < to_right) & (y < to_end);
                    inside[k] = if is_inside { 1.0 } else { 0.0 };
                    let (x, y) = if is_inside { (x, y) } else { (0.0, 0.0) };
                    let (left, top) = (whole_below(x), whole_below(y));
                    beyond[0][k] = x - left;
                    beyond[1][k] = y - top;
                    from[k] = index(top) * width as u32 + index(left);
                }
                let mut near = [[0.0; LANES]; 4];
                for k in 0..LANES {
                    let from = from[k] as usize;
                    let above = &data[from..from + width + 2];
                    near[0][k] = above[0];
                    near[1][k] = above[1];
                    near[2][k] = above[width];
                    near[3][k] = above[width + 1];
                }
                for k in 0..LANES {
                    let a = near[0][k] + (near[1][k] - near[0][k]) * beyond[0][k];
                    let b = near[2][k] + (near[3][k] - near[2][k]) * beyond[0][k];
                    values[k] = inside[k] * (a + (b - a) * beyond[1][k]);
                }
            }
        },
    );
    values
}

fn norm(values: &[f32]) -> f64 {
    f64::from(values.iter().map(|v| v * v).sum::<f32>()).sqrt()
}

/// Highest correlation within the shift limit, of the real (0) or imaginary (1) part: shift in pixels and value.
///
/// The surface is read backwards: its value at -s belongs to shift s.
fn highest(surface: &[Complex32], part: usize) -> ([f64; 2], f32) {
    let reach = (SHIFT * SEARCH_PX as f64).round() as i64;
    let mut best = ([0.0; 2], f32::NEG_INFINITY);
    for dy in -reach..=reach {
        let from = (-dy).rem_euclid(SQUARE as i64) as usize * SQUARE;
        let row = &surface[from..from + SQUARE];
        for dx in -reach..=reach {
            let value = row[(-dx).rem_euclid(SQUARE as i64) as usize];
            let value = if part == 0 { value.re } else { value.im };
            if value > best.1 {
                best = ([dx as f64, dy as f64], value);
            }
        }
    }
    best
}

/// Two-dimensional transforms of the square, with the room they work in.
///
/// Spectra are kept column by column, which saves a transposition each way.
struct Transform {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    scratch: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    product: Vec<Complex32>,
}

impl Transform {
    fn new() -> Self {
        // Its last digits differ between processors, which only the order of equal peaks could tell.
        let mut planner = FftPlanner::new();
        let forward = planner.plan_fft_forward(SQUARE);
        let inverse = planner.plan_fft_inverse(SQUARE);
        let room = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        let empty = Complex32::new(0.0, 0.0);
        Self {
            forward,
            inverse,
            scratch: vec![empty; room],
            spectrum: vec![empty; SQUARE * SQUARE],
            product: vec![empty; SQUARE * SQUARE],
        }
    }

    /// The conjugated spectrum of a real square, scaled so that a product transformed back is the correlation.
    fn target(&mut self, values: &[f32]) -> Vec<Complex32> {
        for (out, value) in self.spectrum.iter_mut().zip(values) {
            *out = Complex32::new(*value, 0.0);
        }
        both_ways(&*self.forward, &mut self.spectrum, &mut self.scratch);
        let scale = 1.0 / (SQUARE * SQUARE) as f32;
        self.spectrum.iter().map(|v| v.conj() * scale).collect()
    }

    /// Takes in the spectrum of a real square; the same turned by half a turn rides along as the imaginary part.
    fn take(&mut self, values: &[f32]) {
        for y in 0..SQUARE {
            let back = (SQUARE - y) % SQUARE * SQUARE;
            for x in 0..SQUARE {
                let opposite = values[back + (SQUARE - x) % SQUARE];
                self.spectrum[y * SQUARE + x] = Complex32::new(values[y * SQUARE + x], opposite);
            }
        }
        both_ways(&*self.forward, &mut self.spectrum, &mut self.scratch);
    }

    /// Turns what was taken in by a quarter turn, x to y: a turn of the square is the same turn of its spectrum.
    fn turn(&mut self) {
        // Kept column by column: the value of column u and row v lies at u * SQUARE + v.
        for u in 0..SQUARE {
            for v in 0..SQUARE {
                self.product[u * SQUARE + v] = self.spectrum[v * SQUARE + (SQUARE - u) % SQUARE];
            }
        }
        std::mem::swap(&mut self.spectrum, &mut self.product);
    }

    /// Correlation of what was taken in with the target; mirrored in x by reading the spectrum backwards along x.
    ///
    /// The square is `SQUARE` wide and its middle at `SQUARE / 2`, so mirroring about column 0 of the transform
    /// keeps the middle. The result is read backwards: its value at -s belongs to shift s.
    fn correlate(&mut self, target: &[Complex32], mirrored: bool) -> &[Complex32] {
        for x in 0..SQUARE {
            let from = if mirrored { (SQUARE - x) % SQUARE } else { x } * SQUARE;
            let column = &self.spectrum[from..from + SQUARE];
            let places = x * SQUARE..(x + 1) * SQUARE;
            let out = &mut self.product[places.clone()];
            for ((out, a), b) in out.iter_mut().zip(column).zip(&target[places]) {
                *out = a * b;
            }
        }
        both_ways(&*self.inverse, &mut self.product, &mut self.scratch);
        &self.product
    }
}

/// Along one axis, then along the other: rows become columns.
fn both_ways(fft: &dyn Fft<f32>, data: &mut [Complex32], scratch: &mut [Complex32]) {
    fft.process_with_scratch(data, scratch);
    transpose(data);
    fft.process_with_scratch(data, scratch);
}

fn transpose(data: &mut [Complex32]) {
    for y in 0..SQUARE {
        for x in 0..y {
            data.swap(y * SQUARE + x, x * SQUARE + y);
        }
    }
}
