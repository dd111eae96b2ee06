//! A one-sided robust surface over what stands highest in a height map.
//!
//! Tops of strokes are the original face of the block: much lies below them, nothing above. So a point above the
//! surface costs much, one far below it nothing at all.

use super::least_squares::{Coefficients, OPEN, Points, Prior, value};
use crate::domain::Rigid3;
use crate::raster::{Grid, Mask};
use crate::stages::components::ConnectedComponents;
use crate::stages::pose::SoftMask;
use crate::stages::zbuffer::{NO_HIT, Viewport};

/// Expectile of the first, convex pass: points above weigh this, points below one less it.
const ENVELOPE: f64 = 0.97;
/// Weight of a point above the surface in the passes that follow.
const ABOVE: f64 = 3.0;
/// How far below the surface a point still counts, as a share of the height range, pass by pass.
const WINDOWS: [f64; 5] = [0.35, 0.22, 0.14, 0.10, 0.08];
/// Passes of the first kind, and of each window.
const ENVELOPE_PASSES: usize = 8;
const NARROW_PASSES: usize = 2;
/// So many of the windows are wide: few points are enough.
const AFAR: usize = 3;
/// Tops this close to the cut, in pixels of the rendering, run into it.
const CUT_PX: i64 = 2;
/// Weight of a point that is no top of the character's.
const HARDLY: f64 = 1e-6;
/// Without the tops at the cut at least this share of all must be left.
const LEAST_OWN: f64 = 0.4;
/// Margin of the view, a share of each side, that the depth of the carving is not read from.
const MARGIN: f64 = 0.15;
/// Neighbouring pixels of a top err together: so many of them count as one.
const CORRELATED_PX: f64 = 40.0;
/// Standard deviation of the tops' unevenness as a share of the height range.
const TOP_SIGMA: f64 = 0.05;
/// The tops' plane is parallel to the carved ground within this slope (one standard deviation).
const TILT_SIGMA: f64 = 0.05;
/// Second-degree coefficients in units of the extent (one standard deviation): a bow of 2-8 % of the extent.
const BOW_SIGMA: f64 = 0.15;
/// The same around the ground's, where the ground is seen well.
const GROUND_BOW_SIGMA: f64 = 0.03;
/// The ground is looked for from this quantile of the heights over the mean plane, within these shares of the height
/// range, and is seen well where the last one holds this share of what is seen.
const GROUND_START: f64 = 0.25;
const GROUND_WINDOWS: [f64; 4] = [0.35, 0.22, 0.14, 0.1];
const LEAST_GROUND: f64 = 0.3;
/// A surface with less support lies on few strokes.
const SPARSE: f64 = 0.2;
/// Soft tops fade to nothing at this share of the relief under the surface.
const SOFT_SPAN: f64 = 0.5;
/// A bow must explain this much more of the tops than the plane does.
const BOW_GAIN: f64 = 1.04;

/// Heights of a view as points, scaled by the extent: u, v in about -0.5..0.5.
#[derive(Debug)]
pub(super) struct Samples {
    points: Points,
    /// Those of every other row and column: enough to come near the surface.
    few: Points,
    /// The plane through the middle of all heights.
    mean_plane: Coefficients,
    /// Where each point lies in the rendering, and the rendering's size.
    places: Vec<usize>,
    size: [usize; 2],
    centre: [f64; 2],
    extent: f64,
    range: f64,
}

/// A surface `z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2` in scaled units, and how well it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surface {
    coefficients: Coefficients,
    /// Share of the seen area that supports it, less what stands above it.
    pub(super) support: f64,
    /// Share of the seen area within the last window.
    pub(super) tops: f64,
    /// Root mean square of those, mesh units.
    pub(super) rms: f64,
}

impl Samples {
    /// The seen pixels of a rendering; `None` when fewer than 16 are seen.
    pub(super) fn new(heights: &Grid<f32>, view: &Viewport) -> Option<Self> {
        let back = view.px_from_plane.inverse()?;
        let extent = view.unit_per_px * heights.width().max(heights.height()) as f64;
        let centre = back.apply([
            (heights.width() - 1) as f64 / 2.0,
            (heights.height() - 1) as f64 / 2.0,
        ]);
        let size = [heights.width(), heights.height()];
        let (mut points, mut places) = (Points::default(), Vec::new());
        for y in 0..size[1] {
            for (x, z) in heights.row(y).iter().enumerate() {
                if *z != NO_HIT {
                    let [u, v] = back.apply([x as f64, y as f64]);
                    places.push(y * size[0] + x);
                    points.push([
                        (u - centre[0]) / extent,
                        (v - centre[1]) / extent,
                        f64::from(*z) / extent,
                    ]);
                }
            }
        }
        (points.len() >= 16).then(|| Self::of(points, places, size, centre, extent))
    }

