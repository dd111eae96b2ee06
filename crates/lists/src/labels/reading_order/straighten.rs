//! Straightening of a page from the centres of its boxes: rotation, keystone, and columns that are bent.

use super::box_extent::BoxExtent;
use mocban_core::domain::cancel::polled;

/// Largest angle that is searched, in degrees.
const MAX_DEGREES: f64 = 6.0;
/// Largest keystone and bend that are searched, in the usual size.
const MAX_SHIFT: f64 = 1.0;
/// Smallest number of boxes that show an angle.
const MIN_BOXES: usize = 6;
/// Smallest number of boxes that show a keystone and a bend.
const MIN_BOXES_OF_BENT: usize = 40;
/// Smallest share of boxes of full size that show a keystone and a bend without the notes.
const MIN_FULL_SHARE: f64 = 0.3;
/// Maximum number of boxes that take part in the search.
const MAX_SEARCHED: usize = 4000;
/// Bins of the histogram in the usual size.
const BINS_PER_SIZE: f64 = 8.0;
/// Maximum number of bins, for boxes that are far apart.
const MAX_BINS: f64 = 65536.0;
/// Share of the sharpness that each largest value must gain, so that few boxes are not moved without reason.
const COST: f64 = 0.1;
/// Steps on both sides of zero in the coarse search of one value.
const COARSE_STEPS: i32 = 24;
/// Steps on both sides of zero in the coarse search of angle and keystone together.
const JOINT_STEPS: [i32; 2] = [12, 8];
/// Steps on both sides of the best value in the fine searches, and how much finer they are each time.
const FINE_STEPS: i32 = 4;
const FINER: [f64; 3] = [0.08, 0.02, 0.005];

/// How columns deviate from upright lines.
#[derive(Debug, Clone, Copy, Default)]
struct PageBend {
    /// Values as shares of the largest ones:
    /// - angle by which the page is turned clockwise,
    /// - keystone: sideways shift at the corners, outwards at the bottom,
    /// - bend: sideways shift at top and bottom, to the right.
    shares: [f64; 3],
}

/// Frame in which a bend is applied.
#[derive(Debug, Clone, Copy)]
struct BendFrame {
    centre: [f64; 2],
    half: [f64; 2],
    full_size: f64,
}

/// Turns a page back by up to 6 degrees, and shifts its boxes sideways so that leaning and bent columns are upright.
/// The shape is the one with the sharpest columns. Does nothing for fewer than six boxes, and only turns the page for
/// fewer than 40.
pub(super) fn straighten(extents: &mut [BoxExtent], full_size: f64) {
    if extents.len() < MIN_BOXES || full_size <= 0.0 {
        return;
    }
    let frame = BendFrame::of(extents, full_size);
    let searched = searched(extents, full_size);
    let mut search = BendSearch {
        extents: &searched,
        frame,
        best: PageBend::default(),
        highest: f64::NEG_INFINITY,
    };
    search.try_bend(PageBend::default());
    search.along(0, COARSE_STEPS, 1.0 / f64::from(COARSE_STEPS));
    let mut values = 0..1;
    if extents.len() >= MIN_BOXES_OF_BENT {
        search.jointly();
        search.along(2, COARSE_STEPS, 1.0 / f64::from(COARSE_STEPS));
        values = 0..3;
    }
    for step in FINER {
        for value in values.clone() {
            search.along(value, FINE_STEPS, step);
        }
    }
    let best = search.best;
    for extent in extents {
        *extent = frame.straightened(extent, best);
    }
}

/// Returns the boxes by which the bend is searched: those of full size, unless they are few. Notes stand beside the middle
/// of their column, so that wrong bends can bring them together with other columns.
fn searched(extents: &[BoxExtent], full_size: f64) -> Vec<BoxExtent> {
    let full = || extents.iter().filter(|extent| !extent.is_small(full_size));
    let count = full().count();
    let enough =
        count >= MIN_BOXES_OF_BENT && count as f64 >= MIN_FULL_SHARE * extents.len() as f64;
    let chosen: Vec<BoxExtent> = if enough {
        full().copied().collect()
    } else {
        extents.to_vec()
    };
    let stride = chosen.len().div_ceil(MAX_SEARCHED);
    chosen.into_iter().step_by(stride).collect()
}

