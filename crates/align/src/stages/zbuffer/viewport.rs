//! The pixel grid of a rendering.

use mocban_core::domain::Affine2;
use mocban_core::mesh::robust_bounds::Bounds;

/// The position of a rendering's pixels in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Viewport {
    /// Maps plane x, y (mesh units) to pixels.
    pub(crate) px_from_plane: Affine2,
    /// Columns.
    pub(crate) width: usize,
    /// Rows.
    pub(crate) height: usize,
    /// Side of a pixel, mesh units.
    pub(crate) unit_per_px: f64,
}

impl Viewport {
    /// Returns a viewport around `bounds` with `longest_px` pixels along the longest side. A pixel at each end is free.
    ///
    /// The viewport is centred on the bounds, so a mesh rotated by a right angle is sampled by the same rays.
    /// `mirrored` reflects x, so that mirror writing reads correctly. y points down in both cases.
    pub(crate) fn around(bounds: Bounds<2>, longest_px: usize, mirrored: bool) -> Self {
        let [low, high] = bounds;
        let size = [high[0] - low[0], high[1] - low[1]];
        let unit_per_px = size[0].max(size[1]) / (longest_px.max(4) as f64 - 3.0);
        let scale = 1.0 / unit_per_px;
        // Rounding must not add a pixel to a side of a whole number of pixels.
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

#[cfg(test)]
mod tests {
    use super::Viewport;

    #[test]
    fn mirrored_view_reflects_x_only() {
        let plain = Viewport::around([[0.0, 0.0], [10.0, 6.0]], 64, false);
        let mirrored = Viewport::around([[0.0, 0.0], [10.0, 6.0]], 64, true);
        let [x, y] = plain.px_from_plane.apply([2.0, 1.0]);
        let [u, v] = mirrored.px_from_plane.apply([8.0, 1.0]);
        assert!((x - u).abs() < 1e-9 && (y - v).abs() < 1e-9);
        assert!(plain.px_from_plane.determinant() < 0.0);
        assert!(mirrored.px_from_plane.determinant() > 0.0);
    }
}
