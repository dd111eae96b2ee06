//! One Gauss-Newton step: what each pixel of the fixed layer meets, weighed, summed to normal equations.

use nalgebra::{Matrix6, Vector6};

use crate::simd::dispatch;

/// Residuals beyond this many of their median count less: what stands on one side only must not decide.
const ROBUST: f32 = 2.5;
/// Residuals beyond this share of full ink belong to what is lost or was added: they do not count at all.
const FAR: f32 = 0.5;
/// Pixels whose sums are kept apart, so that they are added side by side.
const LANES: usize = 8;
/// Looks summed in single precision before their sums go to the others, in [`LANES`].
const RUN: usize = 128;
/// Products of a row of the normal equations with itself, lower triangle, then with the residual.
const SUMS: usize = 21 + 6;

/// What a residual costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::stages) enum Loss {
    /// Large residuals count less: from afar.
    Huber,
    /// Large residuals do not count: once the pose is nearly right.
    Tukey,
}

/// A few looks side by side.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Looks {
    /// The fixed layer's value.
    fixed: [f32; LANES],
    /// The moving layer's value, slope in x and y, and weight.
    met: [[f32; 4]; LANES],
    /// Place in the fixed layer, relative to its middle: x of each, then y.
    place: [[f32; LANES]; 2],
}

/// Buffers of one refinement.
#[derive(Default)]
pub(super) struct Room {
    /// The last one may be filled only in part, with zeros after.
    looks: Vec<Looks>,
    count: usize,
    /// Sum of the products of all values that met.
    explained: f64,
    sizes: Vec<f32>,
}

impl Room {
    /// Makes room for this many looks, and one that does not count.
    pub(super) fn clear(&mut self, most: usize) {
        self.looks.resize(most / LANES + 1, Looks::default());
        self.count = 0;
    }

    /// Takes in a look if the moving layer is known there.
    #[inline(always)]
    pub(super) fn put(&mut self, fixed: f32, met: [f32; 4], [x, y]: [f32; 2]) {
        let lane = self.count % LANES;
        let looks = &mut self.looks[self.count / LANES];
        looks.fixed[lane] = fixed;
        looks.met[lane] = met;
        looks.place[0][lane] = x;
        looks.place[1][lane] = y;
        self.count += usize::from(met[3] >= 0.5);
    }

    /// Leaves only what was taken in; `explained` is the sum of the products of all values that met.
    pub(super) fn close(&mut self, explained: f64) {
        self.explained = explained;
        self.looks.truncate(self.count.div_ceil(LANES));
        let held = (self.count + LANES - 1) % LANES + 1;
        if let Some(last) = self.looks.last_mut() {
            for lane in held..LANES {
                last.fixed[lane] = 0.0;
                last.met[lane] = [0.0; 4];
            }
        }
    }

    /// Least-squares gain and offset of the fixed values over the moving ones; the gain never below a trifle.
    fn gain_and_offset(&self) -> (f32, f32) {
        let looks = &self.looks;
        let totals = dispatch(
            #[inline(always)]
            || {
                let mut totals = [0.0_f64; 4];
                for looks in looks.chunks(RUN) {
                    let mut sums = [[0.0_f32; LANES]; 4];
                    for looks in looks {
                        for k in 0..LANES {
                            let (a, b) = (looks.fixed[k], looks.met[k][0]);
                            sums[0][k] += a;
                            sums[1][k] += b;
                            sums[2][k] += a * b;
                            sums[3][k] += b * b;
                        }
                    }
                    for (lanes, total) in sums.iter().zip(&mut totals) {
                        *total += lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
                    }
                }
                totals
            },
        );
        let n = self.count.max(1) as f64;
        let [f, m, fm, mm] = totals.map(|total| total / n);
        let gain = ((fm - f * m) / (mm - m * m).max(1e-9)).max(0.05);
        (gain as f32, (f - gain * m) as f32)
    }

    /// Median size of the residuals at a gain and offset.
    fn median_residual(&mut self, gain: f32, offset: f32) -> f32 {
        self.sizes.clear();
        for looks in &self.looks {
            let residual = |k: usize| looks.fixed[k] - gain * looks.met[k][0] - offset;
            let sizes: [f32; LANES] = std::array::from_fn(|k| residual(k).abs());
            self.sizes.extend(sizes);
        }
        self.sizes.truncate(self.count);
        median(&mut self.sizes)
    }
}

/// Normal equations at one pose: four of the pose, gain and offset of the values.
pub(super) struct Step {
    /// The last is the cost before it was shared out.
    sums: [f64; SUMS + 1],
    pub(super) cost: f64,
    /// Sum of the products of all values that met.
    pub(super) explained: f64,
}

