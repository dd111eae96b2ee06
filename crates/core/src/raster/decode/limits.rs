//! Limits on print images.

use serde::{Deserialize, Serialize};

use super::DecodeError;

/// Limits on print images, checked before anything is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageLimits {
    /// Largest file in bytes. 256 MiB is generous for one character.
    pub max_bytes: u64,
    /// Largest width times height in pixels. 100 million pixels are decoded to 600 MB or, in 8 bits,
    /// to 100 MB (grey) or 300 MB.
    pub max_pixels: u64,
}

impl ImageLimits {
    /// 256 MiB and 30 million pixels.
    pub const SUGGESTED: Self = Self {
        max_bytes: 256 << 20,
        max_pixels: 30_000_000,
    };

    /// Checks the size of a file in bytes.
    ///
    /// # Errors
    /// Returns an error if the file is empty or larger than `max_bytes`.
    pub(super) fn check_bytes(&self, size: u64) -> Result<(), DecodeError> {
        if size == 0 {
            return Err(DecodeError::Empty);
        }
        if size > self.max_bytes {
            return Err(DecodeError::TooManyBytes {
                bytes: size,
                limit: self.max_bytes,
            });
        }
        Ok(())
    }

    /// Checks the size of an image in pixels.
    ///
    /// # Errors
    /// Returns an error if a side is zero, or if the image has more than `max_pixels` pixels.
    pub(super) fn check_size(&self, width: u32, height: u32) -> Result<(), DecodeError> {
        if width == 0 || height == 0 {
            return Err(DecodeError::NoPixels { width, height });
        }
        if u64::from(width) * u64::from(height) > self.max_pixels {
            return Err(DecodeError::TooManyPixels {
                width,
                height,
                limit: self.max_pixels,
            });
        }
        Ok(())
    }

    /// Returns the memory in bytes that a decoder may allocate: 64 MiB for its tables, and 16 bytes for each pixel, the
    /// size of the largest pixels that it returns.
    pub(super) fn max_decoder_bytes(&self) -> u64 {
        self.max_pixels.saturating_mul(16).saturating_add(64 << 20)
    }
}
