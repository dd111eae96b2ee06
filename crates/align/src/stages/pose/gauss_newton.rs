//! One Gauss-Newton step: correspondences between two levels, robust weights, normal equations.
//!
//! The unknowns are two for rotation and scale, two for the shift, and the gain and offset of the moving values.

use nalgebra::{Matrix6, Vector6};

use mocban_core::simd::dispatch;

/// Threshold of Huber's loss, as a multiple of the median absolute residual (Huber 1964, doi:10.1214/aoms/1177703732).
const HUBER_MEDIANS: f32 = 2.5;
/// Cutoff of Tukey's biweight, as a fraction of full ink. Larger residuals have no weight, because they come from
/// strokes that one of the images lacks.
const TUKEY_CUTOFF: f32 = 0.5;
/// Number of lanes in the sums: one SIMD vector.
const LANES: usize = 8;
/// Number of blocks that are summed in single precision before the sum is added to a double-precision total.
const BLOCKS_PER_SUM: usize = 128;
/// Number of sums in the normal equations: the lower triangle of the 6 x 6 matrix, then the right-hand side.
const SUM_COUNT: usize = 21 + 6;

/// The loss of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loss {
    /// Large residuals count less. For starts far from the optimum.
    Huber,
    /// Large residuals do not count. For starts near the optimum.
    Tukey,
}

/// A block of correspondences, one per lane.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Correspondences {
    /// Value in the fixed level.
    fixed: [f32; LANES],
    /// Value, gradient in x and y, and weight in the moving level.
    moving: [[f32; 4]; LANES],
    /// x and y in the fixed level relative to its centre, pixels.
    place: [[f32; LANES]; 2],
}

/// Buffers that are reused between steps.
#[derive(Default)]
pub(super) struct Workspace {
    /// The last block with correspondences is padded with zeros. Blocks after it are of earlier steps.
    blocks: Vec<Correspondences>,
    count: usize,
    /// Sum of products of corresponding values.
    explained: f64,
    /// Bits of the absolute residuals, which are ordered like these.
    residual_sizes: Vec<u32>,
}

impl Workspace {
    /// Makes room for `most` correspondences and one that is discarded.
    pub(super) fn reset(&mut self, most: usize) {
        let blocks = self.blocks.len().max(most / LANES + 1);
        self.blocks.resize(blocks, Correspondences::default());
        self.count = 0;
    }

    /// Appends a correspondence if the moving level is known there.
    #[inline(always)]
    pub(super) fn push(&mut self, fixed: f32, moving: [f32; 4], [x, y]: [f32; 2]) {
        let lane = self.count % LANES;
        let block = &mut self.blocks[self.count / LANES];
        block.fixed[lane] = fixed;
        block.moving[lane] = moving;
        block.place[0][lane] = x;
        block.place[1][lane] = y;
        self.count += usize::from(moving[3] >= 0.5);
    }

    /// Pads the last block. `explained` is the sum of `fixed value * moving value`.
    pub(super) fn finish(&mut self, explained: f64) {
        self.explained = explained;
        let filled = self.count % LANES;
        if filled > 0 {
            let last = &mut self.blocks[self.count / LANES];
            for lane in filled..LANES {
                last.fixed[lane] = 0.0;
                last.moving[lane] = [0.0; 4];
            }
        }
    }

    /// Returns the appended correspondences.
    fn filled_blocks(&self) -> &[Correspondences] {
        &self.blocks[..self.count.div_ceil(LANES)]
    }

    /// Fits `fixed = gain * moving + offset` by least squares. Returns the gain, at least 0.05, and the offset.
    fn gain_and_offset(&self) -> (f32, f32) {
        let totals = sum_blocks::<4>(
            self.filled_blocks(),
            #[inline(always)]
            |sums, block, _| {
                for k in 0..LANES {
                    let (a, b) = (block.fixed[k], block.moving[k][0]);
                    sums[0][k] += a;
                    sums[1][k] += b;
                    sums[2][k] += a * b;
                    sums[3][k] += b * b;
                }
            },
        );
        let n = self.count.max(1) as f64;
        let [f, m, fm, mm] = totals.map(|total| total / n);
        let gain = ((fm - f * m) / (mm - m * m).max(1e-9)).max(0.05);
        (gain as f32, (f - gain * m) as f32)
    }

    /// Returns the median of the absolute residuals.
    fn median_residual(&mut self, gain: f32, offset: f32) -> f32 {
        self.residual_sizes.clear();
        for block in &self.blocks[..self.count.div_ceil(LANES)] {
            let residual = |k: usize| block.fixed[k] - gain * block.moving[k][0] - offset;
            let residual_sizes: [u32; LANES] = std::array::from_fn(|k| residual(k).abs().to_bits());
            self.residual_sizes.extend(residual_sizes);
        }
        self.residual_sizes.truncate(self.count);
        f32::from_bits(median(&mut self.residual_sizes))
    }
}

