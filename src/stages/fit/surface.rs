//! A one-sided robust surface over what stands highest in a height map.
//!
//! Tops of strokes are the original face of the block: much lies below them, nothing above. So a point above the
//! surface costs much, one far below it nothing at all.

use nalgebra::{Matrix6, Vector6};

use crate::raster::{Grid, Mask};
use crate::stages::components::Components;
use crate::stages::pose::Soft;
use crate::stages::zbuffer::{NOTHING, View};

/// Expectile of the first, convex pass: points above weigh this, points below one less it.
const ENVELOPE: f64 = 0.97;
/// Weight of a point above the surface in the passes that follow.
const ABOVE: f64 = 3.0;
/// How far below the surface a point still counts, as a share of the height range, pass by pass.
const WINDOWS: [f64; 5] = [0.35, 0.22, 0.14, 0.10, 0.08];
/// Passes of the first kind, and of each window.
const ENVELOPE_PASSES: usize = 8;
const NARROW_PASSES: usize = 2;
/// Tops this close to the cut, in pixels of the rendering, run into it.
const CUT_PX: i64 = 2;
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
    points: Vec<[f64; 3]>,
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
    coefficients: [f64; 6],
    /// Share of the seen area that supports it, less what stands above it.
    pub(super) support: f64,
    /// Share of the seen area within the last window.
    pub(super) tops: f64,
    /// Root mean square of those, mesh units.
    pub(super) rms: f64,
}

impl Samples {
    /// The seen pixels of a rendering; `None` when fewer than 16 are seen.
    pub(super) fn new(heights: &Grid<f32>, view: &View) -> Option<Self> {
        let back = view.px_from_plane.inverse()?;
        let extent = view.unit_per_px * heights.width().max(heights.height()) as f64;
        let centre = back.apply([
            (heights.width() - 1) as f64 / 2.0,
            (heights.height() - 1) as f64 / 2.0,
        ]);
        let (mut points, mut places) = (Vec::new(), Vec::new());
        for y in 0..heights.height() {
            for (x, z) in heights.row(y).iter().enumerate() {
                if *z != NOTHING {
                    let [u, v] = back.apply([x as f64, y as f64]);
                    places.push(y * heights.width() + x);
                    points.push([
                        (u - centre[0]) / extent,
                        (v - centre[1]) / extent,
                        f64::from(*z) / extent,
                    ]);
                }
            }
        }
        (points.len() >= 16).then(|| {
            let mut samples = Self {
                points,
                places,
                size: [heights.width(), heights.height()],
                centre,
                extent,
                range: 0.0,
            };
            samples.range = samples.height_range();
            samples
        })
    }

    /// Nearly all of the heights over their mean plane, in units of the extent.
    fn height_range(&self) -> f64 {
        let plane = self.mean_plane();
        let mut residuals: Vec<f64> = self
            .points
            .iter()
            .map(|p| p[2] - value(&plane, p))
            .collect();
        (quantile(&mut residuals, 0.97) - quantile(&mut residuals, 0.03)).max(1e-9)
    }

    fn mean_plane(&self) -> [f64; 6] {
        solve::<3>(self.points.iter().map(|p| (*p, 1.0)), None)
    }

    /// The surface over the tops; second-degree only when allowed and earned.
    pub(super) fn fit(&self, allow_bow: bool) -> Surface {
        let ground = self.mean_plane();
        let envelope = |r: f64| if r > 0.0 { ENVELOPE } else { 1.0 - ENVELOPE };
        let mut start = ground;
        for _ in 0..ENVELOPE_PASSES {
            start = solve::<3>(self.weighed(&start, envelope), Some(self.prior(ground)));
        }
        let plane = self.narrow::<3>(start, self.prior(ground));
        if !allow_bow {
            return plane;
        }
        let free = self.narrow::<6>(start, self.prior(ground));
        let sparse = free.support < SPARSE;
        let prior = sparse.then(|| self.prior_along_ground(ground)).flatten();
        let bent = prior
            .map(|prior| self.narrow::<6>(start, prior))
            .filter(|along| along.support > free.support)
            .unwrap_or(free);
        if bent.support > plane.support * BOW_GAIN {
            bent
        } else {
            plane
        }
    }

    /// Passes with a shrinking window below the surface.
    fn narrow<const TERMS: usize>(&self, start: [f64; 6], prior: Prior) -> Surface {
        let mut c = start;
        for window in WINDOWS.map(|w| w * self.range) {
            for _ in 0..NARROW_PASSES {
                let points = self.weighed(&c, |r| one_sided_weight(r, window));
                c = solve::<TERMS>(points, Some(prior));
            }
        }
        self.judge(c)
    }

    /// How well a surface holds at the narrowest window.
    fn judge(&self, coefficients: [f64; 6]) -> Surface {
        let w = WINDOWS[WINDOWS.len() - 1] * self.range;
        let (mut support, mut tops, mut squares) = (0.0, 0.0, 0.0);
        for p in &self.points {
            let r = p[2] - value(&coefficients, p);
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

    /// Points with the weight that their residual over a surface earns.
    fn weighed<'a>(
        &'a self,
        c: &'a [f64; 6],
        weight: impl Fn(f64) -> f64 + 'a,
    ) -> impl Iterator<Item = ([f64; 3], f64)> + 'a {
        self.points
            .iter()
            .map(move |p| (*p, weight(p[2] - value(c, p))))
    }

    /// The prior: tilt near the ground's, little bow.
    fn prior(&self, ground: [f64; 6]) -> Prior {
        Prior {
            mean: ground,
            bow_sigma: BOW_SIGMA,
            noise: CORRELATED_PX * (TOP_SIGMA * self.range).powi(2),
        }
    }

