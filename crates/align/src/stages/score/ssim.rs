//! Structural similarity (SSIM) of masks: Wang, Bovik, Sheikh and Simoncelli 2004, doi:10.1109/TIP.2003.819861.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use mocban_core::raster::{Grid, Mask, PixelBox};
use mocban_core::simd::dispatch;

/// Stabilising constants for a data range of 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// `exp(-distance^2 / (2 * 1.5^2))` for distances from 0 to 5 px. Constants, because `exp` of some systems rounds
/// differently, and scores must not depend on the system.
const GAUSSIAN_WEIGHTS: [f64; 6] = [
    1.0,
    0.800_737_402_916_808_1,
    0.411_112_290_507_187_45,
    0.135_335_283_236_612_7,
    0.028_565_500_784_550_377,
    0.003_865_920_139_472_807_6,
];

/// The local window of SSIM.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SsimWindow {
    /// Gaussian with a sigma of 1.5 px, truncated at 3.5 sigma (11 weights), and population covariance. Used by Wang et
    /// al. 2004, and by scikit-image with `gaussian_weights=True, use_sample_covariance=False`.
    Gaussian,
    /// Uniform 7 x 7 px and sample covariance, the default of scikit-image.
    Uniform7,
}

impl SsimWindow {
    /// Returns the weights along one axis. They sum to 1, and their number is odd.
    fn weights(self) -> Vec<f64> {
        match self {
            Self::Gaussian => {
                let raw =
                    [5, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5].map(|distance| GAUSSIAN_WEIGHTS[distance]);
                let sum: f64 = raw.iter().sum();
                raw.iter().map(|w| w / sum).collect()
            }
            Self::Uniform7 => vec![1.0 / 7.0; 7],
        }
    }

    /// Returns the factor on variances and covariance.
    fn covariance_factor(self) -> f64 {
        match self {
            Self::Gaussian => 1.0,
            Self::Uniform7 => 49.0 / 48.0,
        }
    }
}

/// Means over all windows that lie within the masks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SsimScores {
    /// Mean structural similarity, -1..=1.
    pub ssim: f64,
    /// Mean of `(2 s_xy + C2) / (s_x^2 + s_y^2 + C2)`: SSIM without its luminance factor.
    pub nl_ssim: f64,
}

/// A mask with its windowed means, to compare many masks with it.
///
/// ```
/// use mocban_core::raster::Mask;
/// use mocban_align::stages::score::{SsimReference, SsimWindow};
///
/// let disc = Mask::from_fn(40, 40, |x, y| (x as i64 - 20).pow(2) + (y as i64 - 20).pow(2) < 150);
/// let reference = SsimReference::new(&disc, SsimWindow::Gaussian);
/// assert_eq!(reference.compare(&disc).ssim, 1.0);
/// let inverse = disc.map(|set| !set);
/// assert!(reference.nl_ssim(&inverse) < 0.5);
/// ```
#[derive(Debug, Clone)]
pub struct SsimReference {
    mask: Mask,
    /// Bounding box of the mask.
    pub(super) bounds: Option<PixelBox>,
    weights: WindowWeights,
    /// Means over the windows that lie within the mask.
    means: Grid<f64>,
    covariance_factor: f64,
}

impl SsimReference {
    /// Computes the windowed means of a mask.
    pub fn new(mask: &Mask, window: SsimWindow) -> Self {
        let weights = WindowWeights::new(window.weights());
        Self {
            means: weights.means(mask),
            weights,
            mask: mask.clone(),
            bounds: mask.bounding_box(),
            covariance_factor: window.covariance_factor(),
        }
    }

    /// Returns the mask.
    pub const fn mask(&self) -> &Mask {
        &self.mask
    }

    /// Computes the scores of another mask of the same size.
    pub fn compare(&self, other: &Mask) -> SsimScores {
        self.scores::<true>(other)
    }

    /// Computes the structure part alone, which is faster.
    pub fn nl_ssim(&self, other: &Mask) -> f64 {
        self.scores::<false>(other).nl_ssim
    }

    /// Skips `ssim` unless `LUMINANCE` is set.
    fn scores<const LUMINANCE: bool>(&self, other: &Mask) -> SsimScores {
        let count = self.means.data().len();
        let both = self.mask.zip_map(other, |a, b| a & b);
        let windows @ [columns, rows] = &self.windows_touching(other);
        let mut sums = SsimSums::default();
        let add_row = |y: usize, [other, both]: [&[f64]; 2]| {
            let own = &self.means.row(y)[columns.clone()];
            sums.add_row::<LUMINANCE>(own, other, both, self.covariance_factor);
        };
        dispatch!(self.weights.for_each_row([other, &both], windows, add_row));
        // Windows without a set pixel in either mask score 1.
        let equal = count - columns.len() * rows.len();
        sums.mean(equal, count)
    }

