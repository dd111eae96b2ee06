//! Sub-pixel refinement of a pose by robust Gauss-Newton (Levenberg-Marquardt damping), and scores of poses.

use std::cell::OnceCell;
use std::rc::Rc;

use super::border_mask::valid_mask;
use super::candidate::PoseCandidate;
use super::gauss_newton::{Loss, NormalEquations, Workspace};
use super::overlap::{PlacedLevel, PoseOverlap};
use super::pyramid::{BilinearCell, PyramidLevel};
use super::tiebreak::tiebreak_scores;
use mocban_core::domain::Affine2;
use mocban_core::domain::cancel::poll;
use mocban_core::raster::Grid;
use mocban_core::simd::dispatch;

/// The refinement has converged if a step moves the level's border by less than this many working pixels.
const CONVERGED_PX: f64 = 0.03;
/// Number of pixels that are summed in single precision before the sum is added to a double-precision total.
const PIXELS_PER_SUM: usize = 256;

/// A fixed and a moving level prepared for the evaluation of many poses.
pub(crate) struct Refiner<'a> {
    fixed: &'a PyramidLevel,
    moving: &'a PyramidLevel,
    samples: Rc<FixedSamples>,
    cells: Rc<MovingCells>,
    size: [usize; 2],
    centre: [f64; 2],
    radius: f64,
    energies: [f64; 2],
    /// Valid mask of the fixed level, computed when first used.
    fixed_valid: OnceCell<Grid<f32>>,
}

/// What a moving level needs to be sampled.
struct MovingCells {
    /// Value, gradient in x and y, and weight of each pixel.
    cells: Vec<[f32; 4]>,
    energy: f64,
    /// Valid mask, computed when first used.
    valid: OnceCell<Grid<f32>>,
}

impl MovingCells {
    fn new(level: &PyramidLevel) -> Rc<Self> {
        Rc::new(Self {
            cells: cells(level),
            energy: level.energy(),
            valid: OnceCell::new(),
        })
    }
}

impl<'a> Refiner<'a> {
    /// Prepares a pair of levels.
    pub(crate) fn new(fixed: &'a PyramidLevel, moving: &'a PyramidLevel) -> Self {
        let samples = Rc::new(FixedSamples::new(fixed));
        Self::with_samples(samples, fixed, moving, MovingCells::new(moving))
    }