impl Step {
    /// Sums up what was met.
    pub(super) fn of(room: &mut Room, mirrored: bool, loss: Loss) -> Self {
        let (gain, offset) = room.gain_and_offset();
        let limit = match loss {
            Loss::Huber => ROBUST * room.median_residual(gain, offset).max(1e-4),
            Loss::Tukey => FAR,
        };
        let (looks, count, fit) = (&room.looks, room.count, [gain, offset, limit]);
        // Sums and looks of its own: what may lie in one place is not computed side by side.
        let totals = dispatch(
            #[inline(always)]
            || {
                let mut totals = [0.0_f64; SUMS + 1];
                for (run, looks) in looks.chunks(RUN).enumerate() {
                    let mut sums = [[0.0_f32; LANES]; SUMS + 1];
                    for (k, looks) in looks.iter().enumerate() {
                        let held = LANES.min(count - (run * RUN + k) * LANES);
                        let looks = *looks;
                        add(&mut sums, &looks, held, mirrored, fit, loss);
                    }
                    for (lanes, total) in sums.iter().zip(&mut totals) {
                        *total += lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
                    }
                }
                totals
            },
        );
        let mean = totals[SUMS] / room.count as f64;
        Self {
            cost: if room.count == 0 { f64::INFINITY } else { mean },
            sums: totals,
            explained: room.explained,
        }
    }

    pub(super) fn solve(&self, damping: f64) -> Option<[f64; 6]> {
        let mut normal = Matrix6::zeros();
        let mut at = 0;
        for i in 0..6 {
            for j in 0..=i {
                normal[(i, j)] = self.sums[at];
                normal[(j, i)] = self.sums[at];
                at += 1;
            }
        }
        for i in 0..6 {
            normal[(i, i)] = normal[(i, i)] * (1.0 + damping) + 1e-12;
        }
        let right = Vector6::from_fn(|i, _| self.sums[21 + i]);
        Some(normal.cholesky()?.solve(&right).into())
    }
}

fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let k = values.len() / 2;
    *values.select_nth_unstable_by(k, f32::total_cmp).1
}

/// Adds the products of a few looks, side by side, to the sums of the normal equations and of the cost.
#[inline(always)]
fn add(
    sums: &mut [[f32; LANES]; SUMS + 1],
    looks: &Looks,
    held: usize,
    mirrored: bool,
    [gain, offset, limit]: [f32; 3],
    loss: Loss,
) {
    let s = if mirrored { -1.0 } else { 1.0 };
    let [x, y] = &looks.place;
    let (mut residual, mut weight, mut cost) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    // In the order of the unknowns: two of turn and scale, two of shift, gain and offset.
    let mut row = [[1.0; LANES]; 6];
    for k in 0..LANES {
        let [m, gx, gy, _] = looks.met[k];
        residual[k] = looks.fixed[k] - gain * m - offset;
        row[0][k] = gain * (gx * x[k] + gy * y[k] * s);
        row[1][k] = gain * (gy * x[k] - gx * y[k] * s);
        row[2][k] = gain * gx;
        row[3][k] = gain * gy;
        row[4][k] = m;
    }
    loss.weigh(&residual, limit, &mut weight, &mut cost);
    weight[held..].fill(0.0);
    cost[held..].fill(0.0);
    let mut at = 0;
    for i in 0..6 {
        let mut weighed = [0.0; LANES];
        for k in 0..LANES {
            weighed[k] = weight[k] * row[i][k];
        }
        for other in &row[..=i] {
            for k in 0..LANES {
                sums[at][k] += weighed[k] * other[k];
            }
            at += 1;
        }
        for k in 0..LANES {
            sums[21 + i][k] += weighed[k] * residual[k];
        }
    }
    for k in 0..LANES {
        sums[SUMS][k] += cost[k];
    }
}

impl Loss {
    /// Weights of residuals and their costs, so that steps are judged by what they minimise.
    #[inline(always)]
    fn weigh(
        self,
        residual: &[f32; LANES],
        limit: f32,
        weight: &mut [f32; LANES],
        cost: &mut [f32; LANES],
    ) {
        match self {
            Self::Huber => {
                for k in 0..LANES {
                    let size = residual[k].abs();
                    let is_far = size > limit;
                    weight[k] = if is_far { limit / size } else { 1.0 };
                    let far = limit * (2.0 * size - limit);
                    cost[k] = if is_far { far } else { size * size };
                }
            }
            Self::Tukey => {
                for k in 0..LANES {
                    let share = residual[k].abs() / limit;
                    let near = 1.0 - share * share;
                    let near = if near > 0.0 { near } else { 0.0 };
                    weight[k] = near * near;
                    cost[k] = limit * limit / 3.0 * (1.0 - near * near * near);
                }
            }
        }
    }
}
