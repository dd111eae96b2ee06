//! Print images from samples in memory, and back to 8 bits.

use super::print_image::{PrintImage, on_white, widen, widen_narrow};
use crate::domain::cancel::poll;
use crate::raster::Grid;

/// Rows of a print image in memory: each pixel has one sample (grey), two (grey and alpha), three (RGB) or four (RGB and
/// alpha).
#[derive(Debug, Clone, Copy)]
pub enum SampleSlice<'a> {
    /// 8 bits; 255 is white.
    Eight(&'a [u8]),
    /// 16 bits; 65535 is white.
    Sixteen(&'a [u16]),
}

impl PrintImage {
    /// Creates an upright image from samples, as if they were read from a file. Transparent pixels are composited on white.
    /// Returns `None` if the numbers do not fit together, or if there are no pixels.
    ///
    /// ```
    /// use mocban_core::raster::{PrintImage, SampleSlice};
    ///
    /// let image = PrintImage::from_samples([2, 1], 1, SampleSlice::Eight(&[0, 255])).ok_or("no image")?;
    /// assert_eq!(image.rgb.at(1, 0), [65535; 3]);
    /// assert_eq!(image.to_rgb8(), [0, 0, 0, 255, 255, 255]);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn from_samples(
        [width, height]: [usize; 2],
        channels: usize,
        samples: SampleSlice<'_>,
    ) -> Option<Self> {
        let count = match samples {
            SampleSlice::Eight(samples) => samples.len(),
            SampleSlice::Sixteen(samples) => samples.len(),
        };
        let expected = width.checked_mul(height)?.checked_mul(channels)?;
        if count != expected || count == 0 || channels > 4 {
            return None;
        }
        let colours = match samples {
            SampleSlice::Eight(samples) => colours(samples, width, channels, widen),
            SampleSlice::Sixteen(samples) => colours(samples, width, channels, |sample| sample),
        };
        let mut rgb = Grid::from_vec(width, height, colours)?;
        if matches!(samples, SampleSlice::Sixteen(_)) && channels % 2 == 1 {
            widen_narrow(&mut rgb);
        }
        Some(rgb.into())
    }

    /// Returns the colours rounded to 8 bits, three for each pixel.
    pub fn to_rgb8(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(3 * self.rgb.data().len());
        for row in self.rgb.data().chunks(self.rgb.width().max(1)) {
            poll();
            let narrow = |wide: &u16| ((u32::from(*wide) + 128) / 257) as u8;
            bytes.extend(row.as_flattened().iter().map(narrow));
        }
        bytes
    }
}

fn colours<T: Copy>(
    samples: &[T],
    width: usize,
    channels: usize,
    wide: impl Fn(T) -> u16 + Copy,
) -> Vec<[u16; 3]> {
    let mut colours = Vec::with_capacity(samples.len() / channels);
    for row in samples.chunks_exact(width * channels) {
        poll();
        match channels {
            1 => colours.extend(row.iter().map(|grey| [wide(*grey); 3])),
            2 => colours.extend(row.as_chunks::<2>().0.iter().map(|pixel| {
                let [grey, alpha] = pixel.map(wide);
                on_white([grey, grey, grey, alpha])
            })),
            3 => colours.extend(row.as_chunks::<3>().0.iter().map(|pixel| pixel.map(wide))),
            _ => colours.extend(
                row.as_chunks::<4>()
                    .0
                    .iter()
                    .map(|pixel| on_white(pixel.map(wide))),
            ),
        }
    }
    colours
}

#[cfg(test)]
mod tests {
    use super::SampleSlice::{Eight, Sixteen};
    use crate::raster::{Grid, ImageLimits, PrintImage, decode, png_grey16, png_rgb8};

    #[test]
    fn samples_give_the_image_of_their_file() {
        let rgb = Grid::from_fn(5, 3, |x, y| [x as u8, 7 * y as u8, 200]);
        let file = decode(&png_rgb8(&rgb), &ImageLimits::SUGGESTED).expect("decodes");
        let samples = rgb.data().as_flattened();
        let memory = PrintImage::from_samples([5, 3], 3, Eight(samples)).expect("an image");
        assert_eq!(memory, file);
        assert_eq!(memory.to_rgb8(), samples);
        for most in [900, 65_535] {
            let grey = Grid::from_fn(5, 3, |x, y| (most / 20 * (x + y)) as u16);
            let file = decode(&png_grey16(&grey), &ImageLimits::SUGGESTED).expect("decodes");
            let memory = PrintImage::from_samples([5, 3], 1, Sixteen(grey.data()));
            assert_eq!(memory.expect("an image"), file, "{most}");
        }
    }

    #[test]
    fn transparent_samples_are_white_and_wrong_numbers_give_nothing() {
        let grey = PrintImage::from_samples([2, 1], 2, Eight(&[0, 255, 0, 0])).expect("an image");
        assert_eq!(grey.rgb.data(), [[0; 3], [65535; 3]]);
        let rgba = PrintImage::from_samples([1, 1], 4, Eight(&[9, 9, 9, 0])).expect("an image");
        assert_eq!(rgba.rgb.data(), [[65535; 3]]);
        for (size, channels, count) in [
            ([2, 2], 1, 3),
            ([0, 2], 1, 0),
            ([1, 1], 5, 5),
            ([1, 1], 0, 0),
        ] {
            let samples = vec![0; count];
            assert!(PrintImage::from_samples(size, channels, Eight(&samples)).is_none());
        }
    }
}