    /// Prepares another fixed level for the same moving level.
    pub(crate) fn on<'b>(&self, fixed: &'b PyramidLevel) -> Refiner<'b>
    where
        'a: 'b,
    {
        let samples = Rc::new(FixedSamples::new(fixed));
        Refiner::with_samples(samples, fixed, self.moving, Rc::clone(&self.cells))
    }

    /// Prepares several moving levels of the same place and size against one fixed level.
    pub(crate) fn for_levels(fixed: &'a PyramidLevel, moving: &'a [PyramidLevel]) -> Vec<Self> {
        let samples = Rc::new(FixedSamples::new(fixed));
        let with = |moving| {
            Self::with_samples(Rc::clone(&samples), fixed, moving, MovingCells::new(moving))
        };
        moving.iter().map(with).collect()
    }

    fn with_samples(
        samples: Rc<FixedSamples>,
        fixed: &'a PyramidLevel,
        moving: &'a PyramidLevel,
        cells: Rc<MovingCells>,
    ) -> Self {
        let centre = fixed.centre();
        Self {
            size: [moving.value.width(), moving.value.height()],
            centre,
            radius: centre[0].max(centre[1]).max(1.0),
            energies: [samples.energy, cells.energy],
            samples,
            cells,
            fixed_valid: OnceCell::new(),
            fixed,
            moving,
        }
    }

    /// Refines a pose so that the moving level predicts the fixed level, and scores the refined pose.
    ///
    /// Gain and offset of the moving values are estimated too. The loss determines the weights of the residuals. The
    /// refinement ends at convergence or after `max_steps` steps. Returns `start` unchanged if it has no inverse.
    pub(crate) fn refine(
        &self,
        start: &PoseCandidate,
        max_steps: usize,
        loss: Loss,
    ) -> PoseCandidate {
        let Some(mut from_fixed) = self.moving_from_fixed(&start.fixed_from_moving) else {
            return *start;
        };
        let mut workspace = Workspace::default();
        let mut damping = 1e-3;
        let mut best: Option<(NormalEquations, Affine2)> = None;
        for _ in 0..max_steps {
            poll();
            self.gather_correspondences(&from_fixed, &mut workspace);
            let step = NormalEquations::new(&mut workspace, start.mirrored, loss);
            if best.as_ref().is_none_or(|(best, _)| step.cost < best.cost) {
                best = Some((step, from_fixed));
                damping = (damping * 0.3_f64).max(1e-6);
            } else {
                damping = (damping * 8.0).max(1e-2);
            }
            let Some((equations, at)) = &best else { break };
            let Some(change) = equations.solve(damping) else {
                break;
            };
            let step_px = change[0].hypot(change[1]) * self.radius + change[2].hypot(change[3]);
            from_fixed = apply_update(at, &change, start.mirrored);
            if step_px < CONVERGED_PX || damping > 1e3 {
                break;
            }
        }
        let Some((equations, at)) = best else {
            return *start;
        };
        let refined = |fixed_from_moving| PoseCandidate {
            fixed_from_moving,
            score: self.normalize_score(equations.explained, &at),
            mirrored: start.mirrored,
        };
        self.fixed_from_moving(&at).map_or(*start, refined)
    }

    /// Scores a pose without changing it.
    pub(crate) fn evaluate(&self, pose: &PoseCandidate) -> PoseCandidate {
        let [score] = Self::scores(std::array::from_ref(self), pose);
        PoseCandidate { score, ..*pose }
    }

    /// Scores a pose with each refiner of [`Self::for_levels`]. All find a pixel at the same place in their moving level.
    pub(crate) fn scores<const N: usize>(refiners: &[Self; N], pose: &PoseCandidate) -> [f64; N] {
        let Some(first) = refiners.first() else {
            return [0.0; N];
        };
        let Some(from_fixed) = first.moving_from_fixed(&pose.fixed_from_moving) else {
            return [0.0; N];
        };
        let products = first.products(
            &from_fixed,
            #[inline(always)]
            |place, _, _| {
                let mut values = [0.0; N];
                if let Some(cell) = BilinearCell::at_single(first.size, place) {
                    for (value, refiner) in values.iter_mut().zip(refiners) {
                        *value = cell.value(&refiner.moving.value);
                    }
                }
                values
            },
        );
        std::array::from_fn(|k| refiners[k].normalize_score(products[k], &from_fixed))
    }

    /// Computes how much of each level is covered by the other at a pose.
    pub(crate) fn overlap(&self, pose: &PoseCandidate) -> PoseOverlap {
        let placed = self.placed(pose);
        let overlap = |placed| PoseOverlap::new(self.fixed, self.fixed_valid(), &placed);
        placed.map_or_else(PoseOverlap::default, overlap)
    }

    /// Scores two poses on the pixels that are valid for both: `pose` with this moving level, and `rival` with the
    /// moving level of `other`. Returns zeros if either pose has no inverse.
    pub(crate) fn tiebreak_scores(
        &self,
        pose: &PoseCandidate,
        other: &Self,
        rival: &PoseCandidate,
    ) -> [f64; 2] {
        match (self.placed(pose), other.placed(rival)) {
            (Some(one), Some(two)) => tiebreak_scores(self.fixed, self.fixed_valid(), &[one, two]),
            _ => [0.0; 2],
        }
    }

    /// Scores a pose on the pixels that are valid for it, see [`Self::tiebreak_scores`].
    pub(crate) fn local_score(&self, pose: &PoseCandidate) -> f64 {
        self.tiebreak_scores(pose, self, pose)[0]
    }

    /// Calls a function with the position in the fixed image of each pixel that is valid in both levels at two poses, and
    /// with the differences of the amounts there, fixed minus moving.
    pub(crate) fn each_difference(
        &self,
        poses: [&PoseCandidate; 2],
        mut visit: impl FnMut([f64; 2], [f32; 2]),
    ) -> Option<()> {
        let image_from_work = self.fixed.work_from_image.inverse()?;
        let [one, two] = poses.map(|pose| self.placed(pose));
        let (one, two) = (one?, two?);
        one.each_common_pixel(&self.fixed.weight, |x, y, at_one| {
            let Some(at_two) = two.cell(x, y) else {
                return;
            };
            let amounts = [at_one, at_two].map(|cell| cell.value(&self.moving.amount));
            let differences = amounts.map(|amount| self.fixed.amount.at(x, y) - amount);
            visit(image_from_work.apply([x as f64, y as f64]), differences);
        });
        Some(())
    }

    /// Returns the moving level at a pose; `None` if the pose has no inverse.
    fn placed(&self, pose: &PoseCandidate) -> Option<PlacedLevel<'_>> {
        let to_middle = Affine2::scale_shift(1.0, self.centre.map(|c| -c));
        let into = self.moving_from_fixed(&pose.fixed_from_moving)?;
        Some(PlacedLevel {
            moving: self.moving,
            valid: self.cells.valid.get_or_init(|| valid_mask(self.moving)),
            moving_from_fixed: into.after(&to_middle),
        })
    }

    fn fixed_valid(&self) -> &Grid<f32> {
        self.fixed_valid.get_or_init(|| valid_mask(self.fixed))
    }

    /// Inverts a map between image pixels, and converts it to working pixels. Positions in the fixed level are relative
    /// to its centre. Returns `None` if the map has no inverse.
    fn moving_from_fixed(&self, fixed_from_moving: &Affine2) -> Option<Affine2> {
        let image = fixed_from_moving.inverse()?;
        let from_work = self.fixed.work_from_image.inverse()?;
        let from_middle = Affine2::scale_shift(1.0, self.centre);
        let into = self.moving.work_from_image.after(&image).after(&from_work);
        Some(into.after(&from_middle))
    }

    /// Undoes `moving_from_fixed`: converts a map to image pixels and inverts it.
    fn fixed_from_moving(&self, from_fixed: &Affine2) -> Option<Affine2> {
        let to_image = self.moving.work_from_image.inverse()?;
        let to_middle = Affine2::scale_shift(1.0, self.centre.map(|c| -c));
        to_image
            .after(from_fixed)
            .after(&to_middle)
            .after(&self.fixed.work_from_image)
            .inverse()
    }

    /// Collects the correspondence of each sampled fixed pixel.
    fn gather_correspondences(&self, from_fixed: &Affine2, workspace: &mut Workspace) {
        workspace.reset(self.samples.places.len());
        let [product] = self.products(
            from_fixed,
            #[inline(always)]
            |[u, v], place, value| {
                [self.sample_cell(u, v).map_or(0.0, |cell| {
                    workspace.push(value, cell, place);
                    cell[0]
                })]
            },
        );
        workspace.finish(product);
    }

    /// Sums `fixed value * moving value` over the sampled pixels, for each of the values that `moving_values` returns. Its
    /// arguments are the position in the moving level, the position in the fixed level, and the fixed value.
    #[inline(always)]
    fn products<const N: usize>(
        &self,
        from_fixed: &Affine2,
        mut moving_values: impl FnMut([f32; 2], [f32; 2], f32) -> [f32; N],
    ) -> [f64; N] {
        let FixedSamples { places, values, .. } = &*self.samples;
        let [a, b] = from_fixed.0.map(|row| row.map(|v| v as f32));
        let runs = places
            .chunks(PIXELS_PER_SUM)
            .zip(values.chunks(PIXELS_PER_SUM));
        let mut products = [0.0_f64; N];
        dispatch!({
            for (places, values) in runs {
                let mut parts = [0.0_f32; N];
                for ([x, y], value) in places.iter().zip(values) {
                    let u = a[0] * x + a[1] * y + a[2];
                    let v = b[0] * x + b[1] * y + b[2];
                    let moving = moving_values([u, v], [*x, *y], *value);
                    for k in 0..N {
                        parts[k] += moving[k] * value;
                    }
                }
                for k in 0..N {
                    products[k] += f64::from(parts[k]);
                }
            }
        });
        products
    }

    /// Interpolates value, gradient and weight of the moving level. Returns `None` outside the level.
    #[inline(always)]
    fn sample_cell(&self, u: f32, v: f32) -> Option<[f32; 4]> {
        let cell = BilinearCell::at_single(self.size, [u, v])?;
        let (from, [fx, fy]) = (cell.from, cell.fraction);
        let cells = &self.cells.cells;
        let (above, below) = (&cells[from..from + 2], &cells[from + self.size[0]..][..2]);
        let (top, bottom) = (lerp(above[0], above[1], fx), lerp(below[0], below[1], fx));
        Some(lerp(top, bottom, fy))
    }

    /// Converts a sum of products over the sampled pixels to a correlation, using the energies of both levels.
    fn normalize_score(&self, product: f64, from_fixed: &Affine2) -> f64 {
        // Moving pixels per fixed pixel.
        let area = from_fixed.determinant().abs().max(1e-12);
        let energy = (self.energies[0] * self.energies[1] / area).sqrt();
        product / self.samples.known_share / energy.max(1e-12)
    }
}

