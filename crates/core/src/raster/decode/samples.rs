//! Print images from samples in memory, and back to 8 bits.

use super::print_image::{PrintImage, on_white, widen, widen_narrow};
use crate::domain::cancel::poll;
use crate::page_vec::PageVec;
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
        size: [usize; 2],
        channels: usize,
        samples: SampleSlice<'_>,
    ) -> Option<Self> {
        Some(CheckedSamples::new(size, channels, samples)?.image())
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

/// Samples whose number fits the size of their image.
struct CheckedSamples<'a> {
    size: [usize; 2],
    channels: usize,
    samples: SampleSlice<'a>,
}

impl<'a> CheckedSamples<'a> {
    fn new(size: [usize; 2], channels: usize, samples: SampleSlice<'a>) -> Option<Self> {
        let count = match samples {
            SampleSlice::Eight(samples) => samples.len(),
            SampleSlice::Sixteen(samples) => samples.len(),
        };
        let expected = size[0].checked_mul(size[1])?.checked_mul(channels)?;
        (count == expected && count > 0 && channels <= 4).then_some(Self {
            size,
            channels,
            samples,
        })
    }

    fn image(&self) -> PrintImage {
        let [width, height] = self.size;
        let mut rgb = Grid::new(width, height, [u16::MAX; 3]);
        match self.samples {
            SampleSlice::Eight(samples) => widen_to(&mut rgb, samples, self.channels, widen),
            SampleSlice::Sixteen(samples) => {
                widen_to(&mut rgb, samples, self.channels, |sample| sample);
                if self.channels % 2 == 1 {
                    widen_narrow(&mut rgb);
                }
            }
        }
        rgb.into()
    }
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
    /// Copies samples. Returns `None` as [`PrintImage::from_samples`] does.
    pub fn copied(size: [usize; 2], channels: usize, samples: SampleSlice<'_>) -> Option<Self> {
        CheckedSamples::new(size, channels, samples)?;
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

    /// Returns the image, as [`PrintImage::from_samples`] does.
    pub fn to_image(&self) -> PrintImage {
        let samples = match &self.samples {
            SampleVec::Eight(samples) => SampleSlice::Eight(samples),
            SampleVec::Sixteen(samples) => SampleSlice::Sixteen(samples),
        };
        let (size, channels) = (self.size, self.channels);
        CheckedSamples {
            size,
            channels,
            samples,
        }
        .image()
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
        let memory = PrintImage::from_samples([5, 3], 3, Eight(samples)).expect("an image");
        assert_eq!(memory, file);
        assert_eq!(memory.to_rgb8(), samples);
        for most in [900, 65_535] {
            let grey = Grid::from_fn(5, 3, |x, y| (most / 20 * (x + y)) as u16);
            let file = decode(&png_grey16(&grey), &ImageLimits::SUGGESTED).expect("decodes");
            let memory = PrintImage::from_samples([5, 3], 1, Sixteen(grey.data()));
            assert_eq!(memory.expect("an image"), file, "{most}");
            let later = PrintSamples::copied([5, 3], 1, Sixteen(grey.data())).expect("samples");
            assert_eq!((later.to_image(), later.size()), (file, [5, 3]), "{most}");
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
            assert!(PrintSamples::copied(size, channels, Eight(&samples)).is_none());
        }
    }
}
