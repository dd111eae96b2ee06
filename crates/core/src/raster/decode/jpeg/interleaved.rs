//! Decodes images whose colours are interleaved, and progressive images.

use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZByteIoError;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::polled_bytes::PolledBytes;
use crate::domain::FileKind;
use crate::raster::decode::error::{DecodeError, broken, damaged};

/// Samples of 8 bits, pixel by pixel.
#[derive(Debug, PartialEq)]
pub(in crate::raster::decode) struct JpegSamples {
    pub(in crate::raster::decode) width: usize,
    pub(in crate::raster::decode) height: usize,
    pub(in crate::raster::decode) channels: usize,
    pub(in crate::raster::decode) samples: Vec<u8>,
}

/// What samples stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JpegColours {
    /// Grey or RGB.
    Usual,
    /// As they are stored, such as luma and chroma.
    Stored,
}

/// Decodes an image whose colours are interleaved, or that is progressive. Polls while it reads the bytes.
///
/// # Errors
/// Returns an error if the image is truncated, damaged, or coded in a way that is not read.
pub(super) fn interleaved(bytes: &[u8], colours: JpegColours) -> Result<JpegSamples, DecodeError> {
    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(PolledBytes::new(bytes), options);
    decoder.decode_headers().map_err(|error| refused(&error))?;
    let (Some((width, height)), Some(info)) = (decoder.dimensions(), decoder.info()) else {
        return Err(DecodeError::Truncated(FileKind::Jpeg));
    };
    let stored = decoder.input_colorspace().unwrap_or(ColorSpace::RGB);
    let output = match (colours, info.components) {
        (_, 1) => ColorSpace::Luma,
        // The decoder does not know yet that three colours of Adobe programs are RGB.
        (JpegColours::Stored, 3) if stored == ColorSpace::CMYK => ColorSpace::RGB,
        (JpegColours::Stored, _) => stored,
        (JpegColours::Usual, _) => ColorSpace::RGB,
    };
    decoder.set_options(options.jpeg_set_out_colorspace(output));
    let samples = decoder.decode().map_err(|error| refused(&error))?;
    Ok(JpegSamples {
        width,
        height,
        channels: output.num_components(),
        samples,
    })
}

fn refused(error: &DecodeErrors) -> DecodeError {
    match error {
        DecodeErrors::ExhaustedData | DecodeErrors::IoErrors(ZByteIoError::NotEnoughBytes(..)) => {
            DecodeError::Truncated(FileKind::Jpeg)
        }
        DecodeErrors::Unsupported(_) | DecodeErrors::LargeDimensions(_) => {
            broken(FileKind::Jpeg, &error.to_string())
        }
        other => damaged(FileKind::Jpeg, &other.to_string()),
    }
}
