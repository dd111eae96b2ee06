//! What the samples of a TIFF page mean.

use super::tag_numbers::{number, refuse, values};
use crate::raster::decode::error::DecodeError;
use crate::raster::decode::tags::TagDirectory;

const PHOTOMETRIC: u64 = 262;
const COLOR_MAP: u64 = 320;
const EXTRA_SAMPLES: u64 = 338;
const YCBCR_COEFFICIENTS: u64 = 529;
const YCBCR_SUBSAMPLING: u64 = 530;
const REFERENCE_BLACK_WHITE: u64 = 532;

/// What the colour samples of a pixel are.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Photometric {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    /// All reds, then greens, then blues.
    Palette(Vec<u16>),
    Cmyk,
    YCbCr(YCbCrCode),
}

/// How luma and chroma stand for a colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct YCbCrCode {
    /// Weights of red, green and blue in the luma.
    pub(super) weights: [f64; 3],
    /// Samples of black and white in the luma, and of no colour and most colour in both chromas.
    pub(super) range: [f64; 6],
    /// Columns and rows that share a chroma sample.
    pub(super) shared: [usize; 2],
}

impl Photometric {
    /// Returns the number of samples of a colour.
    pub(super) const fn samples(&self) -> usize {
        match self {
            Self::WhiteIsZero | Self::BlackIsZero | Self::Palette(_) => 1,
            Self::Rgb | Self::YCbCr(_) => 3,
            Self::Cmyk => 4,
        }
    }

    /// Reads what the samples of a page are. Returns an error if that is not read, or if it has too few samples.
    pub(super) fn read(
        page: &TagDirectory<'_>,
        is_fax: bool,
        samples: usize,
    ) -> Result<Self, DecodeError> {
        // Fax programs leave the tag out.
        let value = match page.has(PHOTOMETRIC) {
            false if is_fax => 0,
            false => return refuse("it does not say how its samples are colours (tag 262)"),
            true => number(page, PHOTOMETRIC, 0)?,
        };
        let found = match value {
            0 => Photometric::WhiteIsZero,
            1 => Photometric::BlackIsZero,
            2 => Photometric::Rgb,
            3 => Photometric::Palette(palette(page)?),
            5 => Photometric::Cmyk,
            6 => Photometric::YCbCr(ycbcr_code(page)?),
            8..=10 => return refuse("its colours are L*a*b*; save it as RGB or grey"),
            32803 | 34892 => {
                return refuse(
                    "it is the raw image of a camera; develop it and save it as TIFF, PNG or JPEG",
                );
            }
            other => {
                return refuse(&format!(
                    "its colours are of the kind {other} (tag 262); save it as RGB or grey"
                ));
            }
        };
        if samples < found.samples() {
            let wanted = found.samples();
            return refuse(&format!(
                "it has {samples} samples per pixel; its colours need {wanted}"
            ));
        }
        Ok(found)
    }
}

/// Returns the palette. Some programs write colours of 8 bits without widening them to the 16 bits of the tag.
fn palette(page: &TagDirectory<'_>) -> Result<Vec<u16>, DecodeError> {
    let colours = values(page, COLOR_MAP)?;
    let colours: Option<Vec<u16>> = colours.and_then(|colours| {
        let colours = colours.iter().take(3 << 16);
        colours.map(|colour| u16::try_from(colour?).ok()).collect()
    });
    let Some(mut colours) = colours else {
        return refuse("its palette cannot be read");
    };
    if colours.iter().all(|colour| u8::try_from(*colour).is_ok()) {
        for colour in &mut colours {
            *colour *= 257;
        }
    }
    Ok(colours)
}

fn ycbcr_code(page: &TagDirectory<'_>) -> Result<YCbCrCode, DecodeError> {
    let mut code = YCbCrCode {
        weights: [0.299, 0.587, 0.114],
        range: [0.0, 255.0, 128.0, 255.0, 128.0, 255.0],
        shared: [2, 2],
    };
    let ratios = |tag, target: &mut [f64]| {
        let Some(values) = values(page, tag)? else {
            return Ok(());
        };
        for (at, target) in target.iter_mut().enumerate() {
            let Some(value) = values.ratio(at) else {
                return refuse(&format!("the values of its tag {tag} cannot be read"));
            };
            *target = value;
        }
        Ok(())
    };
    ratios(YCBCR_COEFFICIENTS, &mut code.weights)?;
    ratios(REFERENCE_BLACK_WHITE, &mut code.range)?;
    if let Some(shared) = values(page, YCBCR_SUBSAMPLING)? {
        let shared = [shared.get(0), shared.get(1)];
        let [Some(across @ (1 | 2 | 4)), Some(down @ (1 | 2 | 4))] = shared else {
            return refuse("its chroma samples are shared by other than 1, 2 or 4 pixels");
        };
        code.shared = [across as usize, down as usize];
    }
    let [_, green, _] = code.weights;
    let [black, white, none, most, ..] = code.range;
    if green == 0.0 || black == white || none == most || code.range[4] == code.range[5] {
        return refuse("its tags 529 and 532 do not define colours");
    }
    Ok(code)
}

/// Where the transparency of a pixel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AlphaSample {
    pub(super) index: usize,
    pub(super) is_premultiplied: bool,
}

impl AlphaSample {
    /// Finds the first sample of a page that is a transparency.
    pub(super) fn find(
        page: &TagDirectory<'_>,
        photometric: &Photometric,
        samples: usize,
    ) -> Result<Option<Self>, DecodeError> {
        const PREMULTIPLIED: u64 = 1;
        const UNASSOCIATED: u64 = 2;
        let colours = photometric.samples();
        let Some(kinds) = values(page, EXTRA_SAMPLES)? else {
            // Many programs do not say what the fourth sample of RGB is.
            let is_alpha = *photometric == Photometric::Rgb && samples == 4;
            return Ok(is_alpha.then_some(AlphaSample {
                index: 3,
                is_premultiplied: false,
            }));
        };
        let kinds = kinds.iter().take(samples - colours).enumerate();
        let mut alphas = kinds.filter_map(|(at, kind)| {
            let is_alpha = matches!(kind, Some(PREMULTIPLIED | UNASSOCIATED));
            is_alpha.then_some(AlphaSample {
                index: colours + at,
                is_premultiplied: kind == Some(PREMULTIPLIED),
            })
        });
        Ok(alphas.next())
    }
}
