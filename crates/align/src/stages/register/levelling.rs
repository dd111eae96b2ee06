//! Finds a levelling of the depth map from the ink: the height of the stroke tops as a function of place.
//!
//! One threshold below the fitted surface is right for most scans. It is wrong where a scan drifts, was stitched from
//! views that do not meet, or has rules that are higher than the text. There, whole ridges lie under ink but below the
//! threshold, or ground above it. The heights of a coarse grid of nodes are then chosen so that the strokes that one
//! threshold separates cover the most ink and the least background, and after them those of a grid with half cells, which
//! follows shorter waves.

use super::half_canvas::{HalfCanvas, to_half};
use mocban_core::domain::{Affine2, Levelling, ReliefHeights};
use mocban_core::raster::DepthMap;

/// Number of nodes along each side of the grid whose heights are chosen first. Few heights are hardly misled by lost
/// strokes and heavy ink, so this grid decides whether the map is levelled at all.
const COARSE: usize = Levelling::COARSE_NODES;
/// Number of nodes along each side of the grid whose heights are chosen next. Its cells are halves of the coarse ones.
const FINE: usize = Levelling::NODES;
/// Heights of a node over the threshold reach this share of the relief up and down.
const REACH: f64 = 2.0;
/// Step between the heights that are tried, as a share of the relief.
const STEP: f64 = 0.02;
const BINS: usize = (2.0 * REACH / STEP) as usize + 1;
/// Distance between the pixels from which the heights are chosen, in pixels of the half canvas. A quarter of all pixels
/// suffices.
const SAMPLING_PX: usize = 2;
/// Number of times that all nodes are chosen, each given the others, unless the first time shows that levelling does not help.
const ROUNDS: usize = 5;
/// Weight of the prior in the score of a node: its height is probably that of the nodes around it.
const SMOOTH: f64 = 0.06;
/// Weight of the prior in the score of a node: its height is probably that of the fitted surface.
const FLAT: f64 = 0.02;
/// Pixels at least this far from the edge of the corrected ink have full weight, in pixels of the half canvas.
const FULL_PX: f64 = 1.0;
/// A levelling is tried if it increases the agreement with the ink by at least this share of the ink. On scans that need
/// none, it increases by 0.00 to 0.03, more if the ink is heavy or strokes are lost.
const LEAST_GAIN: f64 = 0.035;
/// The fine grid is used if it increases the agreement by at least this share of the ink over the coarse one. Less than
/// [`LEAST_GAIN`] suffices: the coarse grid has shown that the scan needs a levelling.
const FINE_GAIN: f64 = 0.01;
/// The search ends after the first round if it increases the agreement by less than this.
const FIRST_GAIN: f64 = 0.015;

/// Heights of the nodes, as shares of the relief.
type NodeHeights<const N: usize> = [[f64; N]; N];

/// Fits a levelling to a pose. `level` is a threshold that suits a large part of the character, and `spread` the spread
/// of the ink in pixels of the half canvas. Returns `None` if one threshold suits about as well.
pub(super) fn fit(
    depth: &DepthMap,
    canvas: &HalfCanvas,
    canvas_from_depth: &Affine2,
    relief: &ReliefHeights,
    level: u16,
    spread: f64,
) -> Option<Levelling> {
    let depth_from_half = to_half(canvas_from_depth).inverse()?;
    let size = [depth.levels.width(), depth.levels.height()];
    let per_level = depth.scale.height_per_level / relief.depth();
    let pixels = ink_pixels(canvas, &depth_from_half, spread, |found| {
        (f64::from(found) - f64::from(level)) * per_level
    });
    let coarse = InkSamples::<COARSE>::new(&pixels, size);
    let single = coarse.best_single_agreement();
    let mut heights = [[0.0; COARSE]; COARSE];
    coarse.choose_heights(&mut heights);
    if coarse.agreement(&heights) - single < FIRST_GAIN {
        return None;
    }
    for _ in 1..ROUNDS {
        coarse.choose_heights(&mut heights);
    }
    let agreement = coarse.agreement(&heights);
    if agreement - single < LEAST_GAIN {
        return None;
    }
    let mut best = Levelling::from(heights).heights;
    let fine = InkSamples::<FINE>::new(&pixels, size);
    let mut heights = best;
    for _ in 0..ROUNDS {
        fine.choose_heights(&mut heights);
    }
    if fine.agreement(&heights) - agreement >= FINE_GAIN {
        best = heights;
    }
    Some(Levelling {
        heights: best.map(|row| row.map(|height| height * relief.depth())),
    })
}

/// A pixel of a canvas with data.
struct InkPixel {
    /// Place in pixels of the depth map.
    at: [f64; 2],
    /// Height over the threshold, as a share of the relief.
    height: f64,
    /// 1 on ink, -1 on the background.
    weight: f64,
}

