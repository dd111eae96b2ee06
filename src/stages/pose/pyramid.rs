//! Image pyramid of a soft mask: levels at working size, smoothed and high-pass filtered.

use crate::domain::Affine2;
use crate::raster::{
    Grid, Mask, PixelBox, resample, resample_rows_transposed, resample_transposed,
};
use crate::simd::dispatch;
use crate::stages::blur::{gaussian_blur, gaussian_blur_transposed};

/// Soft mask: an amount of 0..=1 for each pixel, and where it is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct SoftMask {
    /// Ink of a print, or nearness to the stroke tops of a relief.
    pub(in crate::stages) amount: Grid<f32>,
    /// Where the image has data.
    pub(in crate::stages) known: Mask,
}

/// A soft mask at the largest working size, from which levels are computed. Stored transposed.
#[derive(Debug, Clone)]
pub(in crate::stages) struct ImagePyramid {
    /// Amount times `known`.
    present: Grid<f32>,
    known: Grid<f32>,
    from_image: Affine2,
    /// Longest side of the known box, working pixels.
    size: f64,
}

/// One level of the pyramid. All grids have the same size; they are zero where nothing is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct PyramidLevel {
    pub(super) value: Grid<f32>,
    /// Smoothed amount, 0..=1.
    pub(super) amount: Grid<f32>,
    /// 1 where the level is known, 0 elsewhere.
    pub(super) weight: Grid<f32>,
    pub(super) work_from_image: Affine2,
}

/// Sigma of the low-pass filter, a share of the level's size. `value` is `amount` without its low-pass part.
const LOW_PASS_SHARE: f64 = 0.14;
/// The low-pass filter runs on at most this many pixels along the longest side.
const LOW_PASS_PX: usize = 48;
/// A working pixel is known if at least this share of it is.
const MIN_KNOWN: f32 = 0.5;

impl SoftMask {
    /// Returns the bounding box of the known pixels; `None` if there are none.
    pub(in crate::stages) fn bounds(&self) -> Option<PixelBox> {
        self.known.bounding_box()
    }
}

impl ImagePyramid {
    /// Resamples a soft mask to `size` working pixels along the longest side of its known box; `None` if nothing is
    /// known.
    pub(in crate::stages) fn new(soft: &SoftMask, size: usize) -> Option<Self> {
        let bounds = soft.bounds()?;
        let longest = bounds.width().max(bounds.height()) as f64;
        let scale = size as f64 / longest;
        let middle = [
            (bounds.x0 + bounds.x1) as f64 / 2.0,
            (bounds.y0 + bounds.y1) as f64 / 2.0,
        ];
        let (sides, shift) = fit_grid([bounds.width(), bounds.height()], middle, scale);
        let from = [soft.known.width(), soft.known.height()];
        let present = resample_rows_transposed(
            from,
            #[inline(always)]
            |y, row| {
                let pairs = soft.amount.row(y).iter().zip(soft.known.row(y));
                for (present, (amount, known)) in row.iter_mut().zip(pairs) {
                    *present = amount * f32::from(u8::from(*known));
                }
            },
            scale,
            shift,
            sides,
        );
        let known = resample_rows_transposed(
            from,
            #[inline(always)]
            |y, row| {
                for (known, is_known) in row.iter_mut().zip(soft.known.row(y)) {
                    *known = f32::from(u8::from(*is_known));
                }
            },
            scale,
            shift,
            sides,
        );
        Some(Self {
            present: present.transposed(),
            known: known.transposed(),
            from_image: Affine2::scale_shift(scale, shift),
            size: size as f64,
        })
    }

    /// Replaces each known pixel's amount.
    pub(in crate::stages) fn map(mut self, amount: impl Fn(f32) -> f32) -> Self {
        let pairs = self.present.data_mut().iter_mut().zip(self.known.data());
        for (present, known) in pairs {
            *present = map_amount(*present, *known, &amount);
        }
        self
    }

    /// Computes the level of `size` working pixels along the longest side, smoothed by a Gaussian of `sigma` working
    /// pixels.
    pub(in crate::stages) fn level(&self, size: usize, sigma: f64) -> PyramidLevel {
        self.level_builder(size, sigma).build()
    }

    /// Prepares levels of one size and smoothing.
    pub(in crate::stages) fn level_builder(&self, size: usize, sigma: f64) -> LevelBuilder<'_> {
        LevelBuilder::new(self, size, sigma)
    }
}

/// What all levels of one size and smoothing share.
pub(in crate::stages) struct LevelBuilder<'a> {
    base: &'a ImagePyramid,
    size: usize,
    sigma: f64,
    scale: f64,
    shift: [f64; 2],
    sides: [usize; 2],
    /// Known share of each working pixel, and its low-pass part.
    weight: Grid<f32>,
    low_pass_weight: Grid<f32>,
}

impl<'a> LevelBuilder<'a> {
    fn new(base: &'a ImagePyramid, size: usize, sigma: f64) -> Self {
        let scale = size as f64 / base.size;
        let sides = [base.known.width(), base.known.height()];
        let middle = sides.map(|side| (side - 1) as f64 / 2.0);
        let (sides, shift) = fit_grid(sides, middle, scale);
        let weight =
            gaussian_blur_transposed(resample_transposed(&base.known, scale, shift, sides), sigma);
        Self {
            low_pass_weight: low_pass(&weight, size),
            base,
            size,
            sigma,
            scale,
            shift,
            sides,
            weight,
        }
    }

