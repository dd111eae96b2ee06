//! Where a block lies in the frame and unit of its scan.
//!
//! The block frame is right-handed and in mm. Its origin is the middle of the front's mean plane, and its z axis points
//! out of the front. The print is the mirror image of the block: a point (u, v) of the front's face frame lies at
//! x = -u, y = -v.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::scan_pose::{any_rotation, dot};
use mocban_core::domain::LengthUnit;

/// A side of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FaceSide {
    /// The side whose normal is the block's z axis.
    Front,
    /// The opposite side.
    Back,
}

/// The frame of a side in the block frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideFrame {
    /// Factors of u, v and height along x, y and z.
    signs: [f64; 3],
    /// z of the mean plane of the stroke tops, mm.
    z_mm: f64,
}

/// A rigid motion and a length unit.
#[derive(Debug, Clone)]
pub(super) struct BlockPose {
    rotation: [[f64; 3]; 3],
    shift_mm: [f64; 3],
    /// The unit of the mesh.
    pub unit: LengthUnit,
}

impl SideFrame {
    /// Returns the frame of the front.
    pub(super) const fn front() -> Self {
        Self {
            signs: [-1.0, -1.0, 1.0],
            z_mm: 0.0,
        }
    }

    /// Returns the frame of the back of a block: it is turned over about its vertical axis, or, if `is_upside_down` is
    /// set, about its horizontal axis.
    pub(super) const fn back(thickness_mm: f64, is_upside_down: bool) -> Self {
        let signs = if is_upside_down {
            [-1.0, 1.0, -1.0]
        } else {
            [1.0, -1.0, -1.0]
        };
        Self {
            signs,
            z_mm: -thickness_mm,
        }
    }

    /// Converts a position and height on this side to the block frame, mm.
    pub(super) fn block_from_face(self, [u, v]: [f64; 2], height: f64) -> [f64; 3] {
        let [a, b, c] = self.signs;
        [a * u, b * v, self.z_mm + c * height]
    }

    /// Returns the position on this side of a point of the block frame, mm.
    pub(super) fn uv(self, x: f64, y: f64) -> [f64; 2] {
        [self.signs[0] * x, self.signs[1] * y]
    }
}

impl BlockPose {
    /// Draws any rotation, a shift of up to 150 mm along each axis, and a unit, mostly mm.
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        Self {
            rotation: any_rotation(rng),
            shift_mm: [0; 3].map(|_: i32| rng.random_range(-150.0..150.0)),
            unit: match rng.random_range(0..8_u32) {
                0..=4 => LengthUnit::Mm,
                5 => LengthUnit::Cm,
                6 => LengthUnit::M,
                _ => LengthUnit::In,
            },
        }
    }

    /// Converts a point of the block frame to mesh coordinates.
    pub(super) fn mesh_from_block(&self, point: [f64; 3]) -> [f64; 3] {
        let turned = self.rotation.map(|row| dot(row, point));
        [0, 1, 2].map(|i| (turned[i] + self.shift_mm[i]) / self.unit.mm())
    }

    /// Returns the 4 x 4 matrix, row by row, that maps mesh coordinates to u, v and height on a side, mm.
    pub(super) fn face_from_mesh(&self, side: SideFrame) -> [[f64; 4]; 4] {
        let row = |axis: usize| {
            let column = self.rotation.map(|row| row[axis]);
            let sign = side.signs[axis];
            let offset = if axis == 2 { side.z_mm } else { 0.0 };
            let [a, b, c] = column.map(|value| sign * value * self.unit.mm());
            [a, b, c, -sign * (dot(column, self.shift_mm) + offset)]
        };
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// Returns the outward normal of a side in the mesh frame.
    pub(super) fn normal(&self, side: SideFrame) -> [f64; 3] {
        self.rotation.map(|row| row[2] * side.signs[2])
    }
}