/// The search for the bend with the sharpest columns.
struct BendSearch<'a> {
    extents: &'a [BoxExtent],
    frame: BendFrame,
    best: PageBend,
    highest: f64,
}

impl BendSearch<'_> {
    /// Keeps a bend if its columns are sharper than the best so far.
    fn try_bend(&mut self, bend: PageBend) {
        if bend.shares.iter().any(|share| share.abs() > 1.0) {
            return;
        }
        let costs = bend.shares.iter().map(|share| 1.0 - COST * share.abs());
        let score = self.frame.sharpness(self.extents, bend) * costs.product::<f64>();
        if score > self.highest {
            (self.best, self.highest) = (bend, score);
        }
    }

    /// Changes one value by steps in both directions, beginning with the smallest change.
    fn along(&mut self, value: usize, count: i32, step: f64) {
        let start = self.best;
        for k in (1..=count).flat_map(|k| [k, -k]) {
            let mut bend = start;
            bend.shares[value] += f64::from(k) * step;
            self.try_bend(bend);
        }
    }

    /// Searches angle and keystone together: in a keystone, each angle fits the columns of one part of the page.
    fn jointly(&mut self) {
        let [angles, keystones] = JOINT_STEPS;
        for keystone in (1..=keystones).flat_map(|k| [k, -k]) {
            for angle in (0..=angles).flat_map(|k| [k, -k]) {
                let shares = [
                    f64::from(angle) / f64::from(angles),
                    f64::from(keystone) / f64::from(keystones),
                    0.0,
                ];
                self.try_bend(PageBend { shares });
            }
        }
    }
}

impl BendFrame {
    fn of(extents: &[BoxExtent], full_size: f64) -> Self {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        };
        let [u0, u1] = range(&mut extents.iter().map(|extent| extent.u));
        let [v0, v1] = range(&mut extents.iter().map(|extent| extent.v));
        let half = |low: f64, high: f64| ((high - low) / 2.0).max(full_size);
        Self {
            centre: [f64::midpoint(u0, u1), f64::midpoint(v0, v1)],
            half: [half(u0, u1), half(v0, v1)],
            full_size,
        }
    }

    /// Moves a box as if the page were not bent. The centre of the page becomes the origin.
    fn straightened(self, extent: &BoxExtent, bend: PageBend) -> BoxExtent {
        let [angle, keystone, bow] = bend.shares;
        let (sin, cos) = (angle * MAX_DEGREES).to_radians().sin_cos();
        let (du, dv) = (extent.u - self.centre[0], extent.v - self.centre[1]);
        let (u, v) = (du * cos + dv * sin, dv * cos - du * sin);
        let (across, down) = (u / self.half[0], v / self.half[1]);
        let shift = (keystone * across * down + bow * down * down) * MAX_SHIFT * self.full_size;
        BoxExtent {
            u: u - shift,
            v,
            ..*extent
        }
    }

    /// Returns the sum of squared counts of boxes that share a place sideways without a bend.
    fn sharpness(self, extents: &[BoxExtent], bend: PageBend) -> f64 {
        let places = polled(extents).map(|extent| self.straightened(extent, bend).u);
        let places: Vec<f64> = places.collect();
        let first = places.iter().copied().fold(f64::INFINITY, f64::min);
        let last = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let bin = (self.full_size / BINS_PER_SIZE).max((last - first) / MAX_BINS);
        // One bin more on both sides for the smoothing.
        let mut counts = vec![0.0; ((last - first) / bin) as usize + 3];
        for place in places {
            counts[((place - first) / bin) as usize + 1] += 1.0;
        }
        let smooth = |near: &[f64]| near[0] + 2.0 * near[1] + near[2];
        counts.windows(3).map(|near| smooth(near).powi(2)).sum()
    }
}
