//! The carved surface of one side of a block, as heights over its mean plane.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::block_damage::BlockDamage;
use super::face_field::FaceField;
use super::kind::BlockRanges;
use crate::draw::within;
use crate::ellipse::Axis;
use crate::noise::{Noise, smoothstep};

/// Width of the band along the edges of a block in which they are rounded, mm.
const EDGE_MM: f64 = 2.5;

/// One side of a block. Positions are in mm in its face frame; heights are in mm along the outward normal.
#[derive(Debug, Clone)]
pub(super) struct BlockRelief {
    /// Signed distance to the strokes as they were carved.
    pub field: FaceField,
    /// What was lost since.
    pub damage: BlockDamage,
    /// Half the width and half the height of the block, mm.
    half_mm: [f64; 2],
    bow: BlockBow,
    wear: TopWear,
    ground: CarvedGround,
}

/// Bow and twist of the block: a surface of the second degree and a little of a higher one.
#[derive(Debug, Clone, Copy)]
struct BlockBow {
    along: f64,
    across: f64,
    twist: f64,
    waves: Noise,
    waves_mm: f64,
}

/// Wear of the stroke tops.
#[derive(Debug, Clone, Copy)]
struct TopWear {
    patches: Noise,
    patch_mm: f64,
    grain: Noise,
    grain_axis: Axis,
    pits: Noise,
    rim_mm: f64,
    rim_width_mm: f64,
}

/// Shape of the ground between the strokes.
#[derive(Debug, Clone, Copy)]
struct CarvedGround {
    depth_mm: f64,
    slope: f64,
    lean: Noise,
    unevenness: Noise,
    gouges: Noise,
    gouge_axis: Axis,
    gouge_mm: f64,
    tool_marks: Noise,
}

impl BlockRelief {
    /// Carves the strokes of a field into a side that extends `half_mm` from its middle.
    pub(super) fn carve(
        field: FaceField,
        ranges: &BlockRanges,
        half_mm: [f64; 2],
        rng: &mut ChaCha8Rng,
    ) -> Self {
        Self {
            field,
            damage: BlockDamage::draw(ranges, half_mm, rng),
            half_mm,
            bow: BlockBow::draw(ranges, rng),
            wear: TopWear::draw(ranges, rng),
            ground: CarvedGround::draw(ranges, rng),
        }
    }

    /// Returns the signed distance in mm to the strokes left on the block.
    pub(super) fn remaining_mm(&self, point: [f64; 2]) -> f64 {
        let strokes = self.field.value(point);
        strokes.min(-self.damage.lost_mm(point, false))
    }

    /// Returns the height of the stroke tops at a point, as if a stroke were there, mm.
    pub(super) fn top_mm(&self, point: [f64; 2]) -> f64 {
        let share = [0, 1].map(|i| point[i] / self.half_mm[i]);
        self.bow.at(point, share) - self.wear.patch_at(point)
    }

    /// Returns the height of the surface at a point, mm.
    pub(super) fn height_mm(&self, point: [f64; 2]) -> f64 {
        let inside = self.remaining_mm(point);
        let top = self.top_mm(point) - self.wear.fine_at(point, inside);
        let carved = if inside > 0.0 {
            top
        } else {
            top - self.ground.depth_at(point, -inside)
        };
        carved
            - self.damage.crack_depth_mm(point)
            - self.damage.corner_depth_mm(point)
            - self.edge_depth_mm(point)
    }

    /// Returns the height that the rounded edges of the block lack, mm.
    fn edge_depth_mm(&self, point: [f64; 2]) -> f64 {
        let depth = [0, 1].map(|i| {
            let from_edge = self.half_mm[i] - point[i].abs();
            let share = (1.0 - from_edge / EDGE_MM).clamp(0.0, 1.5);
            1.2 * share * share
        });
        depth[0] + depth[1]
    }
}

