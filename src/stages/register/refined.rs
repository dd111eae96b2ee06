//! Our registration: the poses that normalisation found, refined at full size; the best one serves every metric.

use super::cuts::{CUTS, Cuts};
use super::{Alignment, Error, Params};
use crate::domain::{Affine2, Evidence, Pose};
use crate::raster::DepthMap;
use crate::stages::normalize::{Normalized, Relief, soft_stroke};
use crate::stages::pose::{Base, Found, Layer, Loss, Overlap, Refiner, Soft};

/// Poses closer in angle than this are one pose when the margin is taken.
const SAME_POSE_DEG: f64 = 15.0;
/// How many of the poses are refined.
const TRIED: usize = 3;
/// Softness of a cut, a share of the relief.
const SOFTNESS: f64 = 0.1;
/// The best pose is looked at once more at this many times the working size.
const CLOSER: f64 = 1.5;
/// Most steps of a candidate's refinements, and of the last one.
const FEW_STEPS: usize = 8;
const MOST_STEPS: usize = 15;

/// One alignment a metric that has a threshold: thresholds differ, the pose does not, since it is found without one.
pub(super) fn align(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<(Vec<Alignment>, Evidence), Error> {
    let pictures = Pictures::new(depth, normalized, params).ok_or(Error::NoPose)?;
    let ink = pictures.ink(1.0);
    let woods = CUTS.map(|cut| pictures.wood(cut, 1.0));
    let cuts = Cuts::new(&ink, &woods);
    let tried = settle_all(&cuts, normalized).ok_or(Error::NoPose)?;
    let best = *best_of(&tried, |pose| !pose.found.mirrored).ok_or(Error::NoPose)?;
    let score_of = |other: Option<&Settled>| other.map_or(0.0, Settled::score);
    let other_angle = score_of(best_of(&tried, |pose| {
        !pose.found.mirrored && pose.found.turn_from(&best.found) > SAME_POSE_DEG
    }));
    let mirrored = score_of(best_of(&tried, |pose| pose.found.mirrored));
    let evidence = best.evidence(other_angle, mirrored);
    let print_from_depth = pictures.closer(&best.found, cuts.best_cut(&best.found));
    let choices = normalized.outcome.thresholds.iter();
    let alignments = choices.map(|choice| Alignment {
        metric: choice.metric,
        level: choice.level,
        print_from_depth,
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

/// Print and relief at the largest working size.
struct Pictures {
    ink: Base,
    depths: Base,
    px: usize,
    smoothing_px: f64,
}

impl Pictures {
    fn new(depth: &DepthMap, normalized: &Normalized, params: &Params) -> Option<Self> {
        let ink = Soft {
            amount: normalized.ink.map(|set| f32::from(u8::from(*set))),
            known: normalized.known.clone(),
        };
        let relief = Relief::of(depth)?;
        let px = params.working_px as usize;
        let closest = (params.working_px as f64 * CLOSER) as usize;
        Some(Self {
            ink: Base::new(&ink, closest)?,
            depths: Base::new(&relief.depths(depth), closest)?,
            px,
            smoothing_px: params.smoothing_px,
        })
    }

    fn ink(&self, times: f64) -> Layer {
        let px = (self.px as f64 * times) as usize;
        self.ink.layer(px, self.smoothing_px * times.sqrt())
    }

    /// Strokes at a cut, a share of the relief under the tops.
    fn wood(&self, cut: f64, times: f64) -> Layer {
        let strokes = self.depths.map(|d| soft_stroke(d, cut, SOFTNESS));
        let px = (self.px as f64 * times) as usize;
        strokes.layer(px, self.smoothing_px * times.sqrt())
    }

    /// The pose looked at once more, closer.
    fn closer(&self, best: &Found, cut: f64) -> Affine2 {
        let (ink, wood) = (self.ink(CLOSER), self.wood(cut, CLOSER));
        let refined = Refiner::new(&ink, &wood).refine(best, MOST_STEPS, Loss::Tukey);
        refined.fixed_from_moving
    }
}

/// The first few poses as read, and the best mirrored one.
fn settle_all(cuts: &Cuts, normalized: &Normalized) -> Option<Vec<Settled>> {
    let start = |pose: &Pose, mirrored| Found {
        fixed_from_moving: pose.print_from_depth,
        score: pose.score,
        mirrored,
    };
    let outcome = &normalized.outcome;
    let upright = outcome.poses.iter().take(TRIED).map(|p| start(p, false));
    let starts = upright.chain(outcome.mirrored.iter().map(|p| start(p, true)));
    starts.map(|start| settled(cuts, &start)).collect()
}

/// A pose refined with the cut that fits best, first from afar, then closely.
fn settled(cuts: &Cuts, start: &Found) -> Option<Settled> {
    let (wood, _) = cuts.fitting(start)?;
    let near = wood.refine(start, FEW_STEPS, Loss::Huber);
    let pose = wood.refine(&near, FEW_STEPS, Loss::Tukey);
    let (wood, found) = cuts.fitting(&pose)?;
    Some(Settled {
        found,
        overlap: wood.overlap(&pose),
    })
}
