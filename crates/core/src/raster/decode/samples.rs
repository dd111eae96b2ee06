//! Print images from samples in memory.

use super::print_image::{PrintImage, on_white, widen_narrow};
use crate::domain::cancel::poll;
use crate::page_vec::PageVec;
use crate::raster::colours::widen;
use crate::raster::{Colours, Grid};

/// Rows of a print image in memory: each pixel has one sample (grey), two (grey and alpha), three (RGB) or four (RGB and
/// alpha).
#[derive(Debug, Clone, Copy)]
pub enum SampleSlice<'a> {
    /// 8 bits; 255 is white.
    Eight(&'a [u8]),
    /// 16 bits; 65535 is white.
    Sixteen(&'a [u16]),
}

/// A copy of the samples of an image, which becomes an image when it is needed.
#[derive(Debug)]
pub struct PrintSamples {
    size: [usize; 2],
    channels: usize,
    samples: SampleVec,
}

#[derive(Debug)]
enum SampleVec {
    Eight(PageVec<u8>),
    Sixteen(PageVec<u16>),
}

impl PrintSamples {
    /// Copies the samples of an upright image. Returns `None` if the numbers do not fit together, or if there are no pixels.
    ///
    /// ```
    /// use mocban_core::raster::{PrintSamples, SampleSlice};
    ///
    /// let samples = PrintSamples::copied([2, 1], 1, SampleSlice::Eight(&[0, 255])).ok_or("no image")?;
    /// let image = samples.to_image();
    /// assert_eq!(image.rgb.at(1, 0), [65535; 3]);
    /// assert_eq!(image.rgb.to_rgb8().data(), [[0; 3], [255; 3]]);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn copied(size: [usize; 2], channels: usize, samples: SampleSlice<'_>) -> Option<Self> {
        let count = match samples {
            SampleSlice::Eight(samples) => samples.len(),
            SampleSlice::Sixteen(samples) => samples.len(),
        };
        let expected = size[0].checked_mul(size[1])?.checked_mul(channels)?;
        if count != expected || count == 0 || channels > 4 {
            return None;
        }
        let samples = match samples {
            SampleSlice::Eight(samples) => SampleVec::Eight(PageVec::copied(samples)),
            SampleSlice::Sixteen(samples) => SampleVec::Sixteen(PageVec::copied(samples)),
        };
        Some(Self {
            size,
            channels,
            samples,
        })
    }

    /// Returns width and height.
    pub const fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Returns the image, as if the samples were read from a file. Transparent pixels are composited on white.
    pub fn to_image(&self) -> PrintImage {
        let [width, height] = self.size;
        if let SampleVec::Eight(samples) = &self.samples
            && self.channels % 2 == 1
        {
            let colours = Colours::of_samples(self.size, self.channels, samples.to_vec());
            return colours.expect("samples for each pixel").into();
        }
        let mut rgb = Grid::new(width, height, [u16::MAX; 3]);
        match &self.samples {
            SampleVec::Eight(samples) => widen_to(&mut rgb, samples, self.channels, widen),
            SampleVec::Sixteen(samples) => {
                widen_to(&mut rgb, samples, self.channels, |sample| sample);
                if self.channels % 2 == 1 {
                    widen_narrow(&mut rgb, false);
                }
            }
        }
        rgb.into()
    }
}

/// Converts rows of samples to colours.
fn widen_to<T: Copy>(
    rgb: &mut Grid<[u16; 3]>,
    samples: &[T],
    channels: usize,
    wide: impl Fn(T) -> u16 + Copy,
) {
    let width = rgb.width();
    let rows = rgb.data_mut().chunks_exact_mut(width);
    for (colours, row) in rows.zip(samples.chunks_exact(width * channels)) {
        poll();
        let pixels = colours.iter_mut().zip(row.chunks_exact(channels));
        match channels {
            1 => pixels.for_each(|(colour, pixel)| *colour = [wide(pixel[0]); 3]),
            2 => pixels.for_each(|(colour, pixel)| {
                let grey = wide(pixel[0]);
                *colour = on_white([grey, grey, grey, wide(pixel[1])]);
            }),
            3 => pixels.for_each(|(colour, pixel)| *colour = [0, 1, 2].map(|k| wide(pixel[k]))),
            _ => pixels.for_each(|(colour, pixel)| {
                *colour = on_white([0, 1, 2, 3].map(|k| wide(pixel[k])));
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::PrintSamples;
    use super::SampleSlice::{Eight, Sixteen};
    use crate::raster::{Grid, ImageLimits, PrintImage, decode, png_grey16, png_rgb8};

    #[test]
    fn samples_give_the_image_of_their_file() {
        let rgb = Grid::from_fn(5, 3, |x, y| [x as u8, 7 * y as u8, 200]);
        let file = decode(&png_rgb8(&rgb), &ImageLimits::SUGGESTED).expect("decodes");
        let samples = rgb.data().as_flattened();
        let memory = PrintSamples::copied([5, 3], 3, Eight(samples)).expect("samples");
        assert_eq!(memory.to_image(), file);
        assert_eq!(*file.rgb.to_rgb8(), rgb);
        for most in [900, 65_535] {
            let grey = Grid::from_fn(5, 3, |x, y| (most / 20 * (x + y)) as u16);
            let file = decode(&png_grey16(&grey), &ImageLimits::SUGGESTED).expect("decodes");
            let memory = PrintSamples::copied([5, 3], 1, Sixteen(grey.data())).expect("samples");
            assert_eq!((memory.to_image(), memory.size()), (file, [5, 3]), "{most}");
        }
    }

    #[test]
    fn sixteen_bits_convert_back_to_eight() {
        let rgb = Grid::from_fn(256, 1, |x, _| [x as u16 * 257; 3]);
        let image = PrintImage::from(rgb);
        let narrow = image.rgb.to_rgb8();
        assert!((0..256).all(|x| narrow.at(x, 0) == [x as u8; 3]));
    }

    #[test]
    fn transparent_samples_are_white_and_wrong_numbers_give_nothing() {
        let grey = PrintSamples::copied([2, 1], 2, Eight(&[0, 255, 0, 0])).expect("samples");
        assert_eq!(grey.to_image().rgb.to_rgb16().data(), [[0; 3], [65535; 3]]);
        let rgba = PrintSamples::copied([1, 1], 4, Eight(&[9, 9, 9, 0])).expect("samples");
        assert_eq!(rgba.to_image().rgb.to_rgb16().data(), [[65535; 3]]);
        for (size, channels, count) in [
            ([2, 2], 1, 3),
            ([0, 2], 1, 0),
            ([1, 1], 5, 5),
            ([1, 1], 0, 0),
        ] {
            let samples = vec![0; count];
            assert!(PrintSamples::copied(size, channels, Eight(&samples)).is_none());
        }
    }
}
