//! The TIFF tags in which `ImageJ` keeps calibration, display ranges and labels.

use std::fmt::Write as _;

use tiff::encoder::Rational;

/// Version that the description names. `ImageJ` reads the fields of all versions since 1.47.
const VERSION: &str = "1.53t";
/// First bytes of the metadata and the types of its entries.
const MAGIC: u32 = u32::from_be_bytes(*b"IJIJ");
const LABELS: u32 = u32::from_be_bytes(*b"labl");
const RANGES: u32 = u32::from_be_bytes(*b"rang");

/// Size of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PixelSize {
    /// Pixels per unit of length.
    pub(super) px_per_unit: f64,
    /// Name of the unit.
    pub(super) unit: &'static str,
}

impl PixelSize {
    /// Returns the pixels per unit as a fraction with a power of ten as denominator, at most 10^9.
    pub(super) fn resolution(&self) -> Rational {
        let scaled = |d: u32| (self.px_per_unit * f64::from(d)).round();
        let denominators = (0..=9).rev().map(|power| 10_u32.pow(power));
        let fits = |d: &u32| scaled(*d) <= f64::from(u32::MAX);
        let d = denominators.into_iter().find(fits).unwrap_or(1);
        Rational {
            n: (scaled(d) as u32).max(1),
            d,
        }
    }
}

/// What `ImageJ` shows of an image of a stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ImageDisplay {
    /// Title of the image in its stack.
    pub(super) label: &'static str,
    /// Values that are shown black and white.
    pub(super) range: [f64; 2],
}

/// Returns the text of the tag `ImageDescription` for images that are the channels of a stack.
pub(super) fn description(size: &PixelSize, channels: &[ImageDisplay]) -> String {
    let mut text = format!("ImageJ={VERSION}\n");
    let mut line = |field: &str, value: &dyn std::fmt::Display| {
        writeln!(text, "{field}={value}").expect("a String takes any text");
    };
    if channels.len() > 1 {
        line("images", &channels.len());
        line("channels", &channels.len());
        line("hyperstack", &true);
        line("mode", &"grayscale");
    }
    line("unit", &size.unit);
    if let Some(first) = channels.first() {
        line("min", &first.range[0]);
        line("max", &first.range[1]);
    }
    text
}

/// Returns the lengths and the content of `ImageJ`'s metadata: the labels and display ranges of the channels, in the
/// byte order of this machine, like the rest of the file.
pub(super) fn metadata(channels: &[ImageDisplay]) -> (Vec<u32>, Vec<u8>) {
    let count = channels.len() as u32;
    let header = [MAGIC, LABELS, count, RANGES, 1];
    let mut bytes: Vec<u8> = header.iter().flat_map(|word| word.to_ne_bytes()).collect();
    let mut lengths = vec![bytes.len() as u32];
    let mut add = |part: Vec<u8>| {
        lengths.push(part.len() as u32);
        bytes.extend(part);
    };
    for channel in channels {
        let units = channel.label.encode_utf16();
        add(units.flat_map(u16::to_ne_bytes).collect());
    }
    let ranges = channels.iter().flat_map(|channel| channel.range);
    add(ranges.flat_map(f64::to_ne_bytes).collect());
    (lengths, bytes)
}

#[cfg(test)]
mod tests {
    use super::{ImageDisplay, PixelSize, description, metadata};

    const PRINT: ImageDisplay = ImageDisplay {
        label: "print",
        range: [0.0, 255.0],
    };
    const HEIGHT: ImageDisplay = ImageDisplay {
        label: "height",
        range: [-1.5, 0.25],
    };

    fn size(px_per_unit: f64) -> PixelSize {
        PixelSize {
            px_per_unit,
            unit: "mm",
        }
    }

    #[test]
    fn resolution_is_exact_to_nine_digits_where_it_fits() {
        for (px_per_unit, n, d) in [
            (23.456_789_012, 2_345_678_901, 100_000_000),
            (0.000_123, 123_000, 1_000_000_000),
            (5e9, u32::MAX, 1),
            (1e-30, 1, 1_000_000_000),
        ] {
            let found = size(px_per_unit).resolution();
            assert_eq!((found.n, found.d), (n, d), "{px_per_unit}");
        }
    }

    #[test]
    fn description_of_one_image_and_of_a_stack() {
        assert_eq!(
            description(&size(1.0), &[HEIGHT]),
            "ImageJ=1.53t\nunit=mm\nmin=-1.5\nmax=0.25\n"
        );
        assert_eq!(
            description(&size(1.0), &[PRINT, HEIGHT]),
            "ImageJ=1.53t\nimages=2\nchannels=2\nhyperstack=true\nmode=grayscale\nunit=mm\nmin=0\nmax=255\n"
        );
    }

    #[test]
    fn metadata_holds_labels_and_ranges() {
        let (lengths, bytes) = metadata(&[PRINT, HEIGHT]);
        assert_eq!(lengths, [20, 10, 12, 32]);
        assert_eq!(bytes.len(), 20 + 10 + 12 + 32);
        assert_eq!(bytes[20..22], u16::from(b'p').to_ne_bytes());
        assert_eq!(bytes[bytes.len() - 8..], 0.25_f64.to_ne_bytes());
    }
}
