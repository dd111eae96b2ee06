//! Makes the prints of pairs smaller, for `--print-px`.

use mocban::domain::Affine2;
use mocban::raster::{self, Grid, ImageLimits, PrintImage, resample};

/// A smaller print.
pub(super) struct SmallPrint {
    /// The image file, a PNG.
    pub(super) file: Vec<u8>,
    /// Maps its pixels to pixels of the print that it was made from.
    pub(super) full_from_small: Affine2,
}

/// Shrinks a print to `longest_px` along its longest side: each pixel is the mean of the area that it covers. Returns
/// `None` if the print is not larger.
pub(super) fn shrink(print: &[u8], longest_px: u32) -> anyhow::Result<Option<SmallPrint>> {
    let PrintImage { rgb, .. } = raster::decode(print, &ImageLimits::SUGGESTED)?;
    let sides = [rgb.width(), rgb.height()];
    let scale = f64::from(longest_px) / sides[0].max(sides[1]) as f64;
    if scale >= 1.0 {
        return Ok(None);
    }
    // Pixels that the print covers only in part are left out.
    let to = sides.map(|side| ((side as f64 * scale + 1e-6) as usize).max(1));
    let shift = [(scale - 1.0) / 2.0; 2];
    let channels = [0, 1, 2].map(|k: usize| {
        let values = rgb.map(|colour| f32::from(colour[k]));
        resample(&values, scale, shift, to)
    });
    let small = Grid::from_fn(to[0], to[1], |x, y| {
        [0, 1, 2].map(|k: usize| (channels[k].at(x, y) / 257.0).round() as u8)
    });
    Ok(Some(SmallPrint {
        file: raster::png_rgb8(&small),
        full_from_small: Affine2::scale_shift(1.0 / scale, [(1.0 / scale - 1.0) / 2.0; 2]),
    }))
}
