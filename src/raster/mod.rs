//! Pictures and masks in memory, and the pixel convention: see [`Grid`].

mod decode;
mod depth_map;
pub mod encode;
mod grid;
mod limits;
mod mask;
mod minmax_pyramid;
mod picture;
mod resample;
mod supersample;
mod warp;

pub use decode::{DecodeError, decode, header_pixel_count};
pub use depth_map::DepthMap;
pub use encode::{
    PngError, decode_grey8, decode_grey16, decode_mask, jpeg_rgb8, png_grey8, png_grey16, png_mask,
    png_rgb8,
};
pub use grid::Grid;
pub use limits::ImageLimits;
pub use mask::{Mask, MaskOverlap, PixelBox};
pub use picture::PrintImage;
pub use resample::{resample, resample_rows_transposed, resample_transposed};
pub use warp::{warp_depth, warp_mask};
