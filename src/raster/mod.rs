//! Pictures and masks in memory, and the pixel convention: see [`Grid`].

mod decode;
mod depth_map;
pub mod encode;
mod extremes;
mod grid;
mod limits;
mod looks;
mod mask;
mod picture;
mod resample;
mod warp;

pub use decode::{DecodeError, decode, pixels_by_header};
pub use depth_map::DepthMap;
pub use encode::{
    ArtifactError, decode_grey8, decode_grey16, decode_mask, jpeg_rgb8, png_grey8, png_grey16,
    png_mask, png_rgb8,
};
pub use grid::Grid;
pub use limits::Limits;
pub use mask::{Mask, Overlap, PixelBox};
pub use picture::Picture;
pub use resample::{resample, resample_made, resample_turned};
pub use warp::{warp_depth, warp_mask};
