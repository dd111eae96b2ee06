//! Images and masks in memory, their decoders and encoders, and warps. [`Grid`] states the pixel convention.

pub mod blur;
mod colours;
pub mod components;
mod decode;
mod depth_map;
pub mod encode;
pub mod fonts;
mod grid;
mod mask;
mod minmax_pyramid;
pub mod otsu;
mod png_text;
mod resample;
mod resize;
mod supersample;
#[cfg(any(test, feature = "test-helpers"))]
pub mod test_images;
#[cfg(any(test, feature = "test-helpers"))]
pub mod test_profiles;
mod warp_depth;
mod warp_mask;
mod warp_rgb;

pub use colours::Colours;
pub use decode::{
    DecodeError, ImageLimits, PrintImage, PrintSamples, SampleSlice, decode, file_dpi,
    header_pixel_count, header_size, profile_warning, stated_dpi,
};
pub use depth_map::DepthMap;
pub use encode::{
    PngError, compact_rgb8, decode_grey8, decode_grey16, jpeg_rgb8, png_grey8, png_grey16,
    png_mask, png_rgb8, png_rgb8_of,
};
pub use grid::Grid;
pub use mask::{Mask, MaskOverlap, PixelBox};
pub use png_text::{split_png_text, with_png_text};
pub use resample::{resample, resample_transposed};
pub use resize::{catmull_rom, enlarge, mask_of_print, reduce};
pub use warp_depth::warp_depth;
pub use warp_mask::warp_mask;
pub use warp_rgb::warp_rgb;
