//! Damage to a whole block: regions that lost their strokes, cracks along the grain, broken corners.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::kind::BlockRanges;
use crate::draw::{number_within, within};
use crate::ellipse::{Axis, Ellipse};
use crate::noise::{Noise, smoothstep};

/// Widest gap in the raggedness of an edge, mm.
const RAGGED_MM: f64 = 0.45;

/// When a block was damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DamageTime {
    /// Before it was printed: the page shows it.
    BeforePrinting,
    /// After it was printed.
    AfterPrinting,
}

/// A region without strokes.
#[derive(Debug, Clone, Copy)]
struct LostRegion {
    shape: Ellipse,
    edge: Noise,
    time: DamageTime,
}

/// A crack that runs along the grain from one end and narrows towards the other.
#[derive(Debug, Clone, Copy)]
struct GrainCrack {
    /// Position across the grain at u = 0, mm.
    offset_mm: f64,
    slope: f64,
    path: Noise,
    half_width_mm: f64,
    depth_mm: f64,
    /// u of the tip, mm, and the direction towards the wide end.
    tip: [f64; 2],
    time: DamageTime,
}

/// A corner that broke off.
#[derive(Debug, Clone, Copy)]
struct BrokenCorner {
    /// The corner of the block, mm.
    corner: [f64; 2],
    /// Direction from the corner into the block.
    inward: Axis,
    /// Distance from the corner to the fracture, mm.
    cut_mm: f64,
    edge: Noise,
    depth_mm: f64,
    time: DamageTime,
}

/// All damage of one side.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockDamage {
    lost: Vec<LostRegion>,
    cracks: Vec<GrainCrack>,
    corners: Vec<BrokenCorner>,
}

impl BlockDamage {
    /// Draws the damage of a side that extends `half_mm` from its middle.
    pub(super) fn draw(ranges: &BlockRanges, half_mm: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        let lost = (0..number_within(ranges.lost, rng)).map(|_| LostRegion::draw(half_mm, rng));
        let lost = lost.collect();
        let cracks = (0..number_within(ranges.cracks, rng))
            .map(|_| GrainCrack::draw(ranges, half_mm, rng))
            .collect();
        let first: usize = rng.random_range(0..4);
        let corners = (0..number_within(ranges.broken_corners, rng) as usize)
            .map(|k| BrokenCorner::draw((first + k) % 4, half_mm, rng))
            .collect();
        Self {
            lost,
            cracks,
            corners,
        }
    }

    /// Returns the signed distance in mm to the edge of the regions without strokes, positive inside. Counts only
    /// damage from before the printing if `is_print` is set.
    pub(super) fn lost_mm(&self, point: [f64; 2], is_print: bool) -> f64 {
        let counts = |time| !is_print || time == DamageTime::BeforePrinting;
        let lost = self.lost.iter().filter(|region| counts(region.time));
        let lost = lost.map(|region| region.inside_mm(point));
        let corners = self.corners.iter().filter(|corner| counts(corner.time));
        let corners = corners.map(|corner| corner.inside_mm(point));
        lost.chain(corners).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the height in mm that broken corners take away at a point.
    pub(super) fn corner_depth_mm(&self, point: [f64; 2]) -> f64 {
        let depths = self.corners.iter().map(|corner| {
            let inside = corner.inside_mm(point);
            let rough = 0.4 * corner.edge.two_octaves(point[0] / 2.5, point[1] / 2.5);
            smoothstep(-0.3, 2.5, inside) * (corner.depth_mm + 0.12 * inside + rough)
        });
        depths.fold(0.0, f64::max)
    }

    /// Returns the depth of the cracks at a point, mm.
    pub(super) fn crack_depth_mm(&self, point: [f64; 2]) -> f64 {
        let depths = self.cracks.iter().map(|crack| {
            let half_width = crack.half_width_at(point[0]);
            let share = crack.distance_mm(point) / half_width.max(1e-6);
            crack.depth_mm * (1.0 - share).max(0.0)
        });
        depths.fold(0.0, f64::max)
    }

    /// Returns whether a point lies in a crack that is older than the print.
    pub(super) fn is_cracked_in_print(&self, point: [f64; 2]) -> bool {
        self.cracks.iter().any(|crack| {
            crack.time == DamageTime::BeforePrinting
                && crack.distance_mm(point) < crack.half_width_at(point[0])
        })
    }
}

/// Draws whether damage is older than the print.
fn draw_time(rng: &mut ChaCha8Rng) -> DamageTime {
    if rng.random_bool(0.35) {
        DamageTime::BeforePrinting
    } else {
        DamageTime::AfterPrinting
    }
}

impl LostRegion {
    fn draw(half_mm: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        let long_mm = 0.7 * 9.0_f64.powf(rng.random());
        Self {
            shape: Ellipse {
                centre: half_mm.map(|half| rng.random_range(-half..half)),
                axis: Axis::draw_any(rng),
                long_mm,
                short_mm: long_mm * rng.random_range(0.3..0.9),
            },
            edge: Noise::draw(rng),
            time: draw_time(rng),
        }
    }