    /// The same where much of the ground is seen: a block bends as a whole, so the tops bend as the ground does. Few
    /// strokes would bend the surface as they like.
    fn prior_along_ground(&self, mean_plane: [f64; 6]) -> Option<Prior> {
        let [a, b, c, ..] = mean_plane;
        let [_, _, _, bow @ ..] = self.ground(mean_plane)?;
        Some(Prior {
            mean: [a, b, c, bow[0], bow[1], bow[2]],
            bow_sigma: GROUND_BOW_SIGMA,
            ..self.prior(mean_plane)
        })
    }

    /// The second-degree surface of the carved ground, where enough of it is seen.
    fn ground(&self, mean_plane: [f64; 6]) -> Option<[f64; 6]> {
        let mut c = mean_plane;
        let mut residuals: Vec<f64> = self.points.iter().map(|p| p[2] - value(&c, p)).collect();
        c[0] += quantile(&mut residuals, GROUND_START);
        for window in GROUND_WINDOWS.map(|w| w * self.range) {
            for _ in 0..NARROW_PASSES {
                let weight = |r: f64| (1.0 - (r / window).powi(2)).max(0.0).powi(2);
                c = solve::<6>(self.weighed(&c, weight), Some(self.prior(mean_plane)));
            }
        }
        let window = GROUND_WINDOWS[GROUND_WINDOWS.len() - 1] * self.range;
        let near = |p: &&[f64; 3]| (p[2] - value(&c, p)).abs() < window;
        let share = self.points.iter().filter(near).count() as f64 / self.points.len() as f64;
        (share > LEAST_GROUND).then_some(c)
    }

    /// Residual of every seen pixel over a surface, mesh units.
    pub(super) fn residuals(&self, surface: &Surface) -> Vec<f64> {
        self.points
            .iter()
            .map(|p| (p[2] - value(&surface.coefficients, p)) * self.extent)
            .collect()
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
    pub(super) fn soft_tops(&self, surface: &Surface, relief: f64) -> Soft {
        let [width, height] = self.size;
        let mut soft = Soft {
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
        let own = self.own_tops(&c);
        let on_surface = self.points.iter().zip(&self.places).map(|(p, place)| {
            let weight = if own.data()[*place] { 1.0 } else { 1e-6 };
            ([p[0], p[1], value(&c, p)], weight)
        });
        let plane = solve::<3>(on_surface, None);
        let (b, c) = (plane[1], plane[2]);
        let a = plane[0] * self.extent - b * self.centre[0] - c * self.centre[1];
        [a, b, c]
    }

    /// Where the tops of the character itself are; all tops where hardly any are left without those at the cut.
    fn own_tops(&self, c: &[f64; 6]) -> Mask {
        let window = WINDOWS[WINDOWS.len() - 1] * self.range;
        let [width, height] = self.size;
        let (mut tops, mut unknown) = (
            Mask::new(width, height, false),
            Mask::new(width, height, true),
        );
        for (p, place) in self.points.iter().zip(&self.places) {
            tops.data_mut()[*place] = (p[2] - value(c, p)).abs() < window;
            unknown.data_mut()[*place] = false;
        }
        let cut_off = Components::of(&tops).near(&unknown, CUT_PX);
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

/// What a surface is taken to be where the tops say little.
#[derive(Debug, Clone, Copy)]
struct Prior {
    mean: [f64; 6],
    /// Of the second-degree coefficients.
    bow_sigma: f64,
    noise: f64,
}

/// Weighted least squares over the first `TERMS` (3 or 6) of the basis.
fn solve<const TERMS: usize>(
    points: impl Iterator<Item = ([f64; 3], f64)>,
    prior: Option<Prior>,
) -> [f64; 6] {
    let mut sums = [[0.0_f64; TERMS]; TERMS];
    let mut right = [0.0_f64; TERMS];
    for (p, w) in points.filter(|(_, w)| *w > 0.0) {
        let basis = basis(&p);
        for i in 0..TERMS {
            let weighed = w * basis[i];
            right[i] += weighed * p[2];
            for j in 0..=i {
                sums[i][j] += weighed * basis[j];
            }
        }
    }
    if let Some(prior) = prior {
        for k in 1..TERMS {
            let sigma = if k < 3 { TILT_SIGMA } else { prior.bow_sigma };
            let precision = prior.noise / (sigma * sigma);
            sums[k][k] += precision;
            right[k] += precision * prior.mean[k];
        }
    }
    let mut normal = Matrix6::<f64>::identity();
    let mut side = Vector6::<f64>::zeros();
    for i in 0..TERMS {
        side[i] = right[i];
        for j in 0..=i {
            normal[(i, j)] = sums[i][j];
            normal[(j, i)] = sums[i][j];
        }
        normal[(i, i)] += 1e-12;
    }
    normal
        .cholesky()
        .map_or([0.0; 6], |factor| factor.solve(&side).into())
}

/// The value below which a share of the values lies; reorders them.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

fn basis(p: &[f64; 3]) -> [f64; 6] {
    let [u, v, _] = *p;
    [1.0, u, v, u * u, u * v, v * v]
}

fn value(c: &[f64; 6], p: &[f64; 3]) -> f64 {
    let b = basis(p);
    (0..6).map(|i| c[i] * b[i]).sum()
}

/// Full weight just under the surface, fading to none at `window` below; above it heavier, but a spike of more
/// than three windows is not believed.
fn one_sided_weight(r: f64, window: f64) -> f64 {
    if r > 3.0 * window {
        0.0
    } else if r > 0.0 {
        ABOVE
    } else {
        let t = r / window;
        if t > -1.0 { (1.0 - t * t).powi(2) } else { 0.0 }
    }
}
