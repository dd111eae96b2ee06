//! Exhaustive search over rotation and scale. FFT correlation finds the best shift for each rotation and scale.

use std::f64::consts::TAU;

use super::PyramidLevel;
use super::candidate::{PoseCandidate, SearchRange, prune};
use super::fft_correlation::{FFT_SIZE, FftCorrelator, best_shift};
use mocban_core::domain::Affine2;
use mocban_core::domain::cancel::poll;
use mocban_core::simd::{dispatch, floor_f32, index_from_f32};

/// Lanes of one SIMD vector.
const LANES: usize = 8;
/// Size of the searched levels in working pixels. At the largest scale of the default scale band, only the corners of a
/// rotated level lie outside the square of the FFT.
pub(super) const SEARCH_PX: usize = 20;
/// Largest shift between the centres, as a fraction of the level size.
const MAX_SHIFT: f64 = 0.35;
/// Number of rotations per 90 degrees. Rotations that differ by a multiple of 90 degrees share one warp.
const ANGLES_PER_QUARTER: usize = 9;
/// Ratio between neighbouring scales. One step moves the border of a character by about 1.5 working pixels.
const SCALE_STEP: f64 = 1.15;
/// Peaks are duplicates only if their rotations differ by less than this, in degrees.
const DUPLICATE_ANGLE_DEG: f64 = 12.0;
/// Peaks are duplicates only if the ratio of their scales is below this.
const DUPLICATE_SCALE: f64 = 1.12;

/// One peak of the correlation. The rotation is in radians, and the shift is in working pixels.
#[derive(Debug, Clone, Copy)]
struct Peak {
    angle: f64,
    scale: f64,
    shift: [f64; 2],
    score: f64,
    mirrored: bool,
}

/// Returns the best distinct poses, upright and mirrored, best first.
pub(super) fn search(
    fixed: &PyramidLevel,
    moving: &PyramidLevel,
    range: SearchRange,
) -> Vec<PoseCandidate> {
    let mut correlator = FftCorrelator::new();
    let target = correlator.target_spectrum(&warp_to_square(fixed, None));
    let fixed_norm = fixed.energy().sqrt();
    let steps = (range.max_scale.ln() / SCALE_STEP.ln()).round() as i32;
    let readings: Vec<bool> = [false, true]
        .into_iter()
        .filter(|mirrored| range.beam_width.of_reading(*mirrored) > 0)
        .collect();
    let max_shift_px = (MAX_SHIFT * SEARCH_PX as f64).round() as i64;
    let mut peaks = Vec::new();
    for step in -steps..=steps {
        let scale = SCALE_STEP.powi(step);
        for k in 0..ANGLES_PER_QUARTER {
            poll();
            let angle = k as f64 * TAU / (4 * ANGLES_PER_QUARTER) as f64;
            let warped = warp_to_square(moving, Some((angle, scale)));
            let norm = norm(&warped);
            correlator.load(&warped);
            for quarter in [false, true] {
                if quarter {
                    correlator.rotate_quarter();
                }
                for mirrored in readings.iter().copied() {
                    let surface = correlator.correlate(&target, mirrored);
                    for part in 0..2 {
                        let (shift, height) = best_shift(surface, part, max_shift_px);
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
    let rank = |peak: &Peak| (peak.score, peak.mirrored);
    let best = prune(peaks, range.beam_width, rank, Peak::is_duplicate_of);
    let candidate = |peak: Peak| peak.candidate(fixed, moving);
    best.into_iter().map(candidate).collect()
}

impl Peak {
    fn is_duplicate_of(&self, other: &Self) -> bool {
        let turn = (self.angle - other.angle).to_degrees().rem_euclid(360.0);
        let ratio = (self.scale / other.scale).max(other.scale / self.scale);
        self.mirrored == other.mirrored
            && turn.min(360.0 - turn) < DUPLICATE_ANGLE_DEG
            && ratio < DUPLICATE_SCALE
    }

    /// Converts the peak to a pose, which maps image pixels instead of working pixels.
    fn candidate(&self, fixed: &PyramidLevel, moving: &PyramidLevel) -> PoseCandidate {
        let [cx, cy] = moving.centre();
        let [fx, fy] = fixed.centre();
        let to_middle = Affine2::scale_shift(1.0, [-cx, -cy]);
        let turn = Affine2::similarity(self.scale, self.angle, [0.0, 0.0]);
        let mirror = Affine2([
            [if self.mirrored { -1.0 } else { 1.0 }, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        let shift = Affine2::scale_shift(1.0, [fx + self.shift[0], fy + self.shift[1]]);
        let level_from_level = shift.after(&mirror).after(&turn).after(&to_middle);
        let fixed_image = fixed.work_from_image.inverse().unwrap_or(Affine2::IDENTITY);
        PoseCandidate {
            fixed_from_moving: fixed_image
                .after(&level_from_level)
                .after(&moving.work_from_image),
            score: self.score,
            mirrored: self.mirrored,
        }
    }
}

/// Warps a level into the square of the FFT. `turn` is a rotation in radians and a scale, both about the centre.
fn warp_to_square(level: &PyramidLevel, turn: Option<(f64, f64)>) -> Vec<f32> {
    let middle = (FFT_SIZE / 2) as f64;
    let [cx, cy] = level.centre();
    let (angle, scale) = turn.unwrap_or((0.0, 1.0));
    let place =
        Affine2::similarity(scale, angle, [0.0, 0.0]).after(&Affine2::scale_shift(1.0, [-cx, -cy]));
    let place = Affine2::scale_shift(1.0, [middle, middle]).after(&place);
    let Some(back) = place.inverse() else {
        return vec![0.0; FFT_SIZE * FFT_SIZE];
    };
    let (width, data) = (level.value.width(), level.value.data());
    let [to_right, to_end] = [width - 1, level.value.height() - 1].map(|last| last as f32);
    let [x_of, y_of] = back.0.map(|row| row.map(|v| v as f32));
    let mut values = vec![0.0; FFT_SIZE * FFT_SIZE];
    let (runs, _) = values.as_chunks_mut::<LANES>();
    // Levels are smooth at this size, so one sample per pixel suffices even if the scale shrinks them.
    dispatch!({
        for (run, values) in runs.iter_mut().enumerate() {
            let (row, column) = (run * LANES / FFT_SIZE, run * LANES % FFT_SIZE);
            let (mut from, mut beyond) = ([0; LANES], [[0.0; LANES]; 2]);
            let mut inside = [0.0; LANES];
            for k in 0..LANES {
                let (column, row) = ((column + k) as f32, row as f32);
                let x = x_of[0] * column + x_of[1] * row + x_of[2];
                let y = y_of[0] * column + y_of[1] * row + y_of[2];
                let is_inside = (x >= 0.0) & (y >= 0.0) & (x < to_right) & (y < to_end);
                inside[k] = if is_inside { 1.0 } else { 0.0 };
                let (x, y) = if is_inside { (x, y) } else { (0.0, 0.0) };
                let (left, top) = (floor_f32(x), floor_f32(y));
                beyond[0][k] = x - left;
                beyond[1][k] = y - top;
                from[k] = index_from_f32(top) * width as u32 + index_from_f32(left);
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
    });
    values
}

fn norm(values: &[f32]) -> f64 {
    f64::from(values.iter().map(|v| v * v).sum::<f32>()).sqrt()
}