/// Normal equations at one pose.
pub(super) struct NormalEquations {
    /// The last element is the sum of the losses.
    sums: [f64; SUM_COUNT + 1],
    pub(super) cost: f64,
    /// Sum of products of corresponding values.
    pub(super) explained: f64,
}

impl NormalEquations {
    /// Accumulates the normal equations of all correspondences.
    pub(super) fn new(workspace: &mut Workspace, mirrored: bool, loss: Loss) -> Self {
        let (gain, offset) = workspace.gain_and_offset();
        let cutoff = match loss {
            Loss::Huber => HUBER_MEDIANS * workspace.median_residual(gain, offset).max(1e-4),
            Loss::Tukey => TUKEY_CUTOFF,
        };
        let (count, fit) = (workspace.count, [gain, offset, cutoff]);
        let totals = sum_blocks(
            workspace.filled_blocks(),
            #[inline(always)]
            |sums, block, place| {
                let filled = LANES.min(count - place * LANES);
                accumulate(sums, block, filled, mirrored, fit, loss);
            },
        );
        let mean_loss = totals[SUM_COUNT] / count as f64;
        Self {
            cost: if count == 0 { f64::INFINITY } else { mean_loss },
            sums: totals,
            explained: workspace.explained,
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

/// Sums over blocks. Each run of blocks is summed in single precision, and the sums of the runs are added in double
/// precision. `add` adds a block to the sums. Its last argument is the index of the block.
#[inline(always)]
fn sum_blocks<const N: usize>(
    blocks: &[Correspondences],
    add: impl Fn(&mut [[f32; LANES]; N], &Correspondences, usize),
) -> [f64; N] {
    dispatch!({
        let mut totals = [0.0_f64; N];
        for (run, blocks) in blocks.chunks(BLOCKS_PER_SUM).enumerate() {
            let mut sums = [[0.0_f32; LANES]; N];
            for (k, block) in blocks.iter().enumerate() {
                // Copies the block, because a block that may alias the sums would prevent vectorization.
                let block = *block;
                add(&mut sums, &block, run * BLOCKS_PER_SUM + k);
            }
            for (lanes, total) in sums.iter().zip(&mut totals) {
                *total += lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
            }
        }
        totals
    })
}

fn median(values: &mut [u32]) -> u32 {
    if values.is_empty() {
        return 0;
    }
    let k = values.len() / 2;
    *values.select_nth_unstable(k).1
}

/// Adds a block to the sums of the normal equations and to the sum of the losses.
#[inline(always)]
fn accumulate(
    sums: &mut [[f32; LANES]; SUM_COUNT + 1],
    block: &Correspondences,
    filled: usize,
    mirrored: bool,
    [gain, offset, cutoff]: [f32; 3],
    loss: Loss,
) {
    let s = if mirrored { -1.0 } else { 1.0 };
    let [x, y] = &block.place;
    let (mut residual, mut weight, mut cost) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    // Jacobian rows in the order of the unknowns.
    let mut row = [[1.0; LANES]; 6];
    for k in 0..LANES {
        let [m, gx, gy, _] = block.moving[k];
        residual[k] = block.fixed[k] - gain * m - offset;
        row[0][k] = gain * (gx * x[k] + gy * y[k] * s);
        row[1][k] = gain * (gy * x[k] - gx * y[k] * s);
        row[2][k] = gain * gx;
        row[3][k] = gain * gy;
        row[4][k] = m;
    }
    loss.weights_and_costs(&residual, cutoff, &mut weight, &mut cost);
    weight[filled..].fill(0.0);
    cost[filled..].fill(0.0);
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
        sums[SUM_COUNT][k] += cost[k];
    }
}

impl Loss {
    /// Computes the weight and the loss of each residual.
    #[inline(always)]
    fn weights_and_costs(
        self,
        residual: &[f32; LANES],
        cutoff: f32,
        weight: &mut [f32; LANES],
        cost: &mut [f32; LANES],
    ) {
        match self {
            Self::Huber => {
                for k in 0..LANES {
                    let size = residual[k].abs();
                    let is_far = size > cutoff;
                    weight[k] = if is_far { cutoff / size } else { 1.0 };
                    let far = cutoff * (2.0 * size - cutoff);
                    cost[k] = if is_far { far } else { size * size };
                }
            }
            Self::Tukey => {
                for k in 0..LANES {
                    let share = residual[k].abs() / cutoff;
                    let near = 1.0 - share * share;
                    let near = if near > 0.0 { near } else { 0.0 };
                    weight[k] = near * near;
                    cost[k] = cutoff * cutoff / 3.0 * (1.0 - near * near * near);
                }
            }
        }
    }
}
