//! A picture brought to working size, its slow variation taken out.

use crate::domain::Affine2;
use crate::raster::{Grid, Mask, PixelBox, warp_values};
use crate::stages::blur::blur;

/// How much of something each pixel holds, 0..=1, and where that is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct Soft {
    /// Ink of a print, or nearness to the tops of a relief.
    pub(in crate::stages) amount: Grid<f32>,
    /// Where the picture holds data.
    pub(in crate::stages) known: Mask,
}

/// A soft picture at working size: mean near zero everywhere, zero where nothing is known.
#[derive(Debug, Clone)]
pub(in crate::stages) struct Layer {
    pub(super) value: Grid<f32>,
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

impl Layer {
    /// Brings a picture to `size` pixels along the longest side of what it knows, smoothed by `sigma` pixels.
    ///
    /// `None` when nothing is known.
    pub(in crate::stages) fn new(soft: &Soft, size: usize, sigma: f64) -> Option<Self> {
        let bounds = soft.bounds()?;
        let longest = bounds.width().max(bounds.height()) as f64;
        let scale = size as f64 / longest;
        let centre = [
            (bounds.x0 + bounds.x1) as f64 / 2.0,
            (bounds.y0 + bounds.y1) as f64 / 2.0,
        ];
        let half = [
            (bounds.width() as f64 * scale / 2.0).ceil() + 1.0,
            (bounds.height() as f64 * scale / 2.0).ceil() + 1.0,
        ];
        let work_from_image = Affine2::scale_shift(
            scale,
            [half[0] - scale * centre[0], half[1] - scale * centre[1]],
        );
        let (width, height) = (2 * half[0] as usize + 1, 2 * half[1] as usize + 1);
        let known = soft.known.map(|k| f32::from(u8::from(*k)));
        let present = Grid::from_fn(known.width(), known.height(), |x, y| {
            soft.amount.at(x, y) * known.at(x, y)
        });
        let amount = blur(
            &warp_values(&present, &work_from_image, width, height),
            sigma,
        );
        let weight = blur(&warp_values(&known, &work_from_image, width, height), sigma);
        Some(Self::without_slow(&amount, &weight, size, work_from_image))
    }

    fn without_slow(
        amount: &Grid<f32>,
        weight: &Grid<f32>,
        size: usize,
        work_from_image: Affine2,
    ) -> Self {
        let slow_sigma = SLOW * size as f64;
        let (slow, slow_weight) = (blur(amount, slow_sigma), blur(weight, slow_sigma));
        let held = weight.map(|w| if *w >= LEAST_KNOWN { 1.0 } else { 0.0 });
        let value = Grid::from_fn(amount.width(), amount.height(), |x, y| {
            let mean = slow.at(x, y) / slow_weight.at(x, y).max(1e-6);
            held.at(x, y) * (amount.at(x, y) / weight.at(x, y).max(1e-6) - mean)
        });
        Self {
            value,
            weight: held,
            work_from_image,
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
        self.value
            .data()
            .iter()
            .map(|v| f64::from(*v).powi(2))
            .sum()
    }
}

/// Bilinear value; zero outside.
#[inline]
pub(super) fn sample(values: &Grid<f32>, [x, y]: [f64; 2]) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    let (column, row) = (x0 as i64, y0 as i64);
    if column < 0
        || row < 0
        || column + 1 >= values.width() as i64
        || row + 1 >= values.height() as i64
    {
        return 0.0;
    }
    let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
    let (column, row) = (column as usize, row as usize);
    let (top, bottom) = (values.row(row), values.row(row + 1));
    let a = top[column] * (1.0 - fx) + top[column + 1] * fx;
    let b = bottom[column] * (1.0 - fx) + bottom[column + 1] * fx;
    f64::from(a * (1.0 - fy) + b * fy)
}
