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
    means: Grid<f64>,
    window: SsimWindow,
}

impl WindowMeans {
    /// Computes the windowed means of a mask.
    pub fn new(mask: &Mask, window: SsimWindow) -> Self {
        Self {
            means: smooth(&indicator(mask), &window.taps()),
            mask: mask.clone(),
            window,
        }
    }

    /// The mask itself.
    pub const fn mask(&self) -> &Mask {
        &self.mask
    }

    /// Structure of this mask against another of the same size.
    pub fn against(&self, other: &Mask) -> Structure {
        let taps = self.window.taps();
        let both = Mask::from_fn(other.width(), other.height(), |x, y| {
            other.at(x, y) && self.mask.at(x, y)
        });
        let mean_other = smooth(&indicator(other), &taps);
        let mean_both = smooth(&indicator(&both), &taps);
        self.fold(&mean_other, &mean_both, taps.len() / 2)
    }

    /// Since a mask is its own square, `E[x^2] = E[x]`: three windowed means hold all there is.
    fn fold(&self, mean_other: &Grid<f64>, mean_both: &Grid<f64>, rim: usize) -> Structure {
        let factor = self.window.covariance_factor();
        let (width, height) = (self.means.width(), self.means.height());
        let (mut ssim, mut nl_ssim, mut n) = (0.0, 0.0, 0_usize);
        for y in rim..height.saturating_sub(rim) {
            for x in rim..width.saturating_sub(rim) {
                let (u, v) = (self.means.at(x, y), mean_other.at(x, y));
                let variances = factor * (u - u * u + v - v * v);
                let covariance = factor * (mean_both.at(x, y) - u * v);
                let structure = (2.0 * covariance + C2) / (variances + C2);
                let luminance = (2.0 * u * v + C1) / (u * u + v * v + C1);
                ssim += luminance * structure;
                nl_ssim += structure;
                n += 1;
            }
        }
        let n = n.max(1) as f64;
        Structure {
            ssim: ssim / n,
            nl_ssim: nl_ssim / n,
        }
    }
}

/// SSIM with and without luminance of two masks of one size, at least as large as the window.
pub fn structure_maps(a: &Mask, b: &Mask, window: SsimWindow) -> Structure {
    WindowMeans::new(a, window).against(b)
}

fn indicator(mask: &Mask) -> Grid<f64> {
    mask.map(|set| f64::from(u8::from(*set)))
}

/// Separable weighted mean; beyond the rim values are mirrored (the edge pixel twice), as SciPy's `reflect`.
fn smooth(values: &Grid<f64>, taps: &[f64]) -> Grid<f64> {
    let (width, height) = (values.width(), values.height());
    let half = taps.len() / 2;
    let mut across = Grid::new(width, height, 0.0);
    for y in 0..height {
        let row = values.row(y);
        for x in 0..width {
            let mean = if x >= half && x + half < width {
                dot(&row[x - half..=x + half], taps)
            } else {
                (0..taps.len())
                    .map(|k| taps[k] * row[mirror(x + k, half, width)])
                    .sum()
            };
            across.set(x, y, mean);
        }
    }
    let mut both = Grid::new(width, height, 0.0);
    for y in 0..height {
        let out = &mut both.data_mut()[y * width..(y + 1) * width];
        for (k, weight) in taps.iter().enumerate() {
            let row = across.row(mirror(y + k, half, height));
            for (sum, value) in out.iter_mut().zip(row) {
                *sum += weight * value;
            }
        }
    }
    both
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(p, q)| p * q).sum()
}

/// Index `shifted - half` mirrored into `0..len`.
fn mirror(shifted: usize, half: usize, len: usize) -> usize {
    let period = 2 * len as i64;
    let i = (shifted as i64 - half as i64).rem_euclid(period);
    if i < len as i64 {
        i as usize
    } else {
        (period - 1 - i) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::{SsimWindow, structure_maps};
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
        let got = structure_maps(&a, &b, SsimWindow::Gaussian).ssim;
        assert!((got - GAUSSIAN).abs() < 1e-9, "{got}");
    }

    #[test]
    fn equals_scikit_image_uniform() {
        let (a, b) = reference_masks();
        let got = structure_maps(&a, &b, SsimWindow::Uniform7).ssim;
        assert!((got - UNIFORM).abs() < 1e-9, "{got}");
    }

    #[test]
    fn structure_part_equals_the_formula_in_numpy() {
        let (a, b) = reference_masks();
        let got = structure_maps(&a, &b, SsimWindow::Gaussian).nl_ssim;
        assert!((got - STRUCTURE).abs() < 1e-9, "{got}");
    }

    // scikit-image 0.26 structural_similarity(a, b, data_range=1.0, ...) on the masks above as float64, and the structure
    // factor from scipy.ndimage.gaussian_filter(sigma=1.5, truncate=3.5) on the same crop.
    const GAUSSIAN: f64 = 0.508_712_369_326_821_2;
    const UNIFORM: f64 = 0.583_304_742_506_446_5;
    const STRUCTURE: f64 = 0.517_618_603_199_105_7;
}
