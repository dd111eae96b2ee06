//! A one-sided robust surface over the highest parts of a height map.
//!
//! Stroke tops are the original face of the block: much of the block lies below them and nothing above. Therefore a
//! point above the surface has a high weight, and a point far below the surface has none.

use super::height_samples::{HeightSamples, quantile};
use super::least_squares::{Coefficients, OPEN, Points, Prior, value};
use super::pca::Axes;
use crate::stages::pose::SoftMask;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Grid, Mask};

/// Weight of points above the surface in the first passes, which solve a convex problem. Points below weigh
/// `1 - ENVELOPE`. The resulting surface is the 0.97 expectile of the heights.
const ENVELOPE: f64 = 0.97;
/// Weight of a point above the surface in the passes that follow.
const ABOVE: f64 = 3.0;
/// Distances below the surface at which the weight of a point falls to 0, as fractions of the height range. Each
/// distance is used for `NARROW_PASSES` passes.
const WINDOWS: [f64; 5] = [0.35, 0.22, 0.14, 0.10, 0.08];
/// Number of convex passes.
const ENVELOPE_PASSES: usize = 8;
/// Number of passes for each window.
const NARROW_PASSES: usize = 2;
/// Number of wide windows, for which a quarter of the points is enough.
const WIDE_WINDOWS: usize = 3;
/// Connected tops belong to a neighbouring character if they come within this many pixels of the mesh's edge.
const CUT_PX: i64 = 2;
/// Weight of a point that is not on a top of the character.
const OFF_TOP_WEIGHT: f64 = 1e-6;
/// Least fraction of the tops that must remain without the tops at the edge.
const LEAST_OWN: f64 = 0.4;
/// Errors of neighbouring pixels are correlated: this many pixels count as one independent observation.
const CORRELATED_PX: f64 = 40.0;
/// Standard deviation of the heights on rough stroke tops, as a fraction of the height range.
const TOP_SIGMA: f64 = 0.05;
/// Prior standard deviation of the slope between the tops' plane and the mean plane of all heights.
const TILT_SIGMA: f64 = 0.05;
/// Prior standard deviation of the second-degree coefficients, with lengths in units of the extent. If c3 has this
/// value, the surface rises by about 4 % of the extent from its middle to its edge (u = 0.5).
const BOW_SIGMA: f64 = 0.15;
/// Prior standard deviation of the difference between the second-degree coefficients of tops and ground.
const GROUND_BOW_SIGMA: f64 = 0.03;
/// The fit of the ground starts with the mean plane, shifted to this quantile of the heights.
const GROUND_START: f64 = 0.25;
/// Distances from the ground at which the weight of a point falls to 0, as fractions of the height range.
const GROUND_WINDOWS: [f64; 4] = [0.35, 0.22, 0.14, 0.1];
/// Least fraction of the visible area that must be within the last window.
const LEAST_GROUND: f64 = 0.3;
/// A surface with less support rests on few strokes.
const SPARSE: f64 = 0.2;
/// Soft tops fall to zero at this fraction of the relief below the surface.
const SOFT_SPAN: f64 = 0.5;
/// Ratio of supports by which a curved surface must beat the plane.
const BOW_GAIN: f64 = 1.04;
/// Precision of a slope that is known, for each point. It exceeds the evidence of the points by far.
const KNOWN_SLOPE: f64 = 1e9;

/// A surface `z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2` in units of the extent, and how well it fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surface {
    pub(super) coefficients: Coefficients,
    /// Fraction of the points that lie near the surface, weighted by nearness. Points far above it count negatively.
    pub(super) support: f64,
    /// Fraction of the visible area within the last window.
    pub(super) tops: f64,
    /// Root mean square residual of that area, in mesh units.
    pub(super) rms: f64,
}

impl HeightSamples {
    /// Fits a surface to the stroke tops. Returns a plane, unless `allow_bow` is set and a curved surface fits better.
    pub(super) fn fit(&self, allow_bow: bool) -> Surface {
        let priors = self.priors(self.mean_plane, BOW_SIGMA);
        let start = self.envelope(self.mean_plane, &priors);
        let plane = self.narrow::<3>(start, &priors);
        if !allow_bow {
            return plane;
        }
        let free = self.narrow::<6>(start, &priors);
        let is_sparse = free.support < SPARSE;
        let along_ground = is_sparse.then(|| self.priors_along_ground()).flatten();
        let bent = along_ground
            .map(|priors| self.narrow::<6>(start, &priors))
            .filter(|along| along.support > free.support)
            .unwrap_or(free);
        if bent.support > plane.support * BOW_GAIN {
            bent
        } else {
            plane
        }
    }

    /// Fits the height of the stroke tops alone, if the view is perpendicular to them. Returns a plane without slope.
    pub(super) fn fit_height(&self) -> Surface {
        let mut priors = OPEN;
        for slope in &mut priors[1..3] {
            slope.precision = KNOWN_SLOPE * self.points.len() as f64;
        }
        let mean = self.points.solve::<3>(&[0.0; 6], |_| 1.0, &priors);
        let found = self.narrow::<3>(self.envelope(mean, &priors), &priors);
        let [height, ..] = found.coefficients;
        Surface {
            coefficients: [height, 0.0, 0.0, 0.0, 0.0, 0.0],
            ..found
        }
    }

