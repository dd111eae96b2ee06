//! Our registration: the poses that normalisation found, refined at full size; the best one serves every metric.

use super::cuts::Cuts;
use super::{Alignment, Error, Params};
use crate::raster::DepthMap;
use crate::stages::normalize::{Normalized, Relief, soft_stroke};
use crate::stages::pose::{Base, Found, Layer, Loss, Soft};

/// Poses closer in angle than this are one pose when the margin is taken.
const SAME_POSE_DEG: f64 = 15.0;
/// How many of the poses are refined.
const TRIED: usize = 3;
/// Cuts under the tops that are tried, as shares of the relief, and the softness of each. The ink of a print spreads;
/// strokes cut too thin or too thick for it would pull the scale.
const CUTS: [f64; 6] = [0.05, 0.1, 0.17, 0.26, 0.37, 0.5];
const SOFTNESS: f64 = 0.1;

/// One alignment a metric that has a threshold: thresholds differ, the pose does not, since it is found without one.
pub(super) fn align(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<Vec<Alignment>, Error> {
    let found = refined(depth, normalized, params).ok_or(Error::NoPose)?;
    let best = found.first().ok_or(Error::NoPose)?;
    let margin = best.score - second_best(&found, normalized);
    let choices = normalized.outcome.thresholds.iter();
    let alignments = choices.map(|choice| Alignment {
        metric: choice.metric,
        level: choice.level,
        print_from_depth: best.fixed_from_moving,
        margin,
        at_bound: normalized.outcome.search_at_bound || choice.at_bound,
    });
    Ok(alignments.collect())
}

/// The first few poses at full size, best first; each with the cut that fits the print's strokes.
fn refined(depth: &DepthMap, normalized: &Normalized, params: &Params) -> Option<Vec<Found>> {
    let ink = Soft {
        amount: normalized.ink.map(|set| f32::from(u8::from(*set))),
        known: normalized.known.clone(),
    };
    let relief = Relief::of(depth)?;
    let size = params.working_px as usize;
    let ink = Base::new(&ink, size)?.layer(size, params.smoothing_px);
    let depths = Base::new(&relief.depths(depth), size)?;
    let woods: Vec<Layer> = CUTS
        .iter()
        .map(|cut| {
            depths
                .map(|d| soft_stroke(d, *cut, SOFTNESS))
                .layer(size, params.smoothing_px)
        })
        .collect();
    let woods = Cuts::new(&ink, &woods);
    let starts = normalized
        .outcome
        .poses
        .iter()
        .take(TRIED)
        .map(|pose| Found {
            fixed_from_moving: pose.print_from_depth,
            score: 0.0,
            mirrored: false,
        });
    let mut found: Vec<Found> = starts.map(|start| settled(&woods, &start)).collect();
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    Some(found)
}

/// A pose refined with the cut that fits best, first from afar, then closely.
fn settled(woods: &Cuts, start: &Found) -> Found {
    let mut pose = *start;
    for loss in [Loss::Huber, Loss::Tukey] {
        pose = woods.refine(&pose, 15, loss);
    }
    let Some((wood, judged)) = woods.fitting(&pose) else {
        return pose;
    };
    Found {
        score: judged.score * wood.overlap(&pose).moving_met,
        ..pose
    }
}

/// Best score of any other pose: another angle, or mirrored; 0 when there is none.
fn second_best(found: &[Found], normalized: &Normalized) -> f64 {
    let angle = |pose: &Found| pose.fixed_from_moving.angle_deg();
    let Some(best) = found.first() else {
        return 0.0;
    };
    let other = |pose: &&Found| {
        let turn = (angle(pose) - angle(best)).rem_euclid(360.0);
        turn.min(360.0 - turn) > SAME_POSE_DEG
    };
    let upright = found.iter().filter(other).map(|pose| pose.score);
    upright
        .chain(normalized.outcome.mirrored_score)
        .fold(0.0, f64::max)
}
