//! A picture brought to working size, its slow variation taken out.

use crate::domain::Affine2;
use crate::raster::{
    Grid, Mask, PixelBox, resample, resample_rows_transposed, resample_transposed,
};
use crate::simd::dispatch;
use crate::stages::blur::{gaussian_blur, gaussian_blur_transposed};

/// How much of something each pixel holds, 0..=1, and where that is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct SoftMask {
    /// Ink of a print, or nearness to the tops of a relief.
    pub(in crate::stages) amount: Grid<f32>,
    /// Where the picture holds data.
    pub(in crate::stages) known: Mask,
}

/// A soft picture at the largest working size, from which its layers are made.
#[derive(Debug, Clone)]
pub(in crate::stages) struct ImagePyramid {
    /// Amount where it is known, zero elsewhere.
    present: Grid<f32>,
    known: Grid<f32>,
    from_image: Affine2,
    /// Longest side of what is known, pixels.
    size: f64,
}

/// A soft picture at working size: mean near zero everywhere, zero where nothing is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct PyramidLevel {
    pub(super) value: Grid<f32>,
    /// What `value` was made from: 0..=1, zero where nothing is known.
    pub(super) amount: Grid<f32>,
    /// 1 where the picture is known, 0 elsewhere.
    pub(super) weight: Grid<f32>,
    pub(super) work_from_image: Affine2,
}

/// Slow variation is what a gaussian of this share of the working size keeps.
const SLOW: f64 = 0.14;
/// Slow variation is computed on this many pixels along the longest side: nothing finer is left in it.
const SLOW_PX: usize = 48;
/// Where less than this share of a working pixel is known, it holds nothing.
const LEAST_KNOWN: f32 = 0.5;

impl SoftMask {
    /// Box around what is known; `None` when nothing is.
    pub(in crate::stages) fn bounds(&self) -> Option<PixelBox> {
        self.known.bounding_box()
    }
}

impl ImagePyramid {
    /// Brings a picture to `size` pixels along the longest side of what it knows; `None` when it knows nothing.
    pub(in crate::stages) fn new(soft: &SoftMask, size: usize) -> Option<Self> {
        let bounds = soft.bounds()?;
        let longest = bounds.width().max(bounds.height()) as f64;
        let scale = size as f64 / longest;
        let middle = [
            (bounds.x0 + bounds.x1) as f64 / 2.0,
            (bounds.y0 + bounds.y1) as f64 / 2.0,
        ];
        let (sides, shift) = framed([bounds.width(), bounds.height()], middle, scale);
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

    /// The same with each known pixel's amount replaced.
    pub(in crate::stages) fn map(mut self, amount: impl Fn(f32) -> f32) -> Self {
        let pairs = self.present.data_mut().iter_mut().zip(self.known.data());
        for (present, known) in pairs {
            *present = replaced(*present, *known, &amount);
        }
        self
    }

    /// The layer of `size` pixels along the longest side of what is known, smoothed by `sigma` pixels.
    pub(in crate::stages) fn layer(&self, size: usize, sigma: f64) -> PyramidLevel {
        self.at(size, sigma).plain()
    }

    /// Ready to make layers of one size and smoothing.
    pub(in crate::stages) fn at(&self, size: usize, sigma: f64) -> LevelBuilder<'_> {
        LevelBuilder::new(self, size, sigma)
    }
}

/// What all layers of one size and smoothing of a picture share.
pub(in crate::stages) struct LevelBuilder<'a> {
    base: &'a ImagePyramid,
    size: usize,
    sigma: f64,
    scale: f64,
    shift: [f64; 2],
    sides: [usize; 2],
    /// How much of each working pixel is known, and the slow variation of that.
    weight: Grid<f32>,
    slow_weight: Grid<f32>,
}

impl<'a> LevelBuilder<'a> {
    fn new(base: &'a ImagePyramid, size: usize, sigma: f64) -> Self {
        let scale = size as f64 / base.size;
        let sides = [base.known.width(), base.known.height()];
        let middle = sides.map(|side| (side - 1) as f64 / 2.0);
        let (sides, shift) = framed(sides, middle, scale);
        let weight =
            gaussian_blur_transposed(resample_transposed(&base.known, scale, shift, sides), sigma);
        Self {
            slow_weight: slow(&weight, size),
            base,
            size,
            sigma,
            scale,
            shift,
            sides,
            weight,
        }
    }

    /// The layer of the picture with each known pixel's amount replaced.
    pub(in crate::stages) fn mapped(&self, amount: impl Fn(f32) -> f32) -> PyramidLevel {
        let ImagePyramid { present, known, .. } = self.base;
        self.layer(resample_rows_transposed(
            [present.width(), present.height()],
            #[inline(always)]
            |y, row| {
                let pairs = present.row(y).iter().zip(known.row(y));
                for (made, (present, known)) in row.iter_mut().zip(pairs) {
                    *made = replaced(*present, *known, &amount);
                }
            },
            self.scale,
            self.shift,
            self.sides,
        ))
    }

    fn plain(&self) -> PyramidLevel {
        let present = &self.base.present;
        self.layer(resample_transposed(
            present, self.scale, self.shift, self.sides,
        ))
    }

