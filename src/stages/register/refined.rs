//! Our registration: the poses that normalisation found, refined and compared; the best one, looked at closely, serves
//! every metric.

use super::cuts::{Cuts, FEW_CUTS, near};
use super::stretch::stretched;
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
/// Shares of the working size at which poses are compared, and at which the best one finds its cut.
const COMPARED: f64 = 0.42;
const CLOSER: f64 = 0.67;
/// Rivals that reach this share of the best one's score are looked at as closely as it.
const CLOSE: f64 = 0.75;
/// A rival's share that is no sign of a wrong pose: symmetric characters have it.
const SYMMETRIC: f64 = 0.9;
/// Most steps of a refinement, and of the last one.
const FEW_STEPS: usize = 8;
const MOST_STEPS: usize = 15;

/// One alignment a metric that has a threshold: thresholds differ, the pose does not, since it is found without one.
pub(super) fn align(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<(Vec<Alignment>, Evidence), Error> {
    let pictures = Pictures::new(depth, normalized, params).ok_or(Error::NoPose)?;
    let mut rivals = Rivals::of(&pictures, normalized).ok_or(Error::NoPose)?;
    let cuts = near(rivals.best.cut);
    let (ink, woods) = pictures.layers(CLOSER, cuts);
    let cuts = Cuts::new(cuts, &ink, &woods);
    rivals.look_closer(&cuts).ok_or(Error::NoPose)?;
    let print_from_depth = pictures.look(&rivals.best);
    let choices = normalized.outcome.thresholds.iter();
    let alignments = choices.map(|choice| Alignment {
        metric: choice.metric,
        level: choice.level,
        print_from_depth,
        margin: rivals.margin(),
        at_bound: normalized.outcome.search_at_bound || choice.at_bound,
    });
    Ok((alignments.collect(), rivals.evidence()))
}

/// A pose with the cut that fits the print's strokes there.
#[derive(Debug, Clone, Copy)]
struct Settled {
    found: Found,
    overlap: Overlap,
    cut: f64,
    /// Which of the tried cuts came nearest.
    nearest: usize,
}

impl Settled {
    /// What ranks poses: correlation, and how much of the tops has printed. Ink without tops is common, for strokes
    /// break off after a print was made; tops without ink are rare.
    fn score(&self) -> f64 {
        self.found.score * self.overlap.moving_met
    }
}

/// The best pose beside those that cannot be right if it is.
#[derive(Debug, Clone, Copy)]
struct Rivals {
    best: Settled,
    /// The best pose at another angle, and the best in mirror writing.
    other_angle: Option<Settled>,
    mirrored: Option<Settled>,
    /// Shares of the best one's score that they reach.
    shares: [f64; 2],
}

impl Rivals {
    /// Compares the poses that normalisation found.
    fn of(pictures: &Pictures, normalized: &Normalized) -> Option<Self> {
        let (ink, woods) = pictures.layers(COMPARED, &FEW_CUTS);
        let tried = settle_all(&Cuts::new(&FEW_CUTS, &ink, &woods), normalized)?;
        let best = *best_of(&tried, |pose| !pose.found.mirrored)?;
        let elsewhere = |pose: &Settled| {
            !pose.found.mirrored && pose.found.turn_from(&best.found) > SAME_POSE_DEG
        };
        let other_angle = best_of(&tried, elsewhere).copied();
        let mirrored = best_of(&tried, |pose| pose.found.mirrored).copied();
        Some(Self {
            best,
            other_angle,
            mirrored,
            shares: [other_angle, mirrored].map(|rival| share(rival, &best)),
        })
    }

    /// Looks at the best pose more closely, and at rivals that come near it, which may then win.
    fn look_closer(&mut self, cuts: &Cuts) -> Option<()> {
        let is_close = self.shares.iter().any(|share| *share > CLOSE);
        self.best = settled(cuts, &self.best.found)?;
        if !is_close {
            return Some(());
        }
        for rival in [&mut self.other_angle, &mut self.mirrored]
            .into_iter()
            .flatten()
        {
            *rival = settled(cuts, &rival.found)?;
        }
        self.shares = self.fair_shares(cuts);
        if let Some(other) = &mut self.other_angle
            && self.shares[0] > 1.0
        {
            std::mem::swap(&mut self.best, other);
            self.shares = self.fair_shares(cuts);
        }
        Some(())
    }

    /// The rivals' shares on the ground that they have in common with the best pose.
    fn fair_shares(&self, cuts: &Cuts) -> [f64; 2] {
        [self.other_angle, self.mirrored]
            .map(|rival| rival.map_or(0.0, |rival| fair_share(cuts, &rival, &self.best)))
    }

    /// By how much the best pose wins.
    fn margin(&self) -> f64 {
        let [other_angle, mirrored] = self.shares;
        self.best.score() * (1.0 - other_angle.max(mirrored))
    }

    /// What speaks for and against the best pose.
    fn evidence(&self) -> Evidence {
        let [other_angle, mirrored] = self.shares;
        Evidence {
            correlation: self.best.found.score,
            tops_met: self.best.overlap.moving_met,
            ink_met: self.best.overlap.fixed_met,
            other_angle,
            mirrored,
        }
    }
}

/// Share of the best pose's score that a rival reaches.
fn share(rival: Option<Settled>, best: &Settled) -> f64 {
    rival.map_or(0.0, |rival| rival.score() / best.score().max(1e-6))
}

/// The same on the ground that both have in common. Where that is little it may say anything in favour of the best, so
/// there the plain share is not undercut by more than it takes to clear a symmetric character.
fn fair_share(cuts: &Cuts, rival: &Settled, best: &Settled) -> f64 {
    let [score, fair] = cuts.duel([best, rival].map(|pose| (pose.nearest, &pose.found)));
    (fair / score.max(1e-6)).max(share(Some(*rival), best).min(SYMMETRIC))
}

fn best_of(tried: &[Settled], of_kind: impl Fn(&Settled) -> bool) -> Option<&Settled> {
    let among = tried.iter().filter(|pose| of_kind(pose));
    among.max_by(|a, b| a.score().total_cmp(&b.score()))
}

/// Print and relief at working size.
struct Pictures {
    ink: Base,
    depths: Base,
    px: usize,
    smoothing_px: f64,
    may_stretch: bool,
    /// Middle of the depth map, pixels.
    middle: [f64; 2],
}

impl Pictures {
    fn new(depth: &DepthMap, normalized: &Normalized, params: &Params) -> Option<Self> {
        let ink = Soft {
            amount: normalized.ink.map(|set| f32::from(u8::from(*set))),
            known: normalized.known.clone(),
        };
        let px = params.working_px as usize;
        Some(Self {
            ink: Base::new(&ink, px)?,
            depths: Base::new(&Relief::of(depth)?.depths(depth), px)?,
            px,
            smoothing_px: params.smoothing_px,
            may_stretch: params.stretch,
            middle: [depth.levels.width(), depth.levels.height()].map(|side| side as f64 / 2.0),
        })
    }

    /// The ink, and the strokes of cuts under the tops, at a share of the working size.
    fn layers(&self, share: f64, cuts: &[f64]) -> (Layer, Vec<Layer>) {
        let px = (self.px as f64 * share).round() as usize;
        let sigma = self.smoothing_px * share.sqrt();
        let depths = self.depths.at(px, sigma);
        let strokes = |cut: &f64| depths.mapped(|d| soft_stroke(d, *cut, SOFTNESS));
        (
            self.ink.layer(px, sigma),
            cuts.iter().map(strokes).collect(),
        )
    }

    /// The pose looked at once more at working size, with the strokes of its cut.
    fn look(&self, best: &Settled) -> Affine2 {
        let (ink, woods) = self.layers(1.0, &[best.cut]);
        let Some(wood) = woods.first() else {
            return best.found.fixed_from_moving;
        };
        let refiner = Refiner::new(&ink, wood);
        let refined = refiner.refine(&best.found, MOST_STEPS, Loss::Tukey);
        let last = if self.may_stretch {
            stretched(&refiner, &refined, self.middle)
        } else {
            refined
        };
        last.fixed_from_moving
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
    let strokes = cuts.fitting(start)?.strokes;
    let close = strokes.refine(start, FEW_STEPS, Loss::Huber);
    let pose = strokes.refine(&close, FEW_STEPS, Loss::Tukey);
    let fitting = cuts.fitting(&pose)?;
    Some(Settled {
        found: fitting.found,
        overlap: fitting.strokes.overlap(&pose),
        cut: fitting.cut,
        nearest: fitting.nearest,
    })
}
