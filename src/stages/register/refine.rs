//! Our registration: the poses that normalisation found, refined and compared; the best one, looked at closely, serves
//! every metric.

use super::alignment::Alignment;
use super::anisotropic_scale::stretched;
use super::params::{RegisterError, RegisterParams};
use super::soft_thresholds::{Cuts, FEW_CUTS, near};
use crate::domain::{Affine2, Pose, PoseFeatures};
use crate::raster::DepthMap;
use crate::stages::normalize::{Normalized, Relief, soft_stroke};
use crate::stages::pose::{
    BorderStrokes, ImagePyramid, LevelBuilder, Loss, PoseCandidate, PoseOverlap, PyramidLevel,
    Refiner, SoftMask,
};

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
/// How much smaller and larger the pose is from which the answer must be the same.
const OTHER_SIZE: f64 = 1.08;
/// Most steps of a refinement, and of the last one.
const FEW_STEPS: usize = 8;
const MOST_STEPS: usize = 15;

/// One alignment a metric that has a threshold: thresholds differ, the pose does not, since it is found without one.
pub(super) fn align(
    depth: &DepthMap,
    relief: &Relief,
    normalized: &Normalized,
    params: &RegisterParams,
) -> Result<(Vec<Alignment>, PoseFeatures), RegisterError> {
    let pictures = Pictures::new(depth, relief, normalized, params).ok_or(RegisterError::NoPose)?;
    let few = pictures.at(COMPARED);
    let mut rivals = Rivals::of(&few, normalized).ok_or(RegisterError::NoPose)?;
    let cuts = near(rivals.best.cut);
    let closer = pictures.at(CLOSER);
    let woods = closer.strokes(cuts);
    let cuts = Cuts::new(cuts, &closer.ink, &woods);
    rivals.look_closer(&cuts).ok_or(RegisterError::NoPose)?;
    let (print_from_depth, spread) = pictures
        .look(&few, &rivals.best)
        .ok_or(RegisterError::NoPose)?;
    let choices = normalized.outcome.thresholds.iter();
    let alignments = choices.map(|choice| Alignment {
        metric: choice.metric,
        level: choice.level,
        print_from_depth,
        margin: rivals.margin(),
        at_bound: normalized.outcome.search_at_bound || choice.at_bound,
    });
    Ok((alignments.collect(), rivals.evidence(spread)))
}

/// A pose with the cut that fits the print's strokes there.
#[derive(Debug, Clone, Copy)]
struct Settled {
    found: PoseCandidate,
    overlap: PoseOverlap,
    cut: f64,
    /// Which of the tried cuts came nearest.
    nearest: usize,
}