/// Returns some of the pixels of a canvas with data, row by row. `height` returns the height of a level over the threshold, as
/// a share of the relief.
fn ink_pixels(
    canvas: &HalfCanvas,
    depth_from_half: &Affine2,
    spread: f64,
    height: impl Fn(u16) -> f64,
) -> Vec<InkPixel> {
    let along = |side: usize| (0..side).step_by(SAMPLING_PX);
    let columns = along(canvas.levels.width());
    let places = along(canvas.levels.height())
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .filter(|(x, y)| canvas.levels.at(*x, *y) > 0);
    let pixel = |(x, y): (usize, usize)| {
        let distance = f64::from(canvas.edge.grid().at(x, y));
        InkPixel {
            at: depth_from_half.apply([x as f64, y as f64]),
            height: height(canvas.levels.at(x, y)),
            weight: ((distance - spread) / FULL_PX).clamp(-1.0, 1.0),
        }
    };
    places.map(pixel).collect()
}

/// A pixel between four nodes.
#[derive(Debug, Clone, Copy)]
struct InkSample {
    /// Height over the threshold, as a share of the relief.
    height: f64,
    /// 1 on ink, -1 on the background.
    weight: f64,
    /// Weights of the four nodes around it, row by row.
    nodes: [f64; 4],
}

/// Pixels of a canvas with data.
struct InkSamples<const N: usize> {
    /// The samples of each cell between four of `N` x `N` nodes, row by row.
    cells: Vec<Vec<InkSample>>,
    /// Sum of the weights of the ink, at least 1.
    all_ink: f64,
}

impl<const N: usize> InkSamples<N> {
    /// Sorts pixels into cells. `size` is that of the depth map.
    fn new(pixels: &[InkPixel], size: [usize; 2]) -> Self {
        let mut cells = vec![Vec::new(); (N - 1) * (N - 1)];
        let mut all_ink = 0.0;
        for &InkPixel { at, height, weight } in pixels {
            let nodes = Levelling::weights::<N>(at, size);
            let [x, y] = nodes[0].0;
            all_ink += f64::max(weight, 0.0);
            cells[y * (N - 1) + x].push(InkSample {
                height,
                weight,
                nodes: nodes.map(|(_, weight)| weight),
            });
        }
        Self {
            cells,
            all_ink: f64::max(all_ink, 1.0),
        }
    }

    /// Chooses the height of each node once, given the others.
    fn choose_heights(&self, heights: &mut NodeHeights<N>) {
        for node in 0..N * N {
            let [x, y] = [node % N, node / N];
            heights[y][x] = self.best_height(heights, [x, y]);
        }
    }

    /// Returns the best agreement of one threshold with the ink, as a share of the ink.
    fn best_single_agreement(&self) -> f64 {
        let mut bins = [0.0; BINS];
        for sample in self.cells.iter().flatten() {
            bins[bin(sample.height)] += sample.weight;
        }
        let mut above = 0.0;
        let agreements = bins.iter().rev().map(|weight| {
            above += weight;
            above
        });
        agreements.fold(0.0, f64::max) / self.all_ink
    }

    /// Returns the agreement of the samples above the nodes with the ink, as a share of the ink.
    fn agreement(&self, heights: &NodeHeights<N>) -> f64 {
        let mut sum = 0.0;
        for (cell, samples) in self.cells.iter().enumerate() {
            let corners = corners(heights, cell);
            let above = samples.iter().filter(|sample| sample.over(&corners) >= 0.0);
            sum += above.map(|sample| sample.weight).sum::<f64>();
        }
        sum / self.all_ink
    }

    /// Returns the best height of a node, given the heights of the others.
    fn best_height(&self, heights: &NodeHeights<N>, [x, y]: [usize; 2]) -> f64 {
        let now = heights[y][x];
        let mut bins = [0.0; BINS];
        for corner in 0..4 {
            let [left, top] = [x.wrapping_sub(corner % 2), y.wrapping_sub(corner / 2)];
            if left >= N - 1 || top >= N - 1 {
                continue;
            }
            let cell = top * (N - 1) + left;
            let corners = corners(heights, cell);
            for sample in &self.cells[cell] {
                bins[bin(sample.over(&corners) + now)] += sample.nodes[corner] * sample.weight;
            }
        }
        let around = mean_around(heights, [x, y]);
        let ink = self.all_ink / (N * N) as f64;
        let (mut above, mut best) = (0.0, (f64::NEG_INFINITY, now));
        for (k, weight) in bins.iter().enumerate().rev() {
            above += weight;
            let height = k as f64 * STEP - REACH;
            let prior = SMOOTH * (height - around).powi(2) + FLAT * height * height;
            let score = above / ink - prior;
            if score > best.0 {
                best = (score, height);
            }
        }
        best.1
    }
}

impl InkSample {
    /// Returns the height over the surface between four nodes.
    fn over(&self, corners: &[f64; 4]) -> f64 {
        let products = self.nodes.iter().zip(corners);
        self.height
            - products
                .map(|(weight, height)| weight * height)
                .sum::<f64>()
    }
}