    /// Of amounts at its size, their rows and columns changed for each other.
    fn layer(&self, turned: Grid<f32>) -> PyramidLevel {
        let mut amount = gaussian_blur_transposed(turned, self.sigma);
        // What is slow becomes the value without it.
        let mut value = slow(&amount, self.size);
        let mut held = self.weight.clone();
        let [width, height] = self.sides;
        dispatch(
            #[inline(always)]
            || {
                let count = width * height;
                let slow_weight = &self.slow_weight.data()[..count];
                let amount = &mut amount.data_mut()[..count];
                let value = &mut value.data_mut()[..count];
                let held = &mut held.data_mut()[..count];
                for k in 0..count {
                    let known = if held[k] >= LEAST_KNOWN { 1.0 } else { 0.0 };
                    let whole = amount[k] * (known / least(held[k]));
                    amount[k] = whole;
                    value[k] = whole - known * value[k] / least(slow_weight[k]);
                    held[k] = known;
                }
            },
        );
        PyramidLevel {
            value,
            amount,
            weight: held,
            work_from_image: Affine2::scale_shift(self.scale, self.shift)
                .after(&self.base.from_image),
        }
    }
}

/// What is present in a pixel, of which so much is known, with the known part's amount replaced.
#[inline(always)]
fn replaced(present: f32, known: f32, amount: impl Fn(f32) -> f32) -> f32 {
    let is_known = known > 0.0;
    let share = if is_known { known } else { 1.0 };
    let replaced = share * amount(present / share);
    if is_known { replaced } else { 0.0 }
}

/// So much at least, to divide by.
#[inline(always)]
fn least(weight: f32) -> f32 {
    if weight > 1e-6 { weight } else { 1e-6 }
}

/// The slow variation of a layer of `size` pixels along the longest side of what is known.
fn slow(values: &Grid<f32>, size: usize) -> Grid<f32> {
    if size <= SLOW_PX {
        return gaussian_blur(values, SLOW * size as f64);
    }
    let sides = [values.width(), values.height()];
    let middle = sides.map(|side| (side - 1) as f64 / 2.0);
    let scale = SLOW_PX as f64 / size as f64;
    let (few, shift) = framed(sides, middle, scale);
    let small = resample_transposed(values, scale, shift, few);
    let small = gaussian_blur_transposed(small, SLOW * SLOW_PX as f64);
    resample(&small, 1.0 / scale, shift.map(|s| -s / scale), sides)
}

/// Size of the grid that holds a box of these sides, scaled, and the shift that puts the box's middle in its middle.
fn framed(sides: [usize; 2], middle: [f64; 2], scale: f64) -> ([usize; 2], [f64; 2]) {
    let half = sides.map(|side| (side as f64 * scale / 2.0).ceil() + 1.0);
    let shift = [0, 1].map(|k| half[k] - scale * middle[k]);
    (half.map(|half| 2 * half as usize + 1), shift)
}

impl PyramidLevel {
    /// The same, known only on some ground: 1 there, 0 elsewhere.
    pub(super) fn known_on(&self, ground: Grid<f32>) -> Self {
        let over = |values: &Grid<f32>| {
            let mut kept = values.clone();
            let pairs = kept.data_mut().iter_mut().zip(ground.data());
            pairs.for_each(|(value, ground)| *value *= ground);
            kept
        };
        Self {
            value: over(&self.value),
            amount: over(&self.amount),
            weight: ground,
            work_from_image: self.work_from_image,
        }
    }

    /// Middle of the layer in its own pixels.
    pub(super) fn centre(&self) -> [f64; 2] {
        [
            (self.value.width() - 1) as f64 / 2.0,
            (self.value.height() - 1) as f64 / 2.0,
        ]
    }

    /// Sum of squares of the values.
    pub(super) fn energy(&self) -> f64 {
        let squares = self.value.data().iter().map(|v| f64::from(*v).powi(2));
        squares.sum()
    }
}

/// Bilinear value; zero outside.
#[inline]
pub(super) fn sample(values: &Grid<f32>, place: [f64; 2]) -> f32 {
    Between::of([values.width(), values.height()], place).map_or(0.0, |at| at.value(values))
}

/// A place between four pixels of grids of one size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Between {
    /// The pixel up and left of it, and how far beyond it the place lies.
    from: usize,
    beyond: [f32; 2],
    width: usize,
}

impl Between {
    /// `None` outside.
    #[inline]
    pub(super) fn of([width, height]: [usize; 2], [x, y]: [f64; 2]) -> Option<Self> {
        // Also says no to what is not a number; below, casts round down, where `floor` would be a call.
        if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f64 && y < (height - 1) as f64) {
            return None;
        }
        let (column, row) = (x as i32, y as i32);
        Some(Self {
            from: row as usize * width + column as usize,
            beyond: [(x - f64::from(column)) as f32, (y - f64::from(row)) as f32],
            width,
        })
    }

    /// Bilinear value.
    #[inline]
    pub(super) fn value(&self, values: &Grid<f32>) -> f32 {
        let (width, [fx, fy]) = (self.width, self.beyond);
        let near = &values.data()[self.from..self.from + width + 2];
        let a = near[0] + (near[1] - near[0]) * fx;
        let b = near[width] + (near[width + 1] - near[width]) * fx;
        a + (b - a) * fy
    }
}
