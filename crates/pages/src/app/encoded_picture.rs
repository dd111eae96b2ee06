//! Size and encoding of the pictures of a pair, and of files before an import.

use mocban_core::raster::{Grid, jpeg_rgb8};

/// Longer side of a picture on the page of a pair, pixels.
pub(super) const PICTURE_SIDE: usize = 640;
/// Content type of pictures without masks.
pub(super) const JPEG: &str = "image/jpeg";
/// JPEG quality of pictures.
const QUALITY: u8 = 85;

/// An encoded picture with its content type.
pub(super) type Encoded = (&'static str, Vec<u8>);

/// Encodes a picture as JPEG.
pub(super) fn jpeg(picture: &Grid<[u8; 3]>) -> Encoded {
    (JPEG, jpeg_rgb8(picture, QUALITY))
}