    fn of(
        points: Points,
        places: Vec<usize>,
        size: [usize; 2],
        centre: [f64; 2],
        extent: f64,
    ) -> Self {
        let mut few = Points::default();
        for (point, place) in points.iter().zip(&places) {
            if (place % size[0]).is_multiple_of(2) && (place / size[0]).is_multiple_of(2) {
                few.push(point);
            }
        }
        let mean_plane = points.solve::<3>(&[0.0; 6], |_| 1.0, &OPEN);
        Self {
            range: height_range(points.residuals(&mean_plane)),
            points,
            few,
            mean_plane,
            places,
            size,
            centre,
            extent,
        }
    }

    /// The same points in another frame that leans little from this one.
    pub(super) fn turned(&self, other_from_this: &Rigid3) -> Self {
        let at = |[u, v, z]: [f64; 3]| {
            let [x, y] = [
                self.centre[0] + u * self.extent,
                self.centre[1] + v * self.extent,
            ];
            other_from_this.apply([x, y, z * self.extent])
        };
        let [x, y, _] = at([0.0; 3]);
        let mut points = Points::default();
        for point in self.points.iter() {
            let there = at(point);
            points.push([
                (there[0] - x) / self.extent,
                (there[1] - y) / self.extent,
                there[2] / self.extent,
            ]);
        }
        Self::of(points, self.places.clone(), self.size, [x, y], self.extent)
    }

    /// The surface over the tops; second-degree only when allowed and earned.
    pub(super) fn fit(&self, allow_bow: bool) -> Surface {
        let ground = self.mean_plane;
        let envelope = |r: f64| if r > 0.0 { ENVELOPE } else { 1.0 - ENVELOPE };
        let priors = self.priors(ground, BOW_SIGMA);
        let (few, few_beliefs) = self.seen_from_afar(&priors);
        let mut start = ground;
        for _ in 0..ENVELOPE_PASSES {
            start = few.solve::<3>(&start, envelope, &few_beliefs);
        }
        let plane = self.narrow::<3>(start, &priors);
        if !allow_bow {
            return plane;
        }
        let free = self.narrow::<6>(start, &priors);
        let sparse = free.support < SPARSE;
        let along = sparse.then(|| self.beliefs_along_ground()).flatten();
        let bent = along
            .map(|priors| self.narrow::<6>(start, &priors))
            .filter(|along| along.support > free.support)
            .unwrap_or(free);
        if bent.support > plane.support * BOW_GAIN {
            bent
        } else {
            plane
        }
    }

    /// Passes with a shrinking window below the surface.
    fn narrow<const TERMS: usize>(&self, start: Coefficients, priors: &[Prior; 6]) -> Surface {
        let few = self.seen_from_afar(priors);
        let mut c = start;
        for (k, window) in WINDOWS.map(|w| w * self.range).into_iter().enumerate() {
            let weight = |r| one_sided_weight(r, window);
            for _ in 0..NARROW_PASSES {
                c = if k < AFAR {
                    few.0.solve::<TERMS>(&c, weight, &few.1)
                } else {
                    self.points.solve::<TERMS>(&c, weight, priors)
                };
            }
        }
        self.judge(c)
    }

    /// The few points with priors that weigh as much beside them as those given do beside all.
    fn seen_from_afar(&self, priors: &[Prior; 6]) -> (&Points, [Prior; 6]) {
        let share = self.few.len() as f64 / self.points.len() as f64;
        let lighter = |prior: Prior| Prior {
            precision: prior.precision * share,
            ..prior
        };
        (&self.few, priors.map(lighter))
    }