    /// Computes the level with each known pixel's amount replaced.
    pub(in crate::stages) fn mapped_level(&self, amount: impl Fn(f32) -> f32) -> PyramidLevel {
        let ImagePyramid { present, known, .. } = self.base;
        self.level(resample_rows_transposed(
            [present.width(), present.height()],
            #[inline(always)]
            |y, row| {
                let pairs = present.row(y).iter().zip(known.row(y));
                for (made, (present, known)) in row.iter_mut().zip(pairs) {
                    *made = map_amount(*present, *known, &amount);
                }
            },
            self.scale,
            self.shift,
            self.sides,
        ))
    }

    fn build(&self) -> PyramidLevel {
        let present = &self.base.present;
        self.level(resample_transposed(
            present, self.scale, self.shift, self.sides,
        ))
    }

    /// Computes the level of transposed amounts at its size.
    fn level(&self, transposed: Grid<f32>) -> PyramidLevel {
        let mut amount = gaussian_blur_transposed(transposed, self.sigma);
        // Becomes the high-pass value below.
        let mut value = low_pass(&amount, self.size);
        let mut known_share = self.weight.clone();
        let [width, height] = self.sides;
        dispatch(
            #[inline(always)]
            || {
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
            },
        );
        PyramidLevel {
            value,
            amount,
            weight: known_share,
            work_from_image: Affine2::scale_shift(self.scale, self.shift)
                .after(&self.base.from_image),
        }
    }
}

/// Returns `present` with the amount of its known share replaced.
#[inline(always)]
fn map_amount(present: f32, known: f32, amount: impl Fn(f32) -> f32) -> f32 {
    let is_known = known > 0.0;
    let share = if is_known { known } else { 1.0 };
    let replaced = share * amount(present / share);
    if is_known { replaced } else { 0.0 }
}

/// Returns the weight, at least 1e-6, as a divisor.
#[inline(always)]
fn at_least_epsilon(weight: f32) -> f32 {
    if weight > 1e-6 { weight } else { 1e-6 }
}

/// Returns the low-pass part of a grid whose known box has `size` pixels along the longest side.
fn low_pass(values: &Grid<f32>, size: usize) -> Grid<f32> {
    if size <= LOW_PASS_PX {
        return gaussian_blur(values, LOW_PASS_SHARE * size as f64);
    }
    let sides = [values.width(), values.height()];
    let middle = sides.map(|side| (side - 1) as f64 / 2.0);
    let scale = LOW_PASS_PX as f64 / size as f64;
    let (few, shift) = fit_grid(sides, middle, scale);
    let small = resample_transposed(values, scale, shift, few);
    let small = gaussian_blur_transposed(small, LOW_PASS_SHARE * LOW_PASS_PX as f64);
    resample(&small, 1.0 / scale, shift.map(|s| -s / scale), sides)
}

/// Returns the size of a grid that holds a scaled box, and the shift that centres the box in it, pixels.
fn fit_grid(sides: [usize; 2], middle: [f64; 2], scale: f64) -> ([usize; 2], [f64; 2]) {
    let half = sides.map(|side| (side as f64 * scale / 2.0).ceil() + 1.0);
    let shift = [0, 1].map(|k| half[k] - scale * middle[k]);
    (half.map(|half| 2 * half as usize + 1), shift)
}

impl PyramidLevel {
    /// Returns the level masked by `valid` (1 or 0 a pixel).
    pub(super) fn restricted_to(&self, valid: Grid<f32>) -> Self {
        let over = |values: &Grid<f32>| {
            let mut kept = values.clone();
            let pairs = kept.data_mut().iter_mut().zip(valid.data());
            pairs.for_each(|(value, valid)| *value *= valid);
            kept
        };
        Self {
            value: over(&self.value),
            amount: over(&self.amount),
            weight: valid,
            work_from_image: self.work_from_image,
        }
    }

    /// Returns the centre of the level, working pixels.
    pub(super) fn centre(&self) -> [f64; 2] {
        [
            (self.value.width() - 1) as f64 / 2.0,
            (self.value.height() - 1) as f64 / 2.0,
        ]
    }

    /// Returns the sum of squared values.
    pub(super) fn energy(&self) -> f64 {
        let squares = self.value.data().iter().map(|v| f64::from(*v).powi(2));
        squares.sum()
    }
}

/// Interpolates bilinearly; 0 outside.
#[inline]
pub(super) fn bilinear(values: &Grid<f32>, place: [f64; 2]) -> f32 {
    BilinearCell::at([values.width(), values.height()], place).map_or(0.0, |at| at.value(values))
}

/// A position between four pixels, for interpolation in grids of one size.
#[derive(Debug, Clone, Copy)]
pub(super) struct BilinearCell {
    /// Index of the pixel above and left, and the offset from it, 0..1.
    from: usize,
    fraction: [f32; 2],
    width: usize,
}

impl BilinearCell {
    /// Locates a position; `None` outside the grid.
    #[inline]
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

    /// Interpolates bilinearly.
    #[inline]
    pub(super) fn value(&self, values: &Grid<f32>) -> f32 {
        let (width, [fx, fy]) = (self.width, self.fraction);
        let near = &values.data()[self.from..self.from + width + 2];
        let a = near[0] + (near[1] - near[0]) * fx;
        let b = near[width] + (near[width + 1] - near[width]) * fx;
        a + (b - a) * fy
    }
}
