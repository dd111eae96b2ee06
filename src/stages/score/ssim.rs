//! Structural similarity of masks: Wang, Bovik, Sheikh and Simoncelli 2004, doi:10.1109/TIP.2003.819861.

use serde::{Deserialize, Serialize};

use crate::raster::{Grid, Mask};

/// Stabilising constants for a data range of 1: `C1 = (0.01)^2`, `C2 = (0.03)^2`.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// The local window of SSIM.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SsimWindow {
    /// Gaussian of sigma 1.5 cut at 3.5 sigma (11 taps), population covariance: the paper of 2004, and
    /// scikit-image with `gaussian_weights=True, use_sample_covariance=False`.
    Gaussian,
    /// Uniform 7 x 7, sample covariance: scikit-image's default.
    Uniform7,
}

impl SsimWindow {
    /// Weights along one axis, summing to 1; their number is odd.
    fn taps(self) -> Vec<f64> {
        match self {
            Self::Gaussian => {
                let raw: Vec<f64> = (-5..=5)
                    .map(|i| (-f64::from(i * i) / (2.0 * 1.5 * 1.5)).exp())
                    .collect();
                let sum: f64 = raw.iter().sum();
                raw.iter().map(|w| w / sum).collect()
            }
            Self::Uniform7 => vec![1.0 / 7.0; 7],
        }
    }

    /// Factor on variances and covariance.
    fn covariance_factor(self) -> f64 {
        match self {
            Self::Gaussian => 1.0,
            Self::Uniform7 => 49.0 / 48.0,
        }
    }
}

/// Means over the map, its rim of half a window left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structure {
    /// Mean structural similarity.
    pub ssim: f64,
    /// Mean of `(2 s_xy + C2) / (s_x^2 + s_y^2 + C2)`: without the luminance factor.
    pub nl_ssim: f64,
}

/// A mask with its windowed means, kept to compare many masks with one.
#[derive(Debug, Clone)]
pub struct WindowMeans {
    mask: Mask,
    taps: Taps,
    /// Means over the windows that lie wholly in the mask: a rim of half a window is left out.
    means: Grid<f64>,
    covariance_factor: f64,
}

impl WindowMeans {
    /// Computes the windowed means of a mask.
    pub fn new(mask: &Mask, window: SsimWindow) -> Self {
        let taps = Taps::new(window.taps());
        Self {
            means: taps.means(mask),
            taps,
            mask: mask.clone(),
            covariance_factor: window.covariance_factor(),
        }
    }

    /// The mask itself.
    pub const fn mask(&self) -> &Mask {
        &self.mask
    }

    /// Structure of this mask against another of the same size.
    pub fn against(&self, other: &Mask) -> Structure {
        let pairs = self.mask.data().iter().zip(other.data());
        let mut both = other.clone();
        for (both, (a, b)) in both.data_mut().iter_mut().zip(pairs) {
            *both = *a && *b;
        }
        self.fold(&self.taps.means(other), &self.taps.means(&both))
    }

    /// Since a mask is its own square, `E[x^2] = E[x]`: three windowed means hold all there is.
    fn fold(&self, mean_other: &Grid<f64>, mean_both: &Grid<f64>) -> Structure {
        let factor = self.covariance_factor;
        let (mut ssim, mut nl_ssim) = ([0.0; LANES], [0.0; LANES]);
        let mut add = |u: [f64; LANES], v: [f64; LANES], both: [f64; LANES], count: usize| {
            for k in 0..count {
                let (u, v) = (u[k], v[k]);
                let variances = factor * (u - u * u + v - v * v);
                let covariance = factor * (both[k] - u * v);
                let structure = (2.0 * covariance + C2) / (variances + C2);
                let luminance = (2.0 * u * v + C1) / (u * u + v * v + C1);
                ssim[k] += luminance * structure;
                nl_ssim[k] += structure;
            }
        };
        let parts = [&self.means, mean_other, mean_both].map(|means| means.data().as_chunks());
        let [(first, first_rest), (other, other_rest), (both, both_rest)] = parts;
        for ((u, v), both) in first.iter().zip(other).zip(both) {
            add(*u, *v, *both, LANES);
        }
        let padded = |rest: &[f64]| std::array::from_fn(|k| rest.get(k).copied().unwrap_or(0.0));
        let rest = [first_rest, other_rest, both_rest].map(padded);
        add(rest[0], rest[1], rest[2], first_rest.len());
        let n = self.means.data().len().max(1) as f64;
        Structure {
            ssim: ssim.iter().sum::<f64>() / n,
            nl_ssim: nl_ssim.iter().sum::<f64>() / n,
        }
    }
}

/// Sums kept apart, so that one addition need not wait for the last.
const LANES: usize = 4;