impl Settled {
    /// What ranks poses: correlation, and how much of the tops has printed. Ink without tops is common, for strokes
    /// break off after a print was made; tops without ink are rare.
    fn score(&self) -> f64 {
        self.found.score * self.overlap.moving_covered
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
    fn of(pictures: &Scaled, normalized: &Normalized) -> Option<Self> {
        let woods = pictures.strokes(&FEW_CUTS);
        let tried = settle_all(&Cuts::new(&FEW_CUTS, &pictures.ink, &woods), normalized)?;
        let best = *best_of(&tried, |pose| !pose.found.mirrored)?;
        let elsewhere = |pose: &Settled| {
            !pose.found.mirrored && pose.found.rotation_to(&best.found) > SAME_POSE_DEG
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
        self.best = sharpened(cuts, &self.best.found)?;
        if !is_close {
            return Some(());
        }
        for rival in [&mut self.other_angle, &mut self.mirrored]
            .into_iter()
            .flatten()
        {
            *rival = sharpened(cuts, &rival.found)?;
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
    fn evidence(&self, spread: f64) -> PoseFeatures {
        let [other_angle, mirrored] = self.shares;
        PoseFeatures {
            correlation: self.best.found.score,
            tops_met: self.best.overlap.moving_covered,
            ink_met: self.best.overlap.fixed_covered,
            other_angle,
            mirrored,
            spread,
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
    ink: ImagePyramid,
    depths: ImagePyramid,
    px: usize,
    smoothing_px: f64,
    may_stretch: bool,
    /// Middle of the depth map, pixels.
    middle: [f64; 2],
}

impl Pictures {
    fn new(
        depth: &DepthMap,
        relief: &Relief,
        normalized: &Normalized,
        params: &RegisterParams,
    ) -> Option<Self> {
        let ink = SoftMask {
            amount: normalized.ink.map(|set| f32::from(u8::from(*set))),
            known: normalized.known.clone(),
        };
        let px = params.working_px as usize;
        Some(Self {
            ink: ImagePyramid::new(&ink, px)?,
            depths: ImagePyramid::new(&relief.depths(depth), px)?,
            px,
            smoothing_px: params.smoothing_px,
            may_stretch: params.anisotropic_scale,
            middle: [depth.levels.width(), depth.levels.height()].map(|side| side as f64 / 2.0),
        })
    }

    /// They at a share of the working size.
    fn at(&self, share: f64) -> Scaled<'_> {
        let px = (self.px as f64 * share).round() as usize;
        let sigma = self.smoothing_px * share.sqrt();
        Scaled {
            ink: self.ink.layer(px, sigma),
            depths: self.depths.at(px, sigma),
        }
    }

    /// The pose looked at once more, with the strokes of its cut, by the character alone: walls, frame lines and
    /// neighbours need not stand alike around print and relief. Where they do, they are looked at too. Says as well how
    /// far the answers lie apart.
    fn look(&self, few: &Scaled, best: &Settled) -> Option<(Affine2, f64)> {
        let wood = few.stroke(best.cut);
        let both = [&few.ink, &wood];
        let around = BorderStrokes::of(both, &best.found.fixed_from_moving)?;
        let [ink, wood] = around.without();
        let (closer, spread) = self.steadied(&Refiner::new(&ink, &wood), &best.found);
        let agree = BorderStrokes::of(both, &closer.fixed_from_moving)?.agree();
        let full = self.at(1.0);
        let wood = full.stroke(best.cut);
        let both = [&full.ink, &wood];
        let alone = if agree {
            None
        } else {
            Some(BorderStrokes::of(both, &closer.fixed_from_moving)?.without())
        };
        let [ink, wood] = alone.as_ref().map_or(both, |[ink, wood]| [ink, wood]);
        let refiner = Refiner::new(ink, wood);
        let refined = refiner.refine(&closer, MOST_STEPS, Loss::Tukey);
        let last = if self.may_stretch {
            stretched(&refiner, &refined, self.middle)
        } else {
            refined
        };
        Some((last.fixed_from_moving, spread))
    }

    /// The best of the answers from the pose and from a smaller and a larger one, and how far the others lie from it: few
    /// or broken strokes hold a pose where it happens to be.
    fn steadied(&self, refiner: &Refiner, pose: &PoseCandidate) -> (PoseCandidate, f64) {
        let answer = |k: f64| {
            let [x, y] = pose.fixed_from_moving.apply(self.middle);
            let resize = Affine2::scale_shift(k, [x - k * x, y - k * y]);
            let start = PoseCandidate {
                fixed_from_moving: resize.after(&pose.fixed_from_moving),
                ..*pose
            };
            refiner.refine(&start, MOST_STEPS, Loss::Tukey)
        };
        let answers = [1.0, 1.0 / OTHER_SIZE, OTHER_SIZE].map(answer);
        let best = answers.iter().fold(answers[0], |best, other| {
            if other.score > best.score {
                *other
            } else {
                best
            }
        });
        let apart = answers.iter().map(|other| self.apart(&best, other));
        (best, apart.fold(0.0, f64::max))
    }

    /// How far two poses lay the depth map's corners apart in the mean, a share of its longest side.
    fn apart(&self, one: &PoseCandidate, other: &PoseCandidate) -> f64 {
        let [width, height] = self.middle.map(|middle| 2.0 * middle);
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
        let distance = |corner: [f64; 2]| {
            let [a, b] = [one, other].map(|pose| pose.fixed_from_moving.apply(corner));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        let side = width.max(height) * one.fixed_from_moving.scale();
        corners.map(distance).iter().sum::<f64>() / 4.0 / side.max(1e-9)
    }
}

/// Print and relief at one size.
struct Scaled<'a> {
    ink: PyramidLevel,
    depths: LevelBuilder<'a>,
}

impl Scaled<'_> {
    /// The strokes of a cut under the tops.
    fn stroke(&self, cut: f64) -> PyramidLevel {
        self.depths.mapped(|d| soft_stroke(d, cut, SOFTNESS))
    }

    fn strokes(&self, cuts: &[f64]) -> Vec<PyramidLevel> {
        cuts.iter().map(|cut| self.stroke(*cut)).collect()
    }
}

/// The first few poses as read, and the best mirrored one.
fn settle_all(cuts: &Cuts, normalized: &Normalized) -> Option<Vec<Settled>> {
    let start = |pose: &Pose, mirrored| PoseCandidate {
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
fn settled(cuts: &Cuts, start: &PoseCandidate) -> Option<Settled> {
    let close = cuts
        .fitting(start)?
        .strokes
        .refine(start, FEW_STEPS, Loss::Huber);
    sharpened(cuts, &close)
}

/// A pose that is nearly right refined with the cut that fits best.
fn sharpened(cuts: &Cuts, start: &PoseCandidate) -> Option<Settled> {
    let strokes = cuts.fitting(start)?.strokes;
    let pose = strokes.refine(start, FEW_STEPS, Loss::Tukey);
    let fitting = cuts.fitting(&pose)?;
    Some(Settled {
        found: fitting.found,
        overlap: fitting.strokes.overlap(&pose),
        cut: fitting.cut,
        nearest: fitting.nearest,
    })
}
