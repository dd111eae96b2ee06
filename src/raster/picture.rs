//! A print image as decoded: colour, 16 bits a channel, transparency laid on white.

use super::Grid;

/// Red, green and blue of 0..=65535 each. 8-bit sources are widened by 257, so white is 65535 in both.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintImage {
    /// Colours by pixel; a transparent pixel is white.
    pub rgb: Grid<[u16; 3]>,
}
