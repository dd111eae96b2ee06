//! Image pyramid of a soft mask: one level per working size, smoothed and high-pass filtered.

use super::top_hat::top_hat;
use mocban_core::domain::Affine2;
use mocban_core::raster::blur::{gaussian_blur, gaussian_blur_transposed};
use mocban_core::raster::{Grid, Mask, resample, resample_transposed};
use mocban_core::simd::dispatch;

/// An amount for each pixel of an image, and a mask of the pixels where the amount is known.
#[derive(Debug, Clone)]
pub(crate) struct SoftMask {
    /// Ink of a print or strokes of a relief, 0..=1, or depth below the stroke tops, as a fraction of the relief's
    /// depth.
    pub(crate) amount: Grid<f32>,
    /// Where the image has data.
    pub(crate) known: Mask,
}

/// A soft mask resampled to the largest working size. All levels are computed from it.
#[derive(Debug, Clone)]
pub(crate) struct ImagePyramid {
    /// Amount times `known`, resampled.
    present: Grid<f32>,
    known: Grid<f32>,
    from_image: Affine2,
    /// Longest side of the known box, working pixels.
    size: f64,
}

/// One level of the pyramid. All grids have the same size, and are 0 where the image has no data.
#[derive(Debug, Clone)]
pub(crate) struct PyramidLevel {
    /// `amount` minus its low-pass part.
    pub(super) value: Grid<f32>,
    /// Smoothed amount, 0..=1.
    pub(super) amount: Grid<f32>,
    /// 1 where the level is known, 0 elsewhere.
    pub(super) weight: Grid<f32>,
    pub(super) work_from_image: Affine2,
}

/// Sigma of the low-pass filter, as a fraction of the level's longest side.
const LOW_PASS_SHARE: f64 = 0.14;
/// Longest side of the grids on which the low-pass filter runs, in pixels. Larger levels are shrunk first.
const LOW_PASS_PX: usize = 48;
/// A working pixel is known if at least this fraction of its area is known.
const MIN_KNOWN: f32 = 0.5;

impl ImagePyramid {
    /// Resamples a soft mask so that the bounding box of its known pixels has `size` working pixels along the longest
    /// side. Returns `None` if nothing is known.
    pub(crate) fn new(soft: &SoftMask, size: usize) -> Option<Self> {
        let bounds = soft.known.bounding_box()?;
        let longest = bounds.longest_side() as f64;
        let scale = size as f64 / longest;
        let middle = [bounds.x0 + bounds.x1, bounds.y0 + bounds.y1].map(|sum| sum as f64 / 2.0);
        let (sides, shift) = fit_grid([bounds.width(), bounds.height()], middle, scale);
        let known = soft.known.to_weights();
        let present = soft.amount.zip_map(&known, |amount, known| amount * known);
        let resampled = |values| resample_transposed(values, scale, shift, sides).transposed();
        Some(Self {
            present: resampled(&present),
            known: resampled(&known),
            from_image: Affine2::scale_shift(scale, shift),
            size: size as f64,
        })
    }

    /// Replaces each known pixel's amount.
    pub(crate) fn map(self, amount: impl Fn(f32) -> f32) -> Self {
        Self {
            present: self.mapped(amount),
            ..self
        }
    }

    /// Returns `present` with each known pixel's amount replaced.
    fn mapped(&self, amount: impl Fn(f32) -> f32) -> Grid<f32> {
        let mut mapped = self.present.clone();
        let pairs = mapped.data_mut().iter_mut().zip(self.known.data());
        dispatch!({
            for (present, known) in pairs {
                let is_known = *known > 0.0;
                let share = if is_known { *known } else { 1.0 };
                let replaced = share * amount(*present / share);
                *present = if is_known { replaced } else { 0.0 };
            }
        });
        mapped
    }

    /// Returns the image without plateaus wider than `2 radius + 1` working pixels. Returns `None` if the plateaus hold less
    /// than the fraction `least` of the amount.
    pub(crate) fn without_plateaus(&self, radius: usize, least: f32) -> Option<Self> {
        let hat = top_hat(&self.present, &self.known, radius);
        let [before, after] = [&self.present, &hat].map(|of| of.data().iter().sum::<f32>());
        (after < (1.0 - least) * before && after > 0.0).then(|| Self {
            present: hat,
            known: self.known.clone(),
            ..*self
        })
    }

