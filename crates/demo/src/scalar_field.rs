//! Scalar fields sampled on a square around the character: signed distances and heights, in mm.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use mocban_core::raster::{Grid, Mask};

/// A square grid of samples centred on the character. Its coordinates in mm are u (right on the print) and v (down).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SampleFrame {
    /// Number of samples per side.
    pub side: usize,
    /// Sample spacing, mm.
    pub step_mm: f64,
}

impl SampleFrame {
    /// Creates a frame that extends at least `half_mm` from the centre in each direction.
    pub(super) fn covering(half_mm: f64, step_mm: f64) -> Self {
        Self {
            side: 2 * (half_mm / step_mm).ceil() as usize + 1,
            step_mm,
        }
    }

    /// Returns half the side length, mm.
    pub(super) fn half_mm(self) -> f64 {
        (self.side - 1) as f64 / 2.0 * self.step_mm
    }

    /// Returns the position of a sample, mm.
    pub(super) fn position(self, x: usize, y: usize) -> [f64; 2] {
        let half = self.half_mm();
        [
            x as f64 * self.step_mm - half,
            y as f64 * self.step_mm - half,
        ]
    }

    /// Returns the column and row of each sample, row by row.
    pub(super) fn samples(self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.side).flat_map(move |y| (0..self.side).map(move |x| (x, y)))
    }

    /// Returns the column and row of each sample in the square with the given centre and half side length.
    pub(super) fn box_around(
        self,
        centre: [f64; 2],
        half_size_mm: f64,
    ) -> impl Iterator<Item = (usize, usize)> {
        let last = (self.side - 1) as f64;
        let bound = |offset: f64| {
            let point = centre.map(|c| c + offset);
            self.sample(point).map(|c| c.clamp(0.0, last) as usize)
        };
        let ([x0, y0], [x1, y1]) = (bound(-half_size_mm), bound(half_size_mm));
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| (x, y)))
    }

    /// Draws a uniformly distributed position, mm.
    pub(super) fn random_position(self, rng: &mut ChaCha8Rng) -> [f64; 2] {
        let half = self.half_mm();
        [0; 2].map(|_: i32| rng.random_range(-half..half))
    }

    /// Converts a point in mm to fractional sample coordinates.
    pub(super) fn sample(self, [u, v]: [f64; 2]) -> [f64; 2] {
        let half = self.half_mm();
        [(u + half) / self.step_mm, (v + half) / self.step_mm]
    }
}

/// One value per sample of a frame, with bilinear interpolation.
#[derive(Debug, Clone)]
pub(super) struct ScalarField {
    /// Positions of the samples.
    pub frame: SampleFrame,
    /// The sample values.
    pub values: Grid<f32>,
}

impl ScalarField {
    /// Computes a field by calling `value` for each sample with its position in mm, its column and its row.
    pub(super) fn from_fn(
        frame: SampleFrame,
        mut value: impl FnMut([f64; 2], usize, usize) -> f64,
    ) -> Self {
        let values = Grid::from_fn(frame.side, frame.side, |x, y| {
            value(frame.position(x, y), x, y) as f32
        });
        Self { frame, values }
    }

    /// Computes the signed distance in mm to the outline of the inked area, positive inside. `coverage` is the ink
    /// coverage of each sample's cell, 0..=1. Next to the outline, the distance is computed from the coverage, which
    /// gives subpixel precision.
    pub(super) fn signed_distance(frame: SampleFrame, coverage: &Grid<f32>) -> Self {
        let inside = coverage.map(|share| *share > 0.5);
        let outside = inside.map(|set| !set);
        let (to_ink, to_background) = (distance_squared(&inside), distance_squared(&outside));
        let values = Grid::from_fn(frame.side, frame.side, |x, y| {
            let (ink, background) = (to_ink.at(x, y).sqrt(), to_background.at(x, y).sqrt());
            let pixels = if ink <= 1.0 && background <= 1.0 {
                coverage.at(x, y) - 0.5
            } else {
                background.max(0.5) - ink.max(0.5)
            };
            pixels * frame.step_mm as f32
        });
        Self { frame, values }
    }