/// Returns the heights of the four nodes around a cell, row by row.
fn corners<const N: usize>(heights: &NodeHeights<N>, cell: usize) -> [f64; 4] {
    let [x, y] = [cell % (N - 1), cell / (N - 1)];
    [
        heights[y][x],
        heights[y][x + 1],
        heights[y + 1][x],
        heights[y + 1][x + 1],
    ]
}

/// Returns the mean height of the neighbours of a node.
fn mean_around<const N: usize>(heights: &NodeHeights<N>, [x, y]: [usize; 2]) -> f64 {
    let beside = [
        (x.wrapping_sub(1), y),
        (x + 1, y),
        (x, y.wrapping_sub(1)),
        (x, y + 1),
    ];
    let found = beside.iter().filter_map(|(x, y)| heights.get(*y)?.get(*x));
    let (sum, count) = found.fold((0.0, 0), |(sum, count), height| (sum + height, count + 1));
    sum / f64::from(count.max(1))
}

/// Returns the bin of a height, as a share of the relief. Heights beyond the reach are in the first or the last.
fn bin(height: f64) -> usize {
    ((height + REACH) / STEP).clamp(0.0, (BINS - 1) as f64) as usize
}

#[cfg(test)]
mod tests {
    use super::fit;
    use crate::stages::register::half_canvas::HalfCanvas;
    use mocban_core::domain::{Affine2, Levelling, ReliefHeights};
    use mocban_core::raster::{DepthMap, Grid, Mask};

    const SIDE: usize = 120;
    const RELIEF: ReliefHeights = ReliefHeights {
        top: 0.0,
        ground: -0.4,
        tops_end: 0.1,
        tops_end_log_deviation: 0.1,
    };

    /// Returns whether a column is on one of the bars of 6 px, each of which is `wider` px wider on each side.
    fn on_bar(x: usize, wider: usize) -> bool {
        (x + 13 + wider) % 20 < 6 + 2 * wider
    }

    /// Returns a map of the bars whose heights rise by `drift` of the relief from the left to the right.
    fn drifting(drift: f64) -> DepthMap {
        bars(|x, _| drift * (x - 0.5))
    }

    /// Returns a map of the bars. `error` returns the error of the heights at a place, 0..=1 along each axis, as a share of
    /// the relief.
    fn bars(error: impl Fn(f64, f64) -> f64) -> DepthMap {
        let level = |x: usize, y: usize| {
            let height = if on_bar(x, 0) { 0.0 } else { -0.4 };
            let [u, v] = [x, y].map(|at| at as f64 / (SIDE - 1) as f64);
            (1.0 + (height + 0.4 * error(u, v) + 1.0) / 2e-5) as u16
        };
        DepthMap::of_levels(Grid::from_fn(SIDE, SIDE, level))
    }

    /// Returns a threshold a tenth of the relief below tops without drift.
    fn level(depth: &DepthMap) -> u16 {
        RELIEF.level_at(&depth.scale, 0.1)
    }

    /// Fits a levelling to a map of the bars. The ink is `wider` px wider on each side.
    fn levelling(depth: &DepthMap, wider: usize) -> Option<Levelling> {
        let ink = Mask::from_fn(SIDE, SIDE, |x, _| on_bar(x, wider));
        let canvas = HalfCanvas::of(depth.levels.clone(), ink);
        let canvas_from_depth = Affine2::resize(2.0);
        let level = level(depth);
        fit(
            depth,
            &canvas,
            &canvas_from_depth,
            &RELIEF,
            level,
            wider as f64,
        )
    }

    /// Returns the share of the pixels that the threshold puts on the right side.
    fn right(depth: &DepthMap) -> f64 {
        let bars = Mask::from_fn(SIDE, SIDE, |x, _| on_bar(x, 0));
        let strokes = depth.stroke_mask(level(depth));
        let pixels = strokes.data().iter().zip(bars.data());
        pixels.filter(|(stroke, bar)| stroke == bar).count() as f64 / (SIDE * SIDE) as f64
    }

    #[test]
    fn one_threshold_fits_a_levelled_map_whose_drift_exceeded_the_relief() {
        let depth = drifting(2.4);
        assert!(right(&depth) < 0.85);
        let found = levelling(&depth, 0).expect("one threshold does not fit");
        let share = right(&depth.levelled(&found));
        assert!(share > 0.97, "{share}");
    }

    #[test]
    fn waves_shorter_than_the_coarse_cells_are_levelled_by_the_fine_ones() {
        let wave = |at: f64| (at * 3.0 * std::f64::consts::PI).sin();
        let depth = bars(|x, y| 1.4 * (x - 0.5) + 0.7 * wave(x) * wave(y));
        let found = levelling(&depth, 0).expect("one threshold does not fit");
        let share = right(&depth.levelled(&found));
        assert!(share > 0.95, "{share}");
    }

    #[test]
    fn scans_of_one_height_are_not_levelled() {
        for wider in 0..3 {
            assert_eq!(levelling(&drifting(0.0), wider), None);
        }
    }
}