    /// Raises a plane to the upper heights: the start of the narrow passes.
    fn envelope(&self, mut plane: Coefficients, priors: &[Prior; 6]) -> Coefficients {
        let weight = |r: f64| if r > 0.0 { ENVELOPE } else { 1.0 - ENVELOPE };
        let few_priors = self.priors_of_few(priors);
        for _ in 0..ENVELOPE_PASSES {
            plane = self.few.solve::<3>(&plane, weight, &few_priors);
        }
        plane
    }

    /// Refines a surface with a shrinking window below it.
    fn narrow<const TERMS: usize>(&self, start: Coefficients, priors: &[Prior; 6]) -> Surface {
        let few_priors = self.priors_of_few(priors);
        let mut c = start;
        for (k, window) in WINDOWS.map(|w| w * self.range).into_iter().enumerate() {
            let weight = |r| one_sided_weight(r, window);
            for _ in 0..NARROW_PASSES {
                c = if k < WIDE_WINDOWS {
                    self.few.solve::<TERMS>(&c, weight, &few_priors)
                } else {
                    self.points.solve::<TERMS>(&c, weight, priors)
                };
            }
        }
        self.judge(c)
    }

    /// Scales the precision of priors to the number of subsampled points.
    fn priors_of_few(&self, priors: &[Prior; 6]) -> [Prior; 6] {
        let share = self.few.len() as f64 / self.points.len() as f64;
        priors.map(|prior| Prior {
            precision: prior.precision * share,
            ..prior
        })
    }

    /// Measures how well a surface fits at the narrowest window.
    fn judge(&self, coefficients: Coefficients) -> Surface {
        let w = WINDOWS[WINDOWS.len() - 1] * self.range;
        let (mut support, mut tops, mut squares) = (0.0, 0.0, 0.0);
        for r in self.points.residuals(&coefficients) {
            if r.abs() < w {
                support += 1.0 - (r / w).powi(2);
                tops += 1.0;
                squares += r * r;
            } else if r > 0.0 {
                support -= ABOVE;
            }
        }
        let n = self.points.len() as f64;
        Surface {
            coefficients,
            support: support / n,
            tops: tops / n,
            rms: (squares / tops.max(1.0)).sqrt() * self.extent,
        }
    }

    /// Returns priors with the coefficients `mean`. Second-degree coefficients have the standard deviation `bow_sigma`.
    /// If few stroke tops are visible, the priors dominate.
    fn priors(&self, mean: Coefficients, bow_sigma: f64) -> [Prior; 6] {
        let noise = CORRELATED_PX * (TOP_SIGMA * self.range).powi(2);
        std::array::from_fn(|k| {
            let sigma = if k < 3 { TILT_SIGMA } else { bow_sigma };
            let precision = if k == 0 { 0.0 } else { noise / (sigma * sigma) };
            Prior {
                mean: mean[k],
                precision,
            }
        })
    }

    /// Returns priors with the curvature of the ground, or `None` if too little ground is visible. A block bends as a
    /// whole, so the ground shows how the tops bend, even if there are few strokes.
    fn priors_along_ground(&self) -> Option<[Prior; 6]> {
        let [a, b, c, ..] = self.mean_plane;
        let [_, _, _, p, q, r] = self.ground()?;
        Some(self.priors([a, b, c, p, q, r], GROUND_BOW_SIGMA))
    }

    /// Fits a second-degree surface to the carved ground. Returns `None` if too little ground is visible.
    fn ground(&self) -> Option<Coefficients> {
        let mut c = self.mean_plane;
        c[0] += quantile(&mut self.points.residuals(&c), GROUND_START);
        let priors = self.priors(self.mean_plane, BOW_SIGMA);
        for window in GROUND_WINDOWS.map(|w| w * self.range) {
            for _ in 0..NARROW_PASSES {
                let weight = |r| smooth_weight(r, window);
                c = self.points.solve::<6>(&c, weight, &priors);
            }
        }
        let window = GROUND_WINDOWS[GROUND_WINDOWS.len() - 1] * self.range;
        let residuals = self.points.residuals(&c);
        let near = residuals.iter().filter(|r| r.abs() < window).count();
        (near as f64 / residuals.len() as f64 > LEAST_GROUND).then_some(c)
    }

    /// Returns the height of every visible pixel over a surface, in mesh units.
    pub(super) fn residuals(&self, surface: &Surface) -> Vec<f64> {
        let mut residuals = self.points.residuals(&surface.coefficients);
        for r in &mut residuals {
            *r *= self.extent;
        }
        residuals
    }

    /// Returns the heights of the carved face over a surface, in mesh units.
    pub(super) fn face_residuals(&self, surface: &Surface) -> Vec<f32> {
        self.face_heights(&self.positioned_heights(&surface.coefficients))
    }

