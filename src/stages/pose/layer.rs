//! A picture brought to working size, its slow variation taken out.

use crate::domain::Affine2;
use crate::raster::{Grid, Mask, PixelBox, resample};
use crate::stages::blur::blur;

/// How much of something each pixel holds, 0..=1, and where that is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct Soft {
    /// Ink of a print, or nearness to the tops of a relief.
    pub(in crate::stages) amount: Grid<f32>,
    /// Where the picture holds data.
    pub(in crate::stages) known: Mask,
}

/// A soft picture at the largest working size, from which its layers are made.
#[derive(Debug, Clone)]
pub(in crate::stages) struct Base {
    /// Amount where it is known, zero elsewhere.
    present: Grid<f32>,
    known: Grid<f32>,
    from_image: Affine2,
    /// Longest side of what is known, pixels.
    size: f64,
}

/// A soft picture at working size: mean near zero everywhere, zero where nothing is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct Layer {
    pub(super) value: Grid<f32>,
    /// What `value` was made from: 0..=1, zero where nothing is known.
    pub(super) amount: Grid<f32>,
    /// 1 where the picture is known, 0 elsewhere.
    pub(super) weight: Grid<f32>,
    pub(super) work_from_image: Affine2,
}

/// Slow variation is what a gaussian of this share of the working size keeps.
const SLOW: f64 = 0.14;
/// Where less than this share of a working pixel is known, it holds nothing.
const LEAST_KNOWN: f32 = 0.5;

impl Soft {
    /// Box around what is known; `None` when nothing is.
    pub(in crate::stages) fn bounds(&self) -> Option<PixelBox> {
        self.known.bounding_box()
    }
}

impl Base {
    /// Brings a picture to `size` pixels along the longest side of what it knows; `None` when it knows nothing.
    pub(in crate::stages) fn new(soft: &Soft, size: usize) -> Option<Self> {
        let bounds = soft.bounds()?;
        let longest = bounds.width().max(bounds.height()) as f64;
        let scale = size as f64 / longest;
        let middle = [
            (bounds.x0 + bounds.x1) as f64 / 2.0,
            (bounds.y0 + bounds.y1) as f64 / 2.0,
        ];
        let (sides, shift) = framed([bounds.width(), bounds.height()], middle, scale);
        let known = soft.known.map(|k| f32::from(u8::from(*k)));
        let pairs = soft.amount.data().iter().zip(known.data());
        let present = pairs.map(|(amount, known)| amount * known).collect();
        let present = Grid::from_vec(known.width(), known.height(), present)?;
        Some(Self {
            present: resample(&present, scale, shift, sides),
            known: resample(&known, scale, shift, sides),
            from_image: Affine2::scale_shift(scale, shift),
            size: size as f64,
        })
    }

    /// The same with each known pixel's amount replaced.
    pub(in crate::stages) fn map(&self, amount: impl Fn(f32) -> f32) -> Self {
        let pairs = self.present.data().iter().zip(self.known.data());
        let replaced = pairs.map(|(p, k)| if *k > 0.0 { k * amount(p / k) } else { 0.0 });
        let mut out = self.clone();
        let values: Vec<f32> = replaced.collect();
        out.present.data_mut().copy_from_slice(&values);
        out
    }

    /// The layer of `size` pixels along the longest side of what is known, smoothed by `sigma` pixels.
    pub(in crate::stages) fn layer(&self, size: usize, sigma: f64) -> Layer {
        let scale = size as f64 / self.size;
        let (width, height) = (self.known.width(), self.known.height());
        let middle = [(width - 1) as f64 / 2.0, (height - 1) as f64 / 2.0];
        let (sides, shift) = framed([width, height], middle, scale);
        let brought = |values| blur(&resample(values, scale, shift, sides), sigma);
        let work_from_image = Affine2::scale_shift(scale, shift).after(&self.from_image);
        Layer::without_slow(
            &brought(&self.present),
            &brought(&self.known),
            size,
            work_from_image,
        )
    }
}

/// Size of the grid that holds a box of these sides, scaled, and the shift that puts the box's middle in its middle.
fn framed(sides: [usize; 2], middle: [f64; 2], scale: f64) -> ([usize; 2], [f64; 2]) {
    let half = sides.map(|side| (side as f64 * scale / 2.0).ceil() + 1.0);
    let shift = [0, 1].map(|k| half[k] - scale * middle[k]);
    (half.map(|half| 2 * half as usize + 1), shift)
}

impl Layer {
    fn without_slow(
        amount: &Grid<f32>,
        weight: &Grid<f32>,
        size: usize,
        work_from_image: Affine2,
    ) -> Self {
        let slow_sigma = SLOW * size as f64;
        let (slow, slow_weight) = (blur(amount, slow_sigma), blur(weight, slow_sigma));
        let held = weight.map(|w| if *w >= LEAST_KNOWN { 1.0 } else { 0.0 });
        let (width, height) = (amount.width(), amount.height());
        let amount = Grid::from_fn(width, height, |x, y| {
            held.at(x, y) * amount.at(x, y) / weight.at(x, y).max(1e-6)
        });
        let value = Grid::from_fn(width, height, |x, y| {
            let mean = slow.at(x, y) / slow_weight.at(x, y).max(1e-6);
            amount.at(x, y) - held.at(x, y) * mean
        });
        Self {
            value,
            amount,
            weight: held,
            work_from_image,
        }
    }

    /// This layer and a share (0..=1) of another of the same place and size.
    pub(in crate::stages) fn mixed(&self, other: &Self, share: f64) -> Self {
        let share = share as f32;
        let mix = |a: &Grid<f32>, b: &Grid<f32>| {
            let mut mixed = a.clone();
            for (value, other) in mixed.data_mut().iter_mut().zip(b.data()) {
                *value += share * (other - *value);
            }
            mixed
        };
        Self {
            value: mix(&self.value, &other.value),
            amount: mix(&self.amount, &other.amount),
            weight: self.weight.clone(),
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
pub(super) fn sample(values: &Grid<f32>, [x, y]: [f64; 2]) -> f32 {
    let (x0, y0) = (x.floor(), y.floor());
    let (column, row) = (x0 as i64, y0 as i64);
    let (width, height) = (values.width(), values.height());
    if column < 0 || row < 0 || column + 1 >= width as i64 || row + 1 >= height as i64 {
        return 0.0;
    }
    let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
    let from = row as usize * width + column as usize;
    let near = &values.data()[from..from + width + 2];
    let a = near[0] + (near[1] - near[0]) * fx;
    let b = near[width] + (near[width + 1] - near[width]) * fx;
    a + (b - a) * fy
}
