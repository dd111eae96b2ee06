//! Orthographic z-buffer: the highest surface under each pixel of a plane.
//!
//! There are three frames: the frame of the mesh, a plane frame (z is the height) and depth-map pixels.

mod block_bounds;
mod block_fill;
mod draw_effort;
mod moments;
mod render;
mod small_triangles;
mod surface;
mod triangle_block;
mod triangle_fill;
mod viewport;

pub(super) use draw_effort::LARGEST_OVERLAP;
pub(super) use moments::Moments;
pub(super) use render::NO_HIT;
pub(super) use surface::IndexedSurface;
pub(super) use viewport::Viewport;