    /// How well a surface holds at the narrowest window.
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
            rms: if tops > 0.0 {
                (squares / tops).sqrt() * self.extent
            } else {
                0.0
            },
        }
    }

    /// What the coefficients are taken to be where the tops say little: tilted and bent as `mean` is, the second degree
    /// within `bow_sigma`.
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

    /// The same where much of the ground is seen: a block bends as a whole, so the tops bend as the ground does. Few
    /// strokes would bend the surface as they like.
    fn beliefs_along_ground(&self) -> Option<[Prior; 6]> {
        let [a, b, c, ..] = self.mean_plane;
        let [_, _, _, p, q, r] = self.ground()?;
        Some(self.priors([a, b, c, p, q, r], GROUND_BOW_SIGMA))
    }

    /// The second-degree surface of the carved ground, where enough of it is seen.
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

    /// Residual of every seen pixel over a surface, mesh units.
    pub(super) fn residuals(&self, surface: &Surface) -> Vec<f64> {
        let mut residuals = self.points.residuals(&surface.coefficients);
        for r in &mut residuals {
            *r *= self.extent;
        }
        residuals
    }

    /// The same without a margin of the view: side walls, and a foot that juts out, are neither tops nor ground.
    pub(super) fn inner_residuals(&self, surface: &Surface) -> Vec<f64> {
        let [width, height] = self.size;
        let inside = |i: usize, side: usize| {
            let cut = (side as f64 * MARGIN) as usize;
            (cut..side - cut).contains(&i)
        };
        let residuals = self.residuals(surface);
        let seen = residuals.iter().zip(&self.places);
        let inner: Vec<f64> = seen
            .filter(|(_, place)| inside(*place % width, width) && inside(*place / width, height))
            .map(|(residual, _)| *residual)
            .collect();
        if inner.len() < 16 { residuals } else { inner }
    }

    /// Nearness to the surface as a picture: 1 on it, 0 from half the relief down.
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

    /// The plane through a surface's tops, `z = a + b x + c y` in plane coordinates and mesh units.
    ///
    /// Tops that run into the cut belong to neighbours: they tell the surface, but not where on it the character is.
    pub(super) fn plane_of_tops(&self, surface: &Surface) -> [f64; 3] {
        let c = surface.coefficients;
        let is_bent = c[3..].iter().any(|c| *c != 0.0);
        let plane = if is_bent { self.plane_in(&c) } else { c };
        let (b, c) = (plane[1], plane[2]);
        let a = plane[0] * self.extent - b * self.centre[0] - c * self.centre[1];
        [a, b, c]
    }

    /// The plane that lies best in a bent surface where the tops of the character are; where all else lies hardly
    /// counts.
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
        let precision = HARDLY * all.len() as f64;
        let priors = plane_of(&all, &OPEN).map(|mean| Prior { mean, precision });
        plane_of(&tops, &priors)
    }

    /// Where the tops of the character itself are; all tops where hardly any are left without those at the cut.
    fn own_tops(&self, c: &Coefficients) -> Mask {
        let window = WINDOWS[WINDOWS.len() - 1] * self.range;
        let [width, height] = self.size;
        let (mut tops, mut unknown) = (
            Mask::new(width, height, false),
            Mask::new(width, height, true),
        );
        for (r, place) in self.points.residuals(c).into_iter().zip(&self.places) {
            tops.data_mut()[*place] = r.abs() < window;
            unknown.data_mut()[*place] = false;
        }
        let cut_off = ConnectedComponents::label(&tops).touching(&unknown, CUT_PX);
        let own = Mask::from_fn(width, height, |x, y| tops.at(x, y) && !cut_off.at(x, y));
        if own.count() as f64 >= LEAST_OWN * tops.count() as f64 {
            own
        } else {
            tops
        }
    }

    /// The surface in plane coordinates and mesh units: coefficients of 1, x, y, x^2, xy, y^2.
    pub(super) fn in_plane_units(&self, surface: &Surface) -> [f64; 6] {
        let c = surface.coefficients;
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

/// Nearly all of heights over their mean plane.
fn height_range(mut residuals: Vec<f64>) -> f64 {
    (quantile(&mut residuals, 0.97) - quantile(&mut residuals, 0.03)).max(1e-9)
}

/// The value below which a share of the values lies; reorders them.
pub(in crate::stages) fn quantile(values: &mut [f64], share: f64) -> f64 {
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

/// Full weight just under the surface, fading to none at `window` below; above it heavier, but a spike of more
/// than three windows is not believed. Plain comparisons, so that several are weighed at a time.
#[inline(always)]
fn one_sided_weight(r: f64, window: f64) -> f64 {
    let below = smooth_weight(r, window);
    let near = if r > 0.0 { ABOVE } else { below };
    if r > 3.0 * window { 0.0 } else { near }
}

/// Full weight on the surface, fading to none at `window` from it.
#[inline(always)]
fn smooth_weight(r: f64, window: f64) -> f64 {
    let t = r / window;
    let near = 1.0 - t * t;
    let near = if near > 0.0 { near } else { 0.0 };
    near * near
}
