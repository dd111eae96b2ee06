//! Orthographic z-buffer: the highest surface under each pixel of a plane.
//!
//! Frames: the mesh's own, a plane frame (z is height), and depth-map px.

mod block_bounds;
mod block_fill;
mod moments;
mod render;
mod small_triangles;
mod surface;
mod triangle_block;
mod triangle_fill;
mod viewport;

pub(super) use moments::Moments;
pub(super) use render::NO_HIT;
pub(super) use surface::IndexedSurface;
pub(super) use viewport::Viewport;
