//! How much a print image may hold before it is refused.

use serde::{Deserialize, Serialize};

/// Limits on print images, checked before anything is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageLimits {
    /// Largest file in bytes; 256 MiB is generous for one character.
    pub max_bytes: u64,
    /// Largest width times height in pixels; 100 million decode to 600 MB.
    pub max_pixels: u64,
}

impl ImageLimits {
    /// 256 MiB and 100 million pixels.
    pub const SUGGESTED: Self = Self {
        max_bytes: 256 << 20,
        max_pixels: 30_000_000,
    };
}
