//! Our registration: the poses that normalisation found, refined at full size; the best one serves every metric.

use super::{Alignment, Error, Params, chosen};
use crate::domain::ThresholdMetric;
use crate::raster::DepthMap;
use crate::stages::normalize::{Normalized, Relief};
use crate::stages::pose::{Found, Layer, Soft, refine};

/// Poses closer in angle than this are one pose when the margin is taken.
const SAME_POSE_DEG: f64 = 15.0;
/// How many of the poses are refined.
const TRIED: usize = 3;

/// One alignment a metric: thresholds differ, the pose does not, since it is found without one.
pub(super) fn align(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<Vec<Alignment>, Error> {
    let mut found = refined(depth, normalized, params).ok_or(Error::NoPose)?;
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let best = found.first().ok_or(Error::NoPose)?;
    let margin = best.score - second_best(&found, normalized);
    ThresholdMetric::ALL
        .into_iter()
        .map(|metric| {
            let (level, at_end) = chosen(normalized, metric)?;
            Ok(Alignment {
                metric,
                level,
                print_from_depth: best.fixed_from_moving,
                margin,
                at_bound: normalized.outcome.search_at_bound || at_end,
            })
        })
        .collect()
}

/// The first few poses at full size.
fn refined(depth: &DepthMap, normalized: &Normalized, params: &Params) -> Option<Vec<Found>> {
    let ink = Soft {
        amount: normalized.ink.map(|set| f32::from(u8::from(*set))),
        known: normalized.known.clone(),
    };
    let tops = Relief::of(depth)?.soft_tops(depth);
    let size = params.working_px as usize;
    let ink = Layer::new(&ink, size, params.smoothing_px)?;
    let wood = Layer::new(&tops, size, params.smoothing_px)?;
    let poses = normalized.outcome.poses.iter().take(TRIED);
    Some(
        poses
            .map(|pose| Found {
                fixed_from_moving: pose.print_from_depth,
                score: 0.0,
                mirrored: false,
            })
            .map(|start| refine(&ink, &wood, &start))
            .collect(),
    )
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