impl BlockBow {
    fn draw(ranges: &BlockRanges, rng: &mut ChaCha8Rng) -> Self {
        let total = within(ranges.bow_mm, rng);
        let parts = [0; 3].map(|_: i32| rng.random_range(-1.0..1.0_f64));
        let sum = parts.iter().map(|part| part.abs()).sum::<f64>().max(1e-6);
        let [along, across, twist] = parts.map(|part| total * part / sum);
        Self {
            along,
            across,
            twist,
            waves: Noise::draw(rng),
            waves_mm: rng.random_range(0.02..0.12),
        }
    }

    /// Returns the height at a point in mm, which is also given as a fraction of half the block's size.
    fn at(&self, [u, v]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
        self.along * x * x
            + self.across * y * y
            + self.twist * x * y
            + self.waves_mm * self.waves.at(u / 70.0, v / 70.0)
    }
}

impl TopWear {
    fn draw(ranges: &BlockRanges, rng: &mut ChaCha8Rng) -> Self {
        Self {
            patches: Noise::draw(rng),
            patch_mm: within(ranges.wear_mm, rng),
            grain: Noise::draw(rng),
            // The grain runs along the block.
            grain_axis: Axis::at(rng.random_range(-0.08..0.08)),
            pits: Noise::draw(rng),
            rim_mm: rng.random_range(0.02..0.12),
            rim_width_mm: rng.random_range(0.1..0.25),
        }
    }

    /// Returns the height that wear removes in large patches, mm.
    fn patch_at(&self, [u, v]: [f64; 2]) -> f64 {
        let worn = smoothstep(-0.2, 1.0, self.patches.two_octaves(u / 22.0, v / 16.0));
        self.patch_mm * worn
    }

    /// Returns the height that open grain, pits and rounded edges lack, `inside` mm from the edge of a stroke.
    fn fine_at(&self, [u, v]: [f64; 2], inside: f64) -> f64 {
        let [along, across] = self.grain_axis.along_across([u, v]);
        let grain = 0.012 * (1.0 + self.grain.at(along / 9.0, across / 0.35));
        let pits = 0.08 * smoothstep(0.75, 0.95, self.pits.at(u / 0.5, v / 0.4));
        let rim = self.rim_mm * (1.0 - smoothstep(0.0, self.rim_width_mm, inside));
        grain + pits + rim
    }
}

impl CarvedGround {
    fn draw(ranges: &BlockRanges, rng: &mut ChaCha8Rng) -> Self {
        Self {
            depth_mm: within(ranges.ground_mm, rng),
            slope: rng.random_range(1.6..3.2),
            lean: Noise::draw(rng),
            unevenness: Noise::draw(rng),
            gouges: Noise::draw(rng),
            gouge_axis: Axis::draw_any(rng),
            gouge_mm: rng.random_range(0.08..0.25),
            tool_marks: Noise::draw(rng),
        }
    }

    /// Returns the depth below the stroke tops `outside` mm from the nearest stroke, mm. The walls slope down to a
    /// rough floor. Two walls that meet above the floor form a V.
    fn depth_at(&self, [u, v]: [f64; 2], outside: f64) -> f64 {
        let wall = outside * self.slope * (1.0 + 0.25 * self.lean.at(u / 1.6, v / 1.6));
        if wall < 0.6 {
            return wall;
        }
        // Marks of the gouge are narrow and cross the ground in one direction.
        let bent = 0.6 * self.unevenness.at(u / 12.0 + 40.0, v / 12.0);
        let [along, across] = self.gouge_axis.along_across([u, v]);
        let marks = self.gouges.at(along / 7.0, across / 1.3 + bent).abs();
        let floor = self.depth_mm + 0.25 * self.unevenness.two_octaves(u / 9.0, v / 9.0)
            - self.gouge_mm * (1.0 - 2.0 * marks)
            + 0.04 * self.tool_marks.two_octaves(u / 0.5, v / 0.5);
        // Smooth minimum of wall and floor with a rounding of 0.3 mm.
        let gap = (0.5 + (floor - wall) / 0.6).clamp(0.0, 1.0);
        (floor + (wall - floor) * gap - 0.3 * gap * (1.0 - gap)).max(0.5)
    }
}