    /// Returns the windows that may contain a set pixel of either mask.
    fn windows_touching(&self, other: &Mask) -> Windows {
        let boxes = [self.bounds, other.bounding_box()];
        let Some(bounds) = boxes.into_iter().flatten().reduce(PixelBox::union) else {
            return [0..0, 0..0];
        };
        let rim = self.weights.rim();
        let seeing = |first: usize, last: usize, count: usize| {
            let end = (last + 1).min(count);
            first.saturating_sub(rim).min(end)..end
        };
        [
            seeing(bounds.x0, bounds.x1, self.means.width()),
            seeing(bounds.y0, bounds.y1, self.means.height()),
        ]
    }
}

/// Number of independent sums, which are computed in parallel.
const LANES: usize = 4;

/// Sums over windows. Windowed means of both masks and of their intersection suffice, because `x^2 = x` for 0 and 1.
#[derive(Default)]
struct SsimSums {
    ssim: [f64; LANES],
    nl_ssim: [f64; LANES],
}

impl SsimSums {
    /// Adds a row of windows, given the windowed means of both masks and of their intersection.
    #[inline(always)]
    fn add_row<const LUMINANCE: bool>(
        &mut self,
        own: &[f64],
        other: &[f64],
        both: &[f64],
        factor: f64,
    ) {
        let parts = [own, other, both].map(|means| means.as_chunks());
        let [(own, own_rest), (other, other_rest), (both, both_rest)] = parts;
        for ((u, v), both) in own.iter().zip(other).zip(both) {
            self.add::<LUMINANCE>([u, v, both], LANES, factor);
        }
        let padded = |rest: &[f64]| std::array::from_fn(|k| rest.get(k).copied().unwrap_or(0.0));
        let rest = [own_rest, other_rest, both_rest].map(padded);
        self.add::<LUMINANCE>(rest.each_ref(), own_rest.len(), factor);
    }

    #[inline(always)]
    fn add<const LUMINANCE: bool>(
        &mut self,
        [u, v, both]: [&[f64; LANES]; 3],
        count: usize,
        factor: f64,
    ) {
        for k in 0..count {
            let (u, v) = (u[k], v[k]);
            let variances = factor * (u - u * u + v - v * v);
            let covariance = factor * (both[k] - u * v);
            let structure = (2.0 * covariance + C2) / (variances + C2);
            self.nl_ssim[k] += structure;
            if LUMINANCE {
                let luminance = (2.0 * u * v + C1) / (u * u + v * v + C1);
                self.ssim[k] += luminance * structure;
            }
        }
    }

    /// Returns the mean scores of `count` windows. `equal` is the number of windows with score 1, which the sums omit.
    fn mean(&self, equal: usize, count: usize) -> SsimScores {
        let mean = |sums: &[f64]| (sums.iter().sum::<f64>() + equal as f64) / count.max(1) as f64;
        SsimScores {
            ssim: mean(&self.ssim),
            nl_ssim: mean(&self.nl_ssim),
        }
    }
}

/// First columns and first rows of windows.
type Windows = [Range<usize>; 2];

/// The weights of a window along one axis.
#[derive(Debug, Clone)]
struct WindowWeights {
    weights: Vec<f64>,
    /// Weighted mean of each possible row of pixels as wide as the window. The bits of the index are the pixels. The
    /// last pixel is the lowest bit.
    mean_of_bits: Vec<f64>,
}

impl WindowWeights {
    fn new(weights: Vec<f64>) -> Self {
        let mean = |bits: usize| {
            let weight = |k: usize| if bits >> k & 1 == 1 { weights[k] } else { 0.0 };
            (0..weights.len()).map(weight).sum()
        };
        let mean_of_bits = (0..1 << weights.len()).map(mean).collect();
        Self {
            weights,
            mean_of_bits,
        }
    }

    /// Returns the number of pixels minus the number of windows along an axis.
    fn rim(&self) -> usize {
        self.weights.len() - 1
    }

    /// Returns the weighted means over the windows that lie within a mask.
    fn means(&self, mask: &Mask) -> Grid<f64> {
        let [width, height] =
            [mask.width(), mask.height()].map(|side| side.saturating_sub(self.rim()));
        let mut means = Grid::new(width, height, 0.0);
        self.for_each_row([mask], &[0..width, 0..height], |y, [row]| {
            means.data_mut()[y * width..(y + 1) * width].copy_from_slice(row);
        });
        means
    }

    /// Calls `visit` for each row of windows, with the index of the row and the weighted means of each mask. The masks
    /// have the same size. Buffers hold only the pixel rows of one window, and therefore stay in the CPU cache.
    #[inline(always)]
    fn for_each_row<const MASKS: usize>(
        &self,
        masks: [&Mask; MASKS],
        [columns, rows]: &Windows,
        mut visit: impl FnMut(usize, [&[f64]; MASKS]),
    ) {
        let width = columns.len();
        if rows.is_empty() || width == 0 {
            return;
        }
        let (rim, seen) = (self.rim(), self.weights.len());
        let mut across = masks.map(|_| vec![0.0; seen * width]);
        let mut means = masks.map(|_| vec![0.0; width]);
        for y in rows.start..rows.end + rim {
            for (mask, across) in masks.iter().zip(&mut across) {
                let pixels = &mask.row(y)[columns.start..columns.end + rim];
                self.across(pixels, &mut across[y % seen * width..][..width]);
            }
            if y >= rows.start + rim {
                for (across, means) in across.iter().zip(&mut means) {
                    self.down(across, y - rim, means);
                }
                visit(y - rim, means.each_ref().map(Vec::as_slice));
            }
        }
    }

