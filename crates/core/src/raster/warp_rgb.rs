//! Warps a colour image into another frame.

use super::Grid;
use super::supersample::{Supersampler, bilinear_cell, interpolate};
use crate::domain::Affine2;

/// Warps an 8-bit colour image into a frame of `width` x `height` pixels. `to_from` maps source pixels to output pixels.
///
/// Colours between pixels are interpolated linearly; if the map shrinks, an output pixel is the mean of several
/// samples. Outside the source, and if the map has no inverse, the result is white.
///
/// ```
/// use mocban_core::domain::Affine2;
/// use mocban_core::raster::{Grid, warp_rgb};
///
/// let ramp = Grid::from_fn(8, 4, |x, _| [10 * x as u8, 0, 200]);
/// let shifted = warp_rgb(&ramp, &Affine2::scale_shift(1.0, [2.0, 0.0]), 8, 4);
/// assert_eq!(shifted.at(5, 1), [30, 0, 200]);
/// assert_eq!(shifted.at(0, 1), [255; 3]);
/// ```
pub fn warp_rgb(
    image: &Grid<[u8; 3]>,
    to_from: &Affine2,
    width: usize,
    height: usize,
) -> Grid<[u8; 3]> {
    let Some(from_to) = to_from.inverse() else {
        return Grid::new(width, height, [255; 3]);
    };
    let sampler = Supersampler::new(&from_to);
    // Pixels outside a grid count as zero, so darkness is interpolated: white is zero.
    let darkness = image.map(|colour| colour.map(|value| 255 - value));
    let samples = sampler.sample_count() as f64;
    Grid::from_fn(width, height, |x, y| {
        let mut sum = [0.0; 3];
        sampler.for_each_sample(x, y, |place| {
            let (near, within) = bilinear_cell(&darkness, place);
            for (k, total) in sum.iter_mut().enumerate() {
                *total += interpolate(near.map(|colour| f64::from(colour[k])), within);
            }
        });
        sum.map(|total| 255 - (total / samples).round() as u8)
    })
}
