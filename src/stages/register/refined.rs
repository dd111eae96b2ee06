//! Our registration: the poses that normalisation found, refined and compared; the best one, looked at closely, serves
//! every metric.

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
/// Shares of the working size at which poses are compared, and at which the best one finds its cut.
const COMPARED: f64 = 0.42;
const CLOSER: f64 = 0.67;
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
    let rivals = Rivals::of(&pictures, normalized).ok_or(Error::NoPose)?;
    let (ink, woods) = pictures.cut(CLOSER);
    let cuts = Cuts::new(&ink, &woods);
    let best = settled(&cuts, &rivals.best.found).ok_or(Error::NoPose)?;
    let print_from_depth = pictures.look(&best.found, cuts.best_cut(&best.found));
    let choices = normalized.outcome.thresholds.iter();
    let alignments = choices.map(|choice| Alignment {
        metric: choice.metric,
        level: choice.level,
        print_from_depth,
        margin: rivals.margin(),
        at_bound: normalized.outcome.search_at_bound || choice.at_bound,
    });
    Ok((alignments.collect(), rivals.evidence(&best)))
}

/// A pose with the cut that fits the print's strokes there.
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
}

/// The best pose beside the best of those that cannot be right if it is.
#[derive(Debug, Clone, Copy)]
struct Rivals {
    best: Settled,
    /// Score of the best pose at another angle, and of the best in mirror writing.
    other_angle: f64,
    mirrored: f64,
}

impl Rivals {
    /// Compares the poses that normalisation found.
    fn of(pictures: &Pictures, normalized: &Normalized) -> Option<Self> {
        let (ink, woods) = pictures.cut(COMPARED);
        let tried = settle_all(&Cuts::new(&ink, &woods), normalized)?;
        let best = *best_of(&tried, |pose| !pose.found.mirrored)?;
        let score_of = |other: Option<&Settled>| other.map_or(0.0, Settled::score);
        Some(Self {
            best,
            other_angle: score_of(best_of(&tried, |pose| {
                !pose.found.mirrored && pose.found.turn_from(&best.found) > SAME_POSE_DEG
            })),
            mirrored: score_of(best_of(&tried, |pose| pose.found.mirrored)),
        })
    }

    /// By how much the best pose wins.
    fn margin(&self) -> f64 {
        self.best.score() - self.other_angle.max(self.mirrored)
    }

    /// What speaks for and against the best pose, given what was seen of it from closer by.
    fn evidence(&self, closer: &Settled) -> Evidence {
        let own = self.best.score().max(1e-6);
        Evidence {
            correlation: closer.found.score,
            tops_met: closer.overlap.moving_met,
            ink_met: closer.overlap.fixed_met,
            other_angle: self.other_angle / own,
            mirrored: self.mirrored / own,
        }
    }
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
        })
    }

    /// The ink, and the strokes of every cut, at a share of the working size.
    fn cut(&self, share: f64) -> (Layer, Vec<Layer>) {
        self.layers(share, &CUTS)
    }

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

    /// The pose looked at once more at working size, with the strokes of a cut.
    fn look(&self, best: &Found, cut: f64) -> Affine2 {
        let (ink, woods) = self.layers(1.0, &[cut]);
        let refined = woods
            .first()
            .map(|wood| Refiner::new(&ink, wood).refine(best, MOST_STEPS, Loss::Tukey));
        refined.unwrap_or(*best).fixed_from_moving
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