/// Interpolates linearly. Uses a loop, because calls of closures may not be inlined and would prevent vectorisation.
#[inline(always)]
fn lerp(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    let mut mixed = a;
    for k in 0..4 {
        mixed[k] += (b[k] - a[k]) * share;
    }
    mixed
}

/// The sampled pixels of a fixed level.
struct FixedSamples {
    /// Positions of the sampled pixels, relative to the level's centre. Every second known pixel is sampled, as on one
    /// colour of a chessboard, because neighbouring pixels of a smooth level are nearly equal.
    places: Vec<[f32; 2]>,
    values: Vec<f32>,
    /// Fraction of the known pixels that is sampled.
    known_share: f64,
    /// Sum of squared values of the whole level.
    energy: f64,
}

impl FixedSamples {
    fn new(level: &PyramidLevel) -> Self {
        let centre = level.centre().map(|c| c as f32);
        let (width, height) = (level.value.width(), level.value.height());
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in (y % 2..width).step_by(2) {
                if level.weight.at(x, y) > 0.0 {
                    places.push([x as f32 - centre[0], y as f32 - centre[1]]);
                    values.push(level.value.at(x, y));
                }
            }
        }
        let known = level.weight.data().iter().filter(|w| **w > 0.0).count();
        Self {
            known_share: places.len().max(1) as f64 / known.max(1) as f64,
            places,
            values,
            energy: level.energy(),
        }
    }
}

