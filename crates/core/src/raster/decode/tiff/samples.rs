//! Reads the samples of TIFF rows as numbers.

use super::chunks::DecodedChunk;
use super::layout::TiffLayout;
use super::photometric::Photometric;
use crate::raster::colours::widen;

impl TiffLayout<'_> {
    /// Returns the samples of a pixel, 1 or 3, if all are 8-bit grey or RGB without other samples.
    pub(super) fn plain_channels(&self) -> Option<usize> {
        let is_plain = match self.photometric {
            Photometric::WhiteIsZero | Photometric::BlackIsZero => self.samples == 1,
            Photometric::Rgb => self.samples == 3,
            _ => false,
        };
        let are_bytes = self.planes == 1 && self.bits == 8 && self.used_bits == 8;
        (is_plain && are_bytes && !self.is_float).then_some(self.samples)
    }

    /// Returns the bytes of a row of an image with [`Self::plain_channels`].
    pub(super) fn plain_bytes<'c>(&self, chunk: &'c DecodedChunk<'_>, y: usize) -> &'c [u8] {
        self.row(chunk, 0, y)
    }

    /// Returns the bytes of a row in one plane.
    fn row<'c>(&self, chunk: &'c DecodedChunk<'_>, plane: usize, y: usize) -> &'c [u8] {
        let row_bytes = self.row_bytes();
        &chunk.planes[plane][y * row_bytes..][..row_bytes]
    }

    /// Reads the samples of a row, pixel by pixel, as levels up to 65535 for `full`. `samples` is a buffer.
    pub(super) fn read_levels(
        &self,
        chunk: &DecodedChunk<'_>,
        y: usize,
        full: f64,
        samples: &mut Vec<f64>,
        levels: &mut Vec<u16>,
    ) {
        levels.clear();
        if self.bits == 8 && self.planes == 1 {
            levels.extend(self.row(chunk, 0, y).iter().map(|byte| widen(*byte)));
        } else if self.used_bits == 1 && self.planes == 1 {
            for byte in self.row(chunk, 0, y) {
                let bits = [7, 6, 5, 4, 3, 2, 1, 0].map(|bit| byte >> bit & 1);
                levels.extend(bits.map(|bit| u16::from(bit) * u16::MAX));
            }
        } else {
            self.read_row(chunk, y, samples);
            let scale = f64::from(u16::MAX) / full;
            levels.extend(samples.iter().map(|sample| (sample * scale).round() as u16));
        }
    }

    /// Reads the samples of a row, pixel by pixel.
    pub(super) fn read_row(&self, chunk: &DecodedChunk<'_>, y: usize, samples: &mut Vec<f64>) {
        samples.resize(chunk.width * self.samples * self.planes, 0.0);
        for plane in 0..self.planes {
            let targets = samples[plane..].iter_mut().step_by(self.planes);
            let bytes = self.row(chunk, plane, y);
            match (self.is_float, self.bits) {
                (false, 8) => self.numbers(bytes, targets, |[byte]| f64::from(byte)),
                (false, 16) => self.numbers(bytes, targets, |b| f64::from(u16::from_le_bytes(b))),
                (false, 24) => self.numbers(bytes, targets, |[low, middle, high]| {
                    f64::from(u32::from_le_bytes([low, middle, high, 0]))
                }),
                (false, 32) => self.numbers(bytes, targets, |b| f64::from(u32::from_le_bytes(b))),
                (false, 64) => self.numbers(bytes, targets, |b| u64::from_le_bytes(b) as f64),
                (false, bits) => {
                    for (at, target) in targets.enumerate() {
                        *target = f64::from(bits_at(bytes, at * bits, bits));
                    }
                }
                (true, 16) => self.numbers(bytes, targets, |b| half_float(u16::from_le_bytes(b))),
                (true, 32) => self.numbers(bytes, targets, |b| f64::from(f32::from_le_bytes(b))),
                (true, _) => self.numbers(bytes, targets, f64::from_le_bytes),
            }
        }
    }

    /// Reads numbers of `N` bytes. `number` takes the least significant byte first.
    fn numbers<'t, const N: usize>(
        &self,
        bytes: &[u8],
        targets: impl Iterator<Item = &'t mut f64>,
        number: impl Fn([u8; N]) -> f64,
    ) {
        for (bytes, target) in bytes.as_chunks::<N>().0.iter().zip(targets) {
            let mut bytes = *bytes;
            if self.is_big_endian {
                bytes.reverse();
            }
            *target = number(bytes);
        }
    }
}

/// Returns a number of at most 32 bits, most significant bit first.
fn bits_at(bytes: &[u8], from: usize, count: usize) -> u32 {
    let end = from + count;
    let whole = bytes[from / 8..end.div_ceil(8)].iter();
    let number = whole.fold(0, |sum: u64, byte| sum << 8 | u64::from(*byte));
    let number = number >> (end.div_ceil(8) * 8 - end);
    (number & ((1 << count) - 1)) as u32
}

/// Returns the value of a float of 16 bits, IEEE 754.
fn half_float(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let fraction = f64::from(bits & 0x3ff);
    sign * match bits >> 10 & 0x1f {
        0 => fraction * 2_f64.powi(-24),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        exponent => (1024.0 + fraction) * 2_f64.powi(i32::from(exponent) - 25),
    }
}

#[cfg(test)]
mod tests {
    use super::{bits_at, half_float};

    #[test]
    fn bits_are_read_across_bytes() {
        let bytes = [0b1010_0101, 0b1100_0011, 0xff, 0, 0x80];
        assert_eq!(bits_at(&bytes, 0, 12), 0b1010_0101_1100);
        assert_eq!(bits_at(&bytes, 12, 12), 0b0011_1111_1111);
        assert_eq!(bits_at(&bytes, 7, 3), 0b111);
        assert_eq!(bits_at(&bytes, 7, 31), 0x70ff_c020);
    }

    #[test]
    fn half_floats_have_their_values() {
        for (bits, value) in [
            (0, 0.0),
            (1, 2_f64.powi(-24)),
            (0x3c00, 1.0),
            (0x3800, 0.5),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x7c00, f64::INFINITY),
        ] {
            assert_eq!(half_float(bits), value, "{bits:#x}");
        }
        assert!(half_float(0x7e00).is_nan());
    }
}