    /// Returns the value at a sample.
    pub(super) fn at(&self, x: usize, y: usize) -> f64 {
        f64::from(self.values.at(x, y))
    }

    /// Returns the larger of the values of two fields, for signed distances that of their union.
    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            frame: self.frame,
            values: self.values.zip_map(&other.values, f32::max),
        }
    }

    /// Replaces the values of some samples. `value` receives the position of a sample, mm, and its value.
    pub(super) fn change(
        &mut self,
        samples: impl IntoIterator<Item = (usize, usize)>,
        value: impl Fn([f64; 2], f64) -> f64,
    ) {
        for (x, y) in samples {
            let changed = value(self.frame.position(x, y), self.at(x, y));
            self.values.set(x, y, changed as f32);
        }
    }

    /// Returns the interpolated value at a point in mm. Points outside the frame get the value at its border.
    pub(super) fn value(&self, point: [f64; 2]) -> f64 {
        let last = (self.frame.side - 1) as f64;
        let [x, y] = self.frame.sample(point).map(|c| c.clamp(0.0, last));
        let [x0, y0] = [x, y].map(|c| (c as usize).min(self.frame.side - 2));
        let corners = [y0, y0 + 1].map(|y| [x0, x0 + 1].map(|x| self.at(x, y)));
        bilinear(corners, x - x0 as f64, y - y0 as f64)
    }

    /// Returns the field smoothed by a Gaussian of `sigma_mm`.
    #[must_use]
    pub(super) fn blurred(&self, sigma_mm: f64) -> Self {
        let weights = gaussian(sigma_mm / self.frame.step_mm);
        let across = convolve_rows(&self.values, &weights);
        let values = transpose(&convolve_rows(&transpose(&across), &weights));
        Self {
            frame: self.frame,
            values,
        }
    }
}

/// Interpolates bilinearly at a point of the unit square. The values at the four corners are given row by row.
pub(super) fn bilinear([top, bottom]: [[f64; 2]; 2], x: f64, y: f64) -> f64 {
    let [top, bottom] = [top, bottom].map(|[left, right]| left * (1.0 - x) + right * x);
    top * (1.0 - y) + bottom * y
}

/// Returns the weights of a Gaussian with a standard deviation of `sigma` samples. The Gaussian is truncated at three
/// sigma, and the weights sum to one.
fn gaussian(sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil().max(1.0) as i32;
    let raw: Vec<f64> = (-reach..=reach)
        .map(|i| (-f64::from(i * i) / (2.0 * sigma * sigma).max(1e-9)).exp())
        .collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|w| (w / sum) as f32).collect()
}

fn convolve_rows(grid: &Grid<f32>, weights: &[f32]) -> Grid<f32> {
    let (width, reach) = (grid.width(), weights.len() / 2);
    let mut out = Grid::new(width, grid.height(), 0.0_f32);
    let mut padded = vec![0.0_f32; width + 2 * reach];
    for y in 0..grid.height() {
        let row = grid.row(y);
        padded[..reach].fill(row[0]);
        padded[reach..reach + width].copy_from_slice(row);
        padded[reach + width..].fill(row[width - 1]);
        let target = &mut out.data_mut()[y * width..(y + 1) * width];
        for (i, weight) in weights.iter().enumerate() {
            for (sum, value) in target.iter_mut().zip(&padded[i..]) {
                *sum += weight * value;
            }
        }
    }
    out
}

fn transpose(grid: &Grid<f32>) -> Grid<f32> {
    Grid::from_fn(grid.height(), grid.width(), |x, y| grid.at(y, x))
}