    fn inside_mm(&self, point: [f64; 2]) -> f64 {
        let [du, dv] = [0, 1].map(|i| point[i] - self.shape.centre[i]);
        let reach = self.shape.long_mm + 3.0;
        if du * du + dv * dv > reach * reach {
            return -3.0;
        }
        let ragged = RAGGED_MM * self.edge.two_octaves(du / 1.1, dv / 1.1);
        self.shape.inside_mm(point) + ragged
    }
}

impl GrainCrack {
    fn draw(ranges: &BlockRanges, half_mm: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        Self {
            offset_mm: rng.random_range(-0.8..0.8) * half_mm[1],
            slope: rng.random_range(-0.05..0.05),
            path: Noise::draw(rng),
            half_width_mm: within(ranges.crack_mm, rng),
            depth_mm: rng.random_range(1.0..4.0),
            tip: [side * rng.random_range(-0.9..0.6) * half_mm[0], side],
            time: draw_time(rng),
        }
    }

    /// Returns half the width at a position along the grain, mm; 0 beyond the tip.
    fn half_width_at(&self, u: f64) -> f64 {
        let [tip, towards_end] = self.tip;
        self.half_width_mm * smoothstep(0.0, 60.0, (u - tip) * towards_end)
    }

    fn distance_mm(&self, [u, v]: [f64; 2]) -> f64 {
        let path = self.offset_mm + self.slope * u;
        if (v - path).abs() > 4.0 {
            return 4.0;
        }
        let wave = 1.4 * self.path.two_octaves(u / 17.0, 0.0) + 0.12 * self.path.at(u / 0.9, 5.0);
        (v - path - wave).abs()
    }
}

impl BrokenCorner {
    fn draw(index: usize, half_mm: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        let side = [
            if index.is_multiple_of(2) { -1.0 } else { 1.0 },
            if index < 2 { -1.0 } else { 1.0 },
        ];
        let corner = [side[0] * half_mm[0], side[1] * half_mm[1]];
        let diagonal = (-corner[1]).atan2(-corner[0]);
        Self {
            corner,
            inward: Axis::at(diagonal + rng.random_range(-0.35..0.35)),
            cut_mm: rng.random_range(30.0..75.0),
            edge: Noise::draw(rng),
            depth_mm: rng.random_range(3.5..7.0),
            time: draw_time(rng),
        }
    }

    fn inside_mm(&self, point: [f64; 2]) -> f64 {
        let offset = [0, 1].map(|i| point[i] - self.corner[i]);
        let [inward, across] = self.inward.along_across(offset);
        if inward > self.cut_mm + 9.0 {
            return -3.0;
        }
        let ragged = 4.0 * self.edge.two_octaves(across / 22.0, 0.0)
            + 0.7 * self.edge.two_octaves(across / 2.2, 3.0);
        (self.cut_mm + ragged - inward).max(-3.0)
    }
}