/// Adds a small similarity about the fixed level's centre to a map.
fn apply_update(map: &Affine2, change: &[f64; 6], mirrored: bool) -> Affine2 {
    let [a, b, tx, ty, _, _] = *change;
    let s = if mirrored { -1.0 } else { 1.0 };
    let [p, q] = map.0;
    Affine2([
        [p[0] + a, p[1] - b * s, p[2] + tx],
        [q[0] + b, q[1] + a * s, q[2] + ty],
    ])
}

/// Returns value, central differences and weight of each pixel.
fn cells(level: &PyramidLevel) -> Vec<[f32; 4]> {
    let (width, height) = (level.value.width(), level.value.height());
    let mut cells = Vec::with_capacity(width * height);
    for y in 0..height {
        let [above, row, below] =
            [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| level.value.row(y));
        let weights = level.weight.row(y);
        let cell = |x: usize| {
            let slope_x = (row[(x + 1).min(width - 1)] - row[x.saturating_sub(1)]) * 0.5;
            let slope_y = (below[x] - above[x]) * 0.5;
            [row[x], slope_x, slope_y, weights[x]]
        };
        cells.push(cell(0));
        let columns = above.iter().zip(below).zip(weights).skip(1);
        cells.extend(
            row.windows(3)
                .zip(columns)
                .map(|(near, ((above, below), weight))| {
                    [
                        near[1],
                        (near[2] - near[0]) * 0.5,
                        (below - above) * 0.5,
                        *weight,
                    ]
                }),
        );
        if width > 1 {
            cells.push(cell(width - 1));
        }
    }
    cells
}
