//! Choosing depth thresholds in the aligned frame.
//!
//! Every level between two depths under the tops is a candidate; its mask is compared with the print's ink where
//! both print and depth map hold data.

use super::{Error, Params, Relief};
use crate::domain::{Affine2, ThresholdChoice, ThresholdMetric};
use crate::raster::{DepthMap, Grid, Mask, warp_depth, warp_mask};
use crate::stages::ink::Ink;
use crate::stages::score::WindowMeans;

/// Candidate thresholds between the first and the last cut.
const CANDIDATES: u32 = 40;
/// Depth under the tops at which `relief` cuts, as a share of the relief. On carvings whose tops are known the mask
/// there agrees best with them.
const RELIEF_CUT: f64 = 0.09;

/// Both pictures on the canvas.
pub(super) struct Canvas {
    levels: Grid<u16>,
    ink: Mask,
    known: Mask,
}

impl Canvas {
    /// Brings print and depth map to the canvas by a pose; only what both hold is kept.
    pub(super) fn new(
        depth: &DepthMap,
        print: &Ink,
        canvas_from_print: &Affine2,
        print_from_depth: &Affine2,
        params: &Params,
    ) -> Self {
        let side = params.canvas_px as usize;
        let levels = warp_depth(
            depth,
            &canvas_from_print.after(print_from_depth),
            side,
            side,
        );
        let paper = warp_mask(&print.soft.known, canvas_from_print, side, side);
        let known = Mask::from_fn(side, side, |x, y| paper.at(x, y) && levels.at(x, y) > 0);
        let ink = warp_mask(&print.mask, canvas_from_print, side, side);
        Self {
            ink: Mask::from_fn(side, side, |x, y| ink.at(x, y) && known.at(x, y)),
            known,
            levels,
        }
    }

    fn mask(&self, level: u16) -> Mask {
        Mask::from_fn(self.levels.width(), self.levels.height(), |x, y| {
            self.known.at(x, y) && self.levels.at(x, y) >= level
        })
    }
}

/// One threshold tried.
#[derive(Debug, Clone, Copy)]
struct Tried {
    level: u16,
    structure: f64,
    /// Ink share of the depth mask over that of the print.
    density_ratio: f64,
}

/// Chooses each metric's threshold.
///
/// - `nl_ssim`: the highest structure score.
/// - `density`: the ink share closest to the print's over `ink_spread`.
/// - `ensemble`: halfway in height between the two. Structure alone drifts to where worn tops fray, density alone
///   copies the print's ink spread; their errors are of opposite sign.
/// - `relief`: a fixed share of the relief under the tops, whatever the print shows; it has no score.
pub(super) fn choose(
    depth: &DepthMap,
    relief: &Relief,
    canvas: &Canvas,
    params: &Params,
) -> Result<Vec<ThresholdChoice>, Error> {
    let tried = sweep(depth, relief, canvas, params);
    let structure = tried
        .iter()
        .max_by(|a, b| a.structure.total_cmp(&b.structure))
        .ok_or(Error::NoStrokes)?;
    let gap = |t: &Tried| (t.density_ratio * params.ink_spread - 1.0).abs();
    let density = tried
        .iter()
        .min_by(|a, b| gap(a).total_cmp(&gap(b)))
        .ok_or(Error::NoStrokes)?;
    let middle = u16::midpoint(structure.level, density.level);
    let both = tried
        .iter()
        .min_by_key(|t| t.level.abs_diff(middle))
        .ok_or(Error::NoStrokes)?;
    let ends = [tried.first(), tried.last()];
    let choice = |metric, t: &Tried, score| ThresholdChoice {
        metric,
        level: t.level,
        score,
        at_bound: ends.iter().flatten().any(|end| end.level == t.level),
    };
    Ok(vec![
        choice(ThresholdMetric::NlSsim, structure, structure.structure),
        choice(ThresholdMetric::Density, density, -gap(density)),
        choice(ThresholdMetric::Ensemble, both, both.structure),
        ThresholdChoice {
            metric: ThresholdMetric::Relief,
            level: relief.level_at(depth, RELIEF_CUT),
            score: 0.0,
            at_bound: false,
        },
    ])
}

fn sweep(depth: &DepthMap, relief: &Relief, canvas: &Canvas, params: &Params) -> Vec<Tried> {
    let ink = canvas.ink.count();
    let means = WindowMeans::new(&canvas.ink, params.window);
    let share = |k: u32| {
        params.cut_from
            + (params.cut_to - params.cut_from) * f64::from(k) / f64::from(CANDIDATES - 1)
    };
    let mut levels: Vec<u16> = (0..CANDIDATES)
        .map(|k| relief.level_at(depth, share(k)))
        .collect();
    levels.dedup();
    levels
        .into_iter()
        .map(|level| (level, canvas.mask(level)))
        .filter(|(_, mask)| mask.count() > 0 && ink > 0)
        .map(|(level, mask)| Tried {
            level,
            structure: means.against(&mask).nl_ssim,
            density_ratio: mask.count() as f64 / ink as f64,
        })
        .collect()
}