    /// Returns an image of the nearness to the surface: 1 on or above it, falling to 0 at half the relief below it.
    pub(super) fn soft_tops(&self, surface: &Surface, relief: f64) -> SoftMask {
        let [width, height] = self.size;
        let mut soft = SoftMask {
            amount: Grid::new(width, height, 0.0),
            known: Grid::new(width, height, false),
        };
        let span = (SOFT_SPAN * relief).max(f64::MIN_POSITIVE);
        for (place, r) in self.places.iter().zip(self.residuals(surface)) {
            soft.amount.data_mut()[*place] = (1.0 + r / span).clamp(0.0, 1.0) as f32;
            soft.known.data_mut()[*place] = true;
        }
        soft
    }

    /// Returns the plane `z = a + b x + c y` through the stroke tops, in plane coordinates and mesh units.
    ///
    /// A flat surface is this plane already. If the surface is curved, a plane is fitted to the tops, and tops at the
    /// mesh's edge, which belong to neighbouring characters, hardly count.
    pub(super) fn plane_of_tops(&self, surface: &Surface) -> [f64; 3] {
        let c = surface.coefficients;
        let is_bent = c[3..].iter().any(|c| *c != 0.0);
        let [a, b, c, ..] = self.in_plane_units(if is_bent { self.plane_in(&c) } else { c });
        [a, b, c]
    }

    /// Fits a plane to a curved surface at the character's own tops. Other points have a tiny weight.
    fn plane_in(&self, c: &Coefficients) -> Coefficients {
        let own = self.own_tops(c);
        let (mut all, mut tops) = (Points::default(), Points::default());
        for ([u, v, _], place) in self.points.iter().zip(&self.places) {
            let on_surface = [u, v, value(c, [u, v])];
            all.push(on_surface);
            if own.data()[*place] {
                tops.push(on_surface);
            }
        }
        let plane_of = |points: &Points, priors| points.solve::<3>(&[0.0; 6], |_| 1.0, priors);
        let precision = OFF_TOP_WEIGHT * all.len() as f64;
        let priors = plane_of(&all, &OPEN).map(|mean| Prior { mean, precision });
        plane_of(&tops, &priors)
    }

    /// Returns the standard deviation of the places of the character's own tops, along the direction in which they spread
    /// least, as a fraction of the extent. Returns NaN if there are no tops.
    pub(super) fn spread_of_tops(&self, surface: &Surface) -> f64 {
        let own = self.own_tops(&surface.coefficients);
        let tops: Vec<([f64; 3], f64)> = (self.points.iter().zip(&self.places))
            .filter(|(_, place)| own.data()[**place])
            .map(|([u, v, _], _)| ([u, v, 0.0], 1.0))
            .collect();
        let [_, across, _] = Axes::of_points(tops.iter().copied()).variances;
        across.sqrt()
    }

    /// Returns the mask of the tops away from the edge of the mesh, or of all tops if too few remain.
    fn own_tops(&self, c: &Coefficients) -> Mask {
        let window = WINDOWS[WINDOWS.len() - 1] * self.range;
        let [width, height] = self.size;
        let mut tops = Mask::new(width, height, false);
        let mut unknown = Mask::new(width, height, true);
        for (r, place) in self.points.residuals(c).into_iter().zip(&self.places) {
            tops.data_mut()[*place] = r.abs() < window;
            unknown.data_mut()[*place] = false;
        }
        let cut_off = ConnectedComponents::label(&tops).touching(&unknown, CUT_PX);
        let own = tops.zip_map(&cut_off, |top, cut_off| top && !cut_off);
        if own.count() as f64 >= LEAST_OWN * tops.count() as f64 {
            own
        } else {
            tops
        }
    }

    /// Converts a surface to mesh units. Returns the coefficients of 1, x, y, x^2, xy and y^2 in the plane.
    pub(super) fn in_plane_units(&self, c: Coefficients) -> [f64; 6] {
        let e = self.extent;
        let [p, q] = self.centre;
        // u = (x - p) / e, z = e * f(u, v).
        let (a, b, d) = (c[3] / e, c[4] / e, c[5] / e);
        [
            c[0] * e - c[1] * p - c[2] * q + a * p * p + b * p * q + d * q * q,
            c[1] - 2.0 * a * p - b * q,
            c[2] - 2.0 * d * q - b * p,
            a,
            b,
            d,
        ]
    }
}

/// Returns the weight of a residual. Below the surface, the weight falls from 1 to 0 at a depth of `window`. Above the
/// surface, the weight is `ABOVE`, but 0 for spikes higher than `3 * window`.
#[inline(always)]
fn one_sided_weight(r: f64, window: f64) -> f64 {
    let below = smooth_weight(r, window);
    let near = if r > 0.0 { ABOVE } else { below };
    if r > 3.0 * window { 0.0 } else { near }
}

/// Returns the weight of a residual: 1 on the surface, falling to 0 at a distance of `window` on both sides.
#[inline(always)]
fn smooth_weight(r: f64, window: f64) -> f64 {
    let t = r / window;
    let near = 1.0 - t * t;
    let near = if near > 0.0 { near } else { 0.0 };
    near * near
}