    /// Computes the level with `size` working pixels along the longest side. The level is smoothed by a Gaussian whose
    /// sigma is `sigma` working pixels.
    pub(crate) fn level(&self, size: usize, sigma: f64) -> PyramidLevel {
        self.level_builder(size, sigma).level(&self.present)
    }

    /// Prepares levels of one size and smoothing.
    pub(crate) fn level_builder(&self, size: usize, sigma: f64) -> LevelBuilder<'_> {
        let scale = size as f64 / self.size;
        let sides = [self.known.width(), self.known.height()];
        let (sides, shift) = fit_grid(sides, sides.map(middle), scale);
        let transposed = resample_transposed(&self.known, scale, shift, sides);
        let weight = gaussian_blur_transposed(transposed, sigma);
        LevelBuilder {
            base: self,
            size,
            sigma,
            scale,
            shift,
            sides,
            low_pass_weight: low_pass(&weight, size),
            weight,
        }
    }
}

/// Data that all levels of one size and smoothing share.
pub(crate) struct LevelBuilder<'a> {
    base: &'a ImagePyramid,
    size: usize,
    sigma: f64,
    scale: f64,
    shift: [f64; 2],
    sides: [usize; 2],
    /// Known fraction of each working pixel.
    weight: Grid<f32>,
    /// Low-pass part of `weight`.
    low_pass_weight: Grid<f32>,
}

impl LevelBuilder<'_> {
    /// Computes the level with each known pixel's amount replaced.
    pub(crate) fn mapped_level(&self, amount: impl Fn(f32) -> f32) -> PyramidLevel {
        self.level(&self.base.mapped(amount))
    }

    /// Computes the level of amounts that are zero where nothing is known.
    fn level(&self, present: &Grid<f32>) -> PyramidLevel {
        let transposed = resample_transposed(present, self.scale, self.shift, self.sides);
        let mut amount = gaussian_blur_transposed(transposed, self.sigma);
        // Becomes the high-pass value below.
        let mut value = low_pass(&amount, self.size);
        let mut known_share = self.weight.clone();
        let [width, height] = self.sides;
        dispatch!({
            let count = width * height;
            let low_pass_weight = &self.low_pass_weight.data()[..count];
            let amount = &mut amount.data_mut()[..count];
            let value = &mut value.data_mut()[..count];
            let known_share = &mut known_share.data_mut()[..count];
            for k in 0..count {
                let known = if known_share[k] >= MIN_KNOWN {
                    1.0
                } else {
                    0.0
                };
                let whole = amount[k] * (known / at_least_epsilon(known_share[k]));
                amount[k] = whole;
                value[k] = whole - known * value[k] / at_least_epsilon(low_pass_weight[k]);
                known_share[k] = known;
            }
        });
        PyramidLevel {
            value,
            amount,
            weight: known_share,
            work_from_image: Affine2::scale_shift(self.scale, self.shift)
                .after(&self.base.from_image),
        }
    }
}

/// Returns the weight, at least 1e-6, as a divisor.
#[inline(always)]
fn at_least_epsilon(weight: f32) -> f32 {
    if weight > 1e-6 { weight } else { 1e-6 }
}

/// Returns the low-pass part of a grid. `size` is the longest side of the grid's level, in pixels.
fn low_pass(values: &Grid<f32>, size: usize) -> Grid<f32> {
    if size <= LOW_PASS_PX {
        return gaussian_blur(values, LOW_PASS_SHARE * size as f64);
    }
    let sides = [values.width(), values.height()];
    let scale = LOW_PASS_PX as f64 / size as f64;
    let (few, shift) = fit_grid(sides, sides.map(middle), scale);
    let small = resample_transposed(values, scale, shift, few);
    let small = gaussian_blur_transposed(small, LOW_PASS_SHARE * LOW_PASS_PX as f64);
    resample(&small, 1.0 / scale, shift.map(|s| -s / scale), sides)
}

/// Returns the middle of a side of a grid, pixels.
fn middle(side: usize) -> f64 {
    (side - 1) as f64 / 2.0
}

