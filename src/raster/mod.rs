//! Pictures and masks in memory, and the pixel convention: see [`Grid`].

mod depth_map;
mod grid;
mod mask;
mod picture;
mod warp;

pub use depth_map::DepthMap;
pub use grid::Grid;
pub use mask::{Mask, PixelBox};
pub use picture::Picture;
pub use warp::{warp_depth, warp_mask, warp_values};
