//! Decodes JPEG images: baseline and progressive, of 8 bits.

mod interleaved;
mod planes;
mod polled_bytes;
mod segments;
#[cfg(test)]
mod tests;

use image::metadata::Orientation;

use super::colour_profile::FileProfile;
use super::error::{DecodeError, broken};
use super::limits::ImageLimits;
use crate::domain::FileKind;
use crate::domain::cancel::run_aside;
use crate::raster::Colours;
use interleaved::{JpegColours, JpegSamples, interleaved};
use segments::{JpegFrame, JpegMetadata, JpegSegments};

/// A decoded JPEG, as stored.
pub(super) struct JpegImage {
    pub(super) rgb: Colours,
    pub(super) orientation: Orientation,
    pub(super) profile: Option<FileProfile>,
}

const CMYK_COMPONENTS: usize = 4;

/// Decodes a print.
///
/// # Errors
/// Returns an error if the image is too large, truncated, damaged, or coded in a way that is not read.
pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<JpegImage, DecodeError> {
    let segments = JpegSegments::read(bytes)?;
    let frame = frame_of(&segments)?;
    limits.check_size(frame.width as u32, frame.height as u32)?;
    let image = samples(bytes, &segments, JpegColours::Usual)?;
    Ok(JpegImage {
        rgb: Colours::of_samples([image.width, image.height], image.channels, image.samples)
            .ok_or_else(|| broken(FileKind::Jpeg, "the decoder returned too few samples"))?,
        orientation: segments.metadata.orientation.orientation(),
        profile: segments.profile().map(|bytes| FileProfile {
            bytes,
            is_of_inks: frame.components.len() >= CMYK_COMPONENTS,
        }),
    })
}

/// Returns what the segments say about the image; nothing if they cannot be read.
pub(super) fn metadata(bytes: &[u8]) -> JpegMetadata<'_> {
    let segments = JpegSegments::read(bytes);
    segments.map(|found| found.metadata).unwrap_or_default()
}

/// Decodes a part of a TIFF image. Luma and chroma samples are not converted.
///
/// # Errors
/// Returns an error if the image is larger than `largest`, truncated, damaged, or coded in a way that is not read.
pub(super) fn decode_samples(
    bytes: &[u8],
    largest: [usize; 2],
) -> Result<JpegSamples, DecodeError> {
    let segments = JpegSegments::read(bytes)?;
    let frame = frame_of(&segments)?;
    if frame.width > largest[0] || frame.height > largest[1] {
        let (width, height) = (frame.width, frame.height);
        let reason = format!("it is {width} x {height} pixels, more than its place");
        return Err(broken(FileKind::Jpeg, &reason));
    }
    samples(bytes, &segments, JpegColours::Stored)
}

fn frame_of<'s>(segments: &'s JpegSegments<'_>) -> Result<&'s JpegFrame, DecodeError> {
    segments.frame.as_ref().ok_or_else(|| {
        if segments.is_ended {
            broken(FileKind::Jpeg, "it has no image")
        } else {
            DecodeError::Truncated(FileKind::Jpeg)
        }
    })
}

fn samples(
    bytes: &[u8],
    segments: &JpegSegments<'_>,
    colours: JpegColours,
) -> Result<JpegSamples, DecodeError> {
    if segments.is_ended {
        return samples_of_ended(bytes, segments, colours);
    }
    let truncated = DecodeError::Truncated(FileKind::Jpeg);
    if !segments.has_all_scans() {
        return Err(truncated);
    }
    // The decoder fills what is missing. If bytes are missing, what it finds depends on the bytes that follow.
    let bytes = bytes.strip_suffix(&[0xff]).unwrap_or(bytes);
    let followed_by = |more: &[u8]| {
        let bytes = [bytes, more, &[0xff, 0xd9]].concat();
        let segments = JpegSegments::read(&bytes)?;
        samples_of_ended(&bytes, &segments, colours)
    };
    let image = followed_by(&[])?;
    let noise: [u8; 64] = std::array::from_fn(|at| (at * 151 % 239) as u8);
    for noise in [noise, noise.map(|byte| 0xfe - byte)] {
        if followed_by(&noise).ok().as_ref() != Some(&image) {
            return Err(truncated);
        }
    }
    Ok(image)
}

/// Decodes an image that ends with the end marker.
fn samples_of_ended(
    bytes: &[u8],
    segments: &JpegSegments<'_>,
    colours: JpegColours,
) -> Result<JpegSamples, DecodeError> {
    let frame = frame_of(segments)?;
    if planes::has_planes(frame, segments)? {
        return planes::decode(bytes, frame, segments, colours);
    }
    if !frame.is_progressive {
        return interleaved(bytes, colours);
    }
    // After the last scan of a progressive image, the decoder computes all pixels without reading on. Measured: 6 ns per
    // pixel, so 0.2 s for the default of `limits.image.max_pixels`.
    let owned = bytes.to_vec();
    run_aside(move || interleaved(&owned, colours)).unwrap_or_else(|| interleaved(bytes, colours))
}