/// Computes the squared distance from each pixel to the nearest set pixel, in square pixels (Felzenszwalb and
/// Huttenlocher 2012, doi:10.4086/toc.2012.v008a019).
fn distance_squared(mask: &Mask) -> Grid<f32> {
    // Larger than any squared distance in the mask, but small enough for exact f32 arithmetic.
    let far = (mask.width() + mask.height()).pow(2) as f32;
    let start = mask.map(|set| if *set { 0.0 } else { far });
    let down = transpose(&lower_envelopes(&transpose(&start)));
    lower_envelopes(&down)
}

fn lower_envelopes(grid: &Grid<f32>) -> Grid<f32> {
    let width = grid.width();
    let mut out = grid.clone();
    let (mut centres, mut ends) = (vec![0_usize; width], vec![0.0_f32; width + 1]);
    for y in 0..grid.height() {
        let target = &mut out.data_mut()[y * width..(y + 1) * width];
        lower_envelope(grid.row(y), target, &mut centres, &mut ends);
    }
    out
}

/// Computes `min over q of (x - q)^2 + heights[q]` for each x.
fn lower_envelope(heights: &[f32], out: &mut [f32], centres: &mut [usize], ends: &mut [f32]) {
    let meet = |a: usize, b: usize| {
        let (p, q) = (a as f32, b as f32);
        ((heights[b] + q * q) - (heights[a] + p * p)) / (2.0 * (q - p))
    };
    let mut last = 0;
    (centres[0], ends[0], ends[1]) = (0, f32::NEG_INFINITY, f32::INFINITY);
    for q in 1..heights.len() {
        let mut cut = meet(centres[last], q);
        while cut <= ends[last] {
            last -= 1;
            cut = meet(centres[last], q);
        }
        last += 1;
        (centres[last], ends[last], ends[last + 1]) = (q, cut, f32::INFINITY);
    }
    let mut piece = 0;
    for (x, value) in out.iter_mut().enumerate() {
        while ends[piece + 1] < x as f32 {
            piece += 1;
        }
        let offset = x as f32 - centres[piece] as f32;
        *value = offset * offset + heights[centres[piece]];
    }
}

#[cfg(test)]
mod tests {
    use super::{SampleFrame, ScalarField, distance_squared};
    use mocban_core::raster::{Grid, Mask};

    #[test]
    fn distances_equal_a_brute_force_search() {
        let mask = Mask::from_fn(37, 37, |x, y| (x * 7 + y * 13) % 61 == 0);
        let found = distance_squared(&mask);
        for y in 0..37 {
            for x in 0..37 {
                let best = (0..37 * 37)
                    .filter(|i| mask.at(i % 37, i / 37))
                    .map(|i| (i % 37).abs_diff(x).pow(2) + (i / 37).abs_diff(y).pow(2))
                    .min()
                    .expect("the mask has set pixels");
                assert_eq!(found.at(x, y) as usize, best);
            }
        }
    }

    #[test]
    fn signed_distance_of_a_disc_is_its_radius_minus_the_distance_to_its_centre() {
        let frame = SampleFrame::covering(2.0, 0.05);
        let coverage = Grid::from_fn(frame.side, frame.side, |x, y| {
            let [u, v] = frame.position(x, y);
            ((1.0 - u.hypot(v)) / 0.05 + 0.5).clamp(0.0, 1.0) as f32
        });
        let field = ScalarField::signed_distance(frame, &coverage);
        for point in [[0.0, 0.0], [0.5, 0.3], [1.0, 0.0], [-1.3, 0.9]] {
            let truth = 1.0 - f64::hypot(point[0], point[1]);
            assert!((field.value(point) - truth).abs() < 0.03, "{point:?}");
        }
    }

    #[test]
    fn blur_keeps_a_constant_field() {
        let frame = SampleFrame::covering(1.0, 0.1);
        let level = ScalarField::from_fn(frame, |_, _, _| 2.5).blurred(0.2);
        assert!(level.values.data().iter().all(|v| (v - 2.5).abs() < 1e-5));
    }
}
