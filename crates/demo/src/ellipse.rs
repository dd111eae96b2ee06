//! Directions and ellipses in the plane of the print.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A direction, as a unit vector.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis([f64; 2]);

impl Axis {
    /// Returns the direction at an angle from the u axis, clockwise on the print.
    pub(super) fn at(angle_rad: f64) -> Self {
        Self([angle_rad.cos(), angle_rad.sin()])
    }

    /// Draws any direction; opposite directions count as one.
    pub(super) fn draw_any(rng: &mut ChaCha8Rng) -> Self {
        Self::at(rng.random_range(0.0..std::f64::consts::PI))
    }

    /// Returns the coordinates of a point along and across the axis.
    pub(super) fn along_across(self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [a, b] = self.0;
        [u * a + v * b, v * a - u * b]
    }

    /// Returns the point with these coordinates along and across the axis.
    pub(super) fn point(self, [along, across]: [f64; 2]) -> [f64; 2] {
        let [a, b] = self.0;
        [along * a - across * b, along * b + across * a]
    }
}

/// An ellipse with half axes in mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ellipse {
    pub centre: [f64; 2],
    pub axis: Axis,
    pub long_mm: f64,
    pub short_mm: f64,
}

impl Ellipse {
    /// Returns the approximate signed distance to the edge in mm, positive inside.
    pub(super) fn inside_mm(&self, point: [f64; 2]) -> f64 {
        let offset = [0, 1].map(|i| point[i] - self.centre[i]);
        let [along, across] = self.axis.along_across(offset);
        self.short_mm * (1.0 - (along / self.long_mm).hypot(across / self.short_mm))
    }
}