/// Returns the size of a grid that holds a scaled box, and the shift in pixels that centres the box in the grid.
fn fit_grid(sides: [usize; 2], middle: [f64; 2], scale: f64) -> ([usize; 2], [f64; 2]) {
    let half = sides.map(|side| (side as f64 * scale / 2.0).ceil() + 1.0);
    let shift = [0, 1].map(|k| half[k] - scale * middle[k]);
    (half.map(|half| 2 * half as usize + 1), shift)
}

impl PyramidLevel {
    /// Returns the level where a function of the image pixel is true.
    pub(crate) fn restricted(&self, keep: impl Fn([f64; 2]) -> bool) -> Option<Self> {
        let image_from_work = self.work_from_image.inverse()?;
        let (width, height) = (self.value.width(), self.value.height());
        let valid = Grid::from_fn(width, height, |x, y| {
            let is_kept = keep(image_from_work.apply([x as f64, y as f64]));
            if is_kept { self.weight.at(x, y) } else { 0.0 }
        });
        Some(self.restricted_to(valid))
    }

    /// Calls a function with the position in the image and the amount of each known pixel.
    pub(crate) fn each_amount(&self, mut visit: impl FnMut([f64; 2], f32)) -> Option<()> {
        let image_from_work = self.work_from_image.inverse()?;
        for y in 0..self.value.height() {
            for x in (0..self.value.width()).filter(|x| self.weight.at(*x, y) > 0.0) {
                visit(
                    image_from_work.apply([x as f64, y as f64]),
                    self.amount.at(x, y),
                );
            }
        }
        Some(())
    }

    /// Returns the level masked by `valid` (1 or 0 a pixel).
    pub(super) fn restricted_to(&self, valid: Grid<f32>) -> Self {
        let over = |values: &Grid<f32>| values.zip_map(&valid, |value, valid| value * valid);
        Self {
            value: over(&self.value),
            amount: over(&self.amount),
            weight: valid,
            work_from_image: self.work_from_image,
        }
    }

    /// Returns the centre of the level, working pixels.
    pub(super) fn centre(&self) -> [f64; 2] {
        [self.value.width(), self.value.height()].map(middle)
    }

    /// Returns the sum of squared values.
    pub(super) fn energy(&self) -> f64 {
        self.value
            .data()
            .iter()
            .map(|v| f64::from(*v).powi(2))
            .sum()
    }
}

/// A position between four pixels, for bilinear interpolation in all grids of the same size.
#[derive(Debug, Clone, Copy)]
pub(super) struct BilinearCell {
    /// Index of the upper left pixel.
    pub(super) from: usize,
    /// Offset from this pixel along x and y, 0..1.
    pub(super) fraction: [f32; 2],
    width: usize,
}

impl BilinearCell {
    /// Locates a position; `None` outside the grid.
    #[inline(always)]
    pub(super) fn at([width, height]: [usize; 2], [x, y]: [f64; 2]) -> Option<Self> {
        // Also rejects NaN. Casts truncate; `floor` would be a call.
        if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f64 && y < (height - 1) as f64) {
            return None;
        }
        let (column, row) = (x as i32, y as i32);
        Some(Self {
            from: row as usize * width + column as usize,
            fraction: [(x - f64::from(column)) as f32, (y - f64::from(row)) as f32],
            width,
        })
    }

    /// Locates a position in single precision; `None` outside the grid.
    #[inline(always)]
    pub(super) fn at_single([width, height]: [usize; 2], [x, y]: [f32; 2]) -> Option<Self> {
        if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f32 && y < (height - 1) as f32) {
            return None;
        }
        let (column, row) = (x as i32, y as i32);
        Some(Self {
            from: row as usize * width + column as usize,
            fraction: [x - column as f32, y - row as f32],
            width,
        })
    }

    /// Interpolates bilinearly.
    #[inline(always)]
    pub(super) fn value(&self, values: &Grid<f32>) -> f32 {
        let (width, [fx, fy]) = (self.width, self.fraction);
        let near = &values.data()[self.from..self.from + width + 2];
        let a = near[0] + (near[1] - near[0]) * fx;
        let b = near[width] + (near[width + 1] - near[width]) * fx;
        a + (b - a) * fy
    }
}
