//! Where the pixels of a rendering lie.

use crate::domain::Affine2;
use crate::stages::robust_bounds::Bounds;

/// Where the pixels of a rendering lie in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::stages) struct Viewport {
    /// Plane x, y to pixels.
    pub(in crate::stages) px_from_plane: Affine2,
    /// Columns.
    pub(in crate::stages) width: usize,
    /// Rows.
    pub(in crate::stages) height: usize,
    /// Side of a pixel, mesh units.
    pub(in crate::stages) unit_per_px: f64,
}

impl Viewport {
    /// A view of the bounds whose longest side takes `longest_px` pixels, one of them free on each side.
    ///
    /// The bounds' middle is the view's, so a mesh turned by a right angle is seen by the same rays.
    /// With `mirrored`, x is reflected: what is carved in mirror writing then reads right. y points down either way.
    pub(in crate::stages) fn around(bounds: Bounds<2>, longest_px: usize, mirrored: bool) -> Self {
        let [low, high] = bounds;
        let size = [high[0] - low[0], high[1] - low[1]];
        let unit_per_px = size[0].max(size[1]) / (longest_px.max(4) as f64 - 3.0);
        let scale = 1.0 / unit_per_px;
        // Rounding must not add a pixel to a side that takes a whole number of them.
        let side = |length: f64| (length * scale - 1e-6).ceil() as usize + 3;
        let [width, height] = size.map(side);
        let along = |axis: usize, side: usize, scale: f64| {
            let middle = f64::midpoint(low[axis], high[axis]);
            (side - 1) as f64 / 2.0 - scale * middle
        };
        let x_scale = if mirrored { -scale } else { scale };
        Self {
            px_from_plane: Affine2([
                [x_scale, 0.0, along(0, width, x_scale)],
                [0.0, -scale, along(1, height, -scale)],
            ]),
            width,
            height,
            unit_per_px,
        }
    }
}
