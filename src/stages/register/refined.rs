//! Our registration: the poses that normalisation found, refined at full size; the best one serves every metric.

use super::{Alignment, Error, Params};
use crate::domain::{Evidence, Pose};
use crate::raster::DepthMap;
use crate::stages::normalize::{Normalized, Relief, soft_stroke};
use crate::stages::pose::{Base, Found, Layer, Loss, Overlap, Refiner, Soft};

/// Poses closer in angle than this are one pose when the margin is taken.
const SAME_POSE_DEG: f64 = 15.0;
/// How many of the poses are refined.
const TRIED: usize = 3;
/// Cuts under the tops that are tried, as shares of the relief, and the softness of each. The ink of a print spreads;
/// strokes cut too thin or too thick for it would pull the scale.
const CUTS: [f64; 6] = [0.05, 0.1, 0.17, 0.26, 0.37, 0.5];
const SOFTNESS: f64 = 0.1;
/// Most steps of one refinement.
const MOST_STEPS: usize = 15;

/// One alignment a metric that has a threshold: thresholds differ, the pose does not, since it is found without one.
pub(super) fn align(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<(Vec<Alignment>, Evidence), Error> {
    let tried = settle_all(depth, normalized, params).ok_or(Error::NoPose)?;
    let best = *best_of(&tried, |pose| !pose.found.mirrored).ok_or(Error::NoPose)?;
    let score_of = |other: Option<&Settled>| other.map_or(0.0, Settled::score);
    let other_angle = score_of(best_of(&tried, |pose| {
        !pose.found.mirrored && pose.is_turned_from(&best)
    }));
    let mirrored = score_of(best_of(&tried, |pose| pose.found.mirrored));
    let evidence = best.evidence(other_angle, mirrored);
    let choices = normalized.outcome.thresholds.iter();
    let alignments = choices.map(|choice| Alignment {
        metric: choice.metric,
        level: choice.level,
        print_from_depth: best.found.fixed_from_moving,
        margin: best.score() - other_angle.max(mirrored),
        at_bound: normalized.outcome.search_at_bound || choice.at_bound,
    });
    Ok((alignments.collect(), evidence))
}

/// A pose at full size with the cut that fits the print's strokes.
#[derive(Debug, Clone, Copy)]
struct Settled {
    found: Found,
    overlap: Overlap,
}

impl Settled {
    /// What ranks poses: correlation, and how much of the tops has printed. Ink without tops is common, for strokes
    /// break off after a print was made; tops without ink are rare.
    fn score(&self) -> f64 {
        self.found.score * self.overlap.moving_met
    }

    fn is_turned_from(&self, other: &Self) -> bool {
        let angle = |pose: &Self| pose.found.fixed_from_moving.angle_deg();
        let turn = (angle(self) - angle(other)).rem_euclid(360.0);
        turn.min(360.0 - turn) > SAME_POSE_DEG
    }

    fn evidence(&self, other_angle: f64, mirrored: f64) -> Evidence {
        let own = self.score().max(1e-6);
        Evidence {
            correlation: self.found.score,
            tops_met: self.overlap.moving_met,
            ink_met: self.overlap.fixed_met,
            other_angle: other_angle / own,
            mirrored: mirrored / own,
        }
    }
}

fn best_of(tried: &[Settled], of_kind: impl Fn(&Settled) -> bool) -> Option<&Settled> {
    let among = tried.iter().filter(|pose| of_kind(pose));
    among.max_by(|a, b| a.score().total_cmp(&b.score()))
}

/// The first few poses as read, and the best mirrored one, at full size.
fn settle_all(depth: &DepthMap, normalized: &Normalized, params: &Params) -> Option<Vec<Settled>> {
    let ink = Soft {
        amount: normalized.ink.map(|set| f32::from(u8::from(*set))),
        known: normalized.known.clone(),
    };
    let relief = Relief::of(depth)?;
    let size = params.working_px as usize;
    let ink = Base::new(&ink, size)?.layer(size, params.smoothing_px);
    let depths = Base::new(&relief.depths(depth), size)?;
    let wood = |cut: &f64| {
        let strokes = depths.map(|d| soft_stroke(d, *cut, SOFTNESS));
        strokes.layer(size, params.smoothing_px)
    };
    let woods: Vec<Layer> = CUTS.iter().map(wood).collect();
    let woods: Vec<Refiner> = woods.iter().map(|wood| Refiner::new(&ink, wood)).collect();
    let start = |pose: &Pose, mirrored| Found {
        fixed_from_moving: pose.print_from_depth,
        score: pose.score,
        mirrored,
    };
    let outcome = &normalized.outcome;
    let upright = outcome.poses.iter().take(TRIED).map(|p| start(p, false));
    let starts = upright.chain(outcome.mirrored.iter().map(|p| start(p, true)));
    starts.map(|start| settled(&woods, &start)).collect()
}

/// A pose refined with the cut that fits best, first from afar, then closely.
fn settled(woods: &[Refiner], start: &Found) -> Option<Settled> {
    let fitting = |pose: &Found| {
        let judged = woods.iter().map(|wood| (wood, wood.judged(pose)));
        judged.max_by(|a, b| a.1.score.total_cmp(&b.1.score))
    };
    let mut pose = *start;
    for loss in [Loss::Huber, Loss::Tukey] {
        pose = fitting(&pose)?.0.refine(&pose, MOST_STEPS, loss);
    }
    let (wood, found) = fitting(&pose)?;
    Some(Settled {
        found,
        overlap: wood.overlap(&pose),
    })
}