/// The weights of a window along one axis.
#[derive(Debug, Clone)]
struct Taps {
    weights: Vec<f64>,
    /// The weighted mean of every row of so many pixels of a mask, by its bits: the last pixel is the lowest bit.
    of_bits: Vec<f64>,
}

impl Taps {
    fn new(weights: Vec<f64>) -> Self {
        let mean = |bits: usize| {
            let set = weights
                .iter()
                .enumerate()
                .filter(|(k, _)| bits >> k & 1 == 1);
            set.map(|(_, weight)| weight).sum()
        };
        let of_bits = (0..1 << weights.len()).map(mean).collect();
        Self { weights, of_bits }
    }

    /// Weighted means of a mask over the windows that lie wholly in it.
    fn means(&self, mask: &Mask) -> Grid<f64> {
        self.down(&self.across(mask))
    }

    fn across(&self, mask: &Mask) -> Grid<f64> {
        let lost = self.weights.len() - 1;
        let width = mask.width().saturating_sub(lost);
        let mut across = Grid::new(width, mask.height(), 0.0);
        for y in 0..mask.height() {
            let row = mask.row(y);
            let shift_in =
                |bits: usize, set: bool| (bits << 1 | usize::from(set)) & (self.of_bits.len() - 1);
            let mut bits = row
                .iter()
                .take(lost)
                .fold(0, |bits, set| shift_in(bits, *set));
            let means = &mut across.data_mut()[y * width..(y + 1) * width];
            for (mean, set) in means.iter_mut().zip(row.iter().skip(lost)) {
                bits = shift_in(bits, *set);
                *mean = self.of_bits[bits];
            }
        }
        across
    }

    /// Weighted means down the columns.
    fn down(&self, across: &Grid<f64>) -> Grid<f64> {
        let width = across.width();
        let height = across.height().saturating_sub(self.weights.len() - 1);
        let mut means = Grid::new(width, height, 0.0);
        for y in 0..height {
            let row = &mut means.data_mut()[y * width..(y + 1) * width];
            let (runs, rest) = row.as_chunks_mut();
            for (k, run) in runs.iter_mut().enumerate() {
                *run = self.below::<COLUMNS>(across, k * COLUMNS, y);
            }
            let first = width - rest.len();
            for (k, mean) in rest.iter_mut().enumerate() {
                [*mean] = self.below(across, first + k, y);
            }
        }
        means
    }

    /// The weighted means of some columns side by side; weights that are alike share a product.
    #[inline]
    fn below<const N: usize>(&self, across: &Grid<f64>, x: usize, y: usize) -> [f64; N] {
        let last = self.weights.len() - 1;
        let row = |k: usize| &across.row(y + k)[x..x + N];
        let mut sums = [0.0; N];
        for (k, weight) in self.weights[..last / 2].iter().enumerate() {
            for (sum, (a, b)) in sums.iter_mut().zip(row(k).iter().zip(row(last - k))) {
                *sum += weight * (a + b);
            }
        }
        for (sum, value) in sums.iter_mut().zip(row(last / 2)) {
            *sum += self.weights[last / 2] * value;
        }
        sums
    }
}

/// Columns that are summed together.
const COLUMNS: usize = 8;

#[cfg(test)]
mod tests {
    use super::{SsimWindow, WindowMeans};
    use crate::raster::Mask;

    /// Two masks that any language can rebuild: a disc and a turned, shifted box with holes.
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
        let got = WindowMeans::new(&a, SsimWindow::Gaussian).against(&b).ssim;
        assert!((got - GAUSSIAN).abs() < 1e-9, "{got}");
    }

    #[test]
    fn equals_scikit_image_uniform() {
        let (a, b) = reference_masks();
        let got = WindowMeans::new(&a, SsimWindow::Uniform7).against(&b).ssim;
        assert!((got - UNIFORM).abs() < 1e-9, "{got}");
    }

    #[test]
    fn structure_part_equals_the_formula_in_numpy() {
        let (a, b) = reference_masks();
        let got = WindowMeans::new(&a, SsimWindow::Gaussian)
            .against(&b)
            .nl_ssim;
        assert!((got - STRUCTURE).abs() < 1e-9, "{got}");
    }

    // scikit-image 0.26 structural_similarity(a, b, data_range=1.0, ...) on the masks above as float64, and the structure
    // factor from scipy.ndimage.gaussian_filter(sigma=1.5, truncate=3.5) on the same crop.
    const GAUSSIAN: f64 = 0.508_712_369_326_821_2;
    const UNIFORM: f64 = 0.583_304_742_506_446_5;
    const STRUCTURE: f64 = 0.517_618_603_199_105_7;
}