    /// Computes weighted means along a row of pixels.
    #[inline(always)]
    fn across(&self, pixels: &[bool], means: &mut [f64]) {
        let (first, rest) = pixels.split_at(self.rim());
        let shift_in =
            |bits: usize, set: bool| (bits << 1 | usize::from(set)) & (self.mean_of_bits.len() - 1);
        let mut bits = first.iter().fold(0, |bits, set| shift_in(bits, *set));
        for (mean, set) in means.iter_mut().zip(rest) {
            bits = shift_in(bits, *set);
            *mean = self.mean_of_bits[bits];
        }
    }

    /// Computes the weighted means down the columns of the windows that start at row `y`. `across` is a ring buffer.
    /// The slot of a row is the row's index modulo the number of weights.
    #[inline(always)]
    fn down(&self, across: &[f64], y: usize, means: &mut [f64]) {
        match *self.weights.as_slice() {
            [a, b, c, d, _, _, _] => weighted_sum([a, b, c, d], across, y, means),
            [a, b, c, d, e, f, _, _, _, _, _] => weighted_sum([a, b, c, d, e, f], across, y, means),
            _ => unreachable!("windows have 7 or 11 weights"),
        }
    }
}

/// Sums rows with symmetric weights. `weights` holds the first half of the weights, including the middle one.
#[inline(always)]
fn weighted_sum<const HALF: usize>(
    weights: [f64; HALF],
    across: &[f64],
    y: usize,
    means: &mut [f64],
) {
    let (last, width) = (2 * HALF - 2, means.len());
    let row = |k: usize| &across[(y + k) % (last + 1) * width..][..width];
    let above: [&[f64]; HALF] = std::array::from_fn(row);
    let below: [&[f64]; HALF] = std::array::from_fn(|k| row(last - k));
    for x in 0..width {
        let mut mean = weights[HALF - 1] * above[HALF - 1][x];
        for k in 0..HALF - 1 {
            mean += weights[k] * (above[k][x] + below[k][x]);
        }
        means[x] = mean;
    }
}

#[cfg(test)]
mod tests {
    use super::{GAUSSIAN_WEIGHTS, SsimReference, SsimWindow};
    use mocban_core::raster::Mask;

    #[test]
    fn weights_of_the_gaussian_follow_its_formula() {
        for (distance, weight) in GAUSSIAN_WEIGHTS.into_iter().enumerate() {
            let exact = (-((distance * distance) as f64) / (2.0 * 1.5 * 1.5)).exp();
            assert!(
                (weight - exact).abs() <= f64::EPSILON / 2.0 * exact,
                "{distance}"
            );
        }
    }

    /// Returns two masks that are easy to rebuild in another language: a disc and a rotated box, both with holes.
    fn reference_masks() -> (Mask, Mask) {
        let disc = Mask::from_fn(96, 80, |x, y| {
            let (dx, dy) = (x as i64 - 44, y as i64 - 37);
            dx * dx + dy * dy < 700 && (x * 7 + y * 3) % 11 != 0
        });
        let boxed = Mask::from_fn(96, 80, |x, y| {
            let (u, v) = (2 * x as i64 + y as i64, 2 * y as i64 - x as i64);
            (70..170).contains(&u) && (-10..70).contains(&v) && (x * 5 + y) % 13 != 0
        });
        (disc, boxed)
    }

    #[test]
    fn equals_scikit_image_gaussian() {
        let (a, b) = reference_masks();
        let got = SsimReference::new(&a, SsimWindow::Gaussian)
            .compare(&b)
            .ssim;
        assert!((got - GAUSSIAN).abs() < 1e-9, "{got}");
    }

    #[test]
    fn equals_scikit_image_uniform() {
        let (a, b) = reference_masks();
        let got = SsimReference::new(&a, SsimWindow::Uniform7)
            .compare(&b)
            .ssim;
        assert!((got - UNIFORM).abs() < 1e-9, "{got}");
    }

    #[test]
    fn structure_part_equals_the_formula_in_numpy() {
        let (a, b) = reference_masks();
        let means = SsimReference::new(&a, SsimWindow::Gaussian);
        let got = means.compare(&b).nl_ssim;
        assert!((got - STRUCTURE).abs() < 1e-9, "{got}");
        assert_eq!(means.nl_ssim(&b), got);
    }

    // Computed on the reference masks as float64 by scikit-image 0.26,
    // `structural_similarity(a, b, data_range=1.0, ...)`. The structure factor is computed with
    // `scipy.ndimage.gaussian_filter(sigma=1.5, truncate=3.5)` on the same windows.
    const GAUSSIAN: f64 = 0.508_712_369_326_821_2;
    const UNIFORM: f64 = 0.583_304_742_506_446_5;
    const STRUCTURE: f64 = 0.517_618_603_199_105_7;
}
