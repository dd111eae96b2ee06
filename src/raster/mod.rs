//! Pictures and masks in memory, and the pixel convention: see [`Grid`].

mod depth_map;
mod grid;
mod mask;
mod picture;

pub use depth_map::DepthMap;
pub use grid::Grid;
pub use mask::{Mask, PixelBox};
pub use picture::Picture;
