//! Masks to alignment and scores (paper III-D).
//!
//! [`Method::Turns`] is the paper's: turns of the wrapped mask, the shift of each by climbing. [`Method::Refine`] is
//! ours: the pose that normalisation found, refined at full size.

mod confidence;
mod cuts;
mod refined;
mod stretch;
mod turns;

use serde::{Deserialize, Serialize};

use super::normalize::{Normalized, Relief};
use super::score::{self, SsimWindow, WindowMeans};
use crate::domain::{
    Affine2, FailureClass, MetricOutcome, PoseFeatures, RegisterOutcome, Scores, ThresholdMetric,
};
use crate::raster::{DepthMap, Mask, warp_mask};

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 10;

/// Mirrored must win by this factor to be named the cause: symmetric characters score alike both ways.
const MIRROR_WINS: f64 = 1.06;

/// How the alignment is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Robust sub-pixel refinement of the pose that normalisation found.
    Refine,
    /// Turns of the wrapped mask with climbed shifts: the paper's.
    Turns,
}

/// Settings of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// How the alignment is found.
    pub method: Method,
    /// `refine`: working size in pixels along the character, 32..=1024.
    pub working_px: u32,
    /// `refine`: smoothing in working pixels, 0..=10.
    pub smoothing_px: f64,
    /// `refine`: whether the pose may stretch the relief along one axis, as paper shrinks across its grain.
    pub stretch: bool,
    /// `refine`: a pair with less confidence than this is refused, 0..=1.
    pub least_confidence: f64,
    /// `turns`: how many angles of a full turn are tried first, 4 or more.
    pub coarse_angles: u32,
    /// `turns`: how many angles within three coarse steps each side are tried next, 2 or more.
    pub fine_angles: u32,
    /// Window of SSIM in the scores.
    pub window: SsimWindow,
}

/// Why the stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Normalisation left no pose and the method needs one.
    #[error(
        "register.method is refine but normalisation found no pose; set normalize.method to aligned"
    )]
    NoPose,
    /// A threshold was not chosen for a metric.
    #[error("normalisation chose no threshold for {0}")]
    NoThreshold(ThresholdMetric),
    /// The mask of a threshold is empty.
    #[error("the depth map has no strokes at the threshold of {0}")]
    NoStrokes(ThresholdMetric),
    /// The relief reads in mirror writing.
    #[error(
        "the relief matches the print better in mirror writing ({times:.2} times as well); was the mesh mirrored?"
    )]
    Mirrored {
        /// Score of the mirrored relief over that as read.
        times: f64,
    },
    /// Relief and print do not show the same character, or cannot be told to.
    #[error(
        "relief and print do not match: confidence {confidence:.2} is below register.least_confidence {needs}; is it the print of another character?"
    )]
    NoMatch {
        /// Chance that the best pose is right.
        confidence: f64,
        /// The setting.
        needs: f64,
    },
}

impl Error {
    /// What the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::NoPose
            | Self::NoThreshold(_)
            | Self::NoStrokes(_)
            | Self::Mirrored { .. }
            | Self::NoMatch { .. } => FailureClass::NoSolution,
        }
    }
}

/// The depth mask of one metric on the pair's canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct CanvasMasks {
    /// Which metric.
    pub metric: ThresholdMetric,
    /// The depth mask brought there by the alignment.
    pub depth: Mask,
}

/// What the stage gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Registered {
    /// The numbers.
    pub outcome: RegisterOutcome,
    /// The print mask on the canvas, one for all metrics.
    pub canvas_print: Mask,
    /// One canvas a metric, in the order of the outcome.
    pub canvases: Vec<CanvasMasks>,
}

/// A pose with what is known of its certainty.
#[derive(Debug, Clone, Copy)]
struct Alignment {
    metric: ThresholdMetric,
    level: u16,
    print_from_depth: Affine2,
    margin: f64,
    at_bound: bool,
}

impl Alignment {
    /// Whether the same strokes are laid on the same place.
    fn is_as(&self, other: &Self) -> bool {
        self.level == other.level && self.print_from_depth == other.print_from_depth
    }
}

/// Aligns the depth map with the print for each metric's threshold and scores the masks on the canvas.
///
/// The canvas is the print character's: see [`super::normalize`]. Every metric is scored on the same print mask.
///
/// # Errors
/// When there is no pose to refine, the best one is not to be trusted, or a threshold leaves no strokes.
pub fn register(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &Params,
) -> Result<Registered, Error> {
    let side = normalized.outcome.canvas_px as usize;
    let canvas_from_print = normalized.outcome.canvas_from_print;
    let canvas_print = warp_mask(&normalized.ink, &canvas_from_print, side, side);
    let (alignments, evidence) = match params.method {
        Method::Refine => {
            let relief = Relief::of(depth).ok_or(Error::NoPose)?;
            let (alignments, evidence) = refined::align(depth, &relief, normalized, params)?;
            require_match(&evidence, params)?;
            (alignments, Some((evidence, relief)))
        }
        Method::Turns => (
            turns::align(depth, &canvas_print, normalized, params)?,
            None,
        ),
    };
    let print_means = WindowMeans::new(&canvas_print, params.window);
    let masks = masks(&alignments, |pose, levels| {
        depth.strokes_in(&canvas_from_print.after(pose), [side; 2], levels)
    });
    let mut metrics: Vec<MetricOutcome> = Vec::new();
    for (k, (alignment, mask)) in alignments.iter().zip(&masks).enumerate() {
        if mask.count() == 0 {
            return Err(Error::NoStrokes(alignment.metric));
        }
        // Metrics often choose the same threshold.
        let mut before = alignments[..k].iter();
        let twin = before.position(|other| other.is_as(alignment));
        let scores = twin.map_or_else(
            || score::measure(&print_means, mask),
            |twin| metrics[twin].scores,
        );
        metrics.push(outcome(depth, normalized, alignment, scores));
    }
    if let Some((evidence, relief)) = &evidence {
        trust(&mut metrics, evidence, |level| relief.growth(depth, level));
    }
    Ok(Registered {
        outcome: RegisterOutcome {
            metrics,
            evidence: evidence.map(|(evidence, _)| evidence),
        },
        canvas_print,
        canvases: alignments
            .iter()
            .zip(masks)
            .map(|(alignment, depth)| CanvasMasks {
                metric: alignment.metric,
                depth,
            })
            .collect(),
    })
}

/// The mask of each alignment; `strokes` makes those of some levels at one pose.
fn masks(alignments: &[Alignment], strokes: impl Fn(&Affine2, &[u16]) -> Vec<Mask>) -> Vec<Mask> {
    let mut masks = Vec::new();
    for alike in alignments.chunk_by(|one, other| one.print_from_depth == other.print_from_depth) {
        let levels: Vec<u16> = alike.iter().map(|alignment| alignment.level).collect();
        masks.extend(strokes(&alike[0].print_from_depth, &levels));
    }
    masks
}

/// Gives each metric its confidence: the pose's, and the mask's beside the one that the relief alone chose. `growth` is
/// that of the strokes at a level.
fn trust(metrics: &mut [MetricOutcome], evidence: &PoseFeatures, growth: impl Fn(u16) -> f64) {
    let pose = confidence::of_pose(evidence);
    let rim = |outcome: &MetricOutcome| {
        growth(outcome.threshold_level) * outcome.scores.density_depth.sqrt()
    };
    let own = metrics
        .iter()
        .find(|outcome| outcome.metric == ThresholdMetric::Relief);
    let own = own.map(|outcome| (outcome.scores.density_depth, rim(outcome)));
    for outcome in metrics {
        let scores = outcome.scores;
        let (relief, relief_rim) = own.unwrap_or((scores.density_depth, f64::INFINITY));
        let areas = confidence::Areas {
            mask: scores.density_depth,
            relief,
            ink: scores.density_print,
            rim: rim(outcome).min(relief_rim),
        };
        outcome.confidence = Some(pose * confidence::of_mask(evidence, areas));
    }
}

/// Refuses what cannot be told to be the same character.
fn require_match(evidence: &PoseFeatures, params: &Params) -> Result<(), Error> {
    let confidence = confidence::of_pose(evidence);
    if evidence.mirrored > MIRROR_WINS && params.least_confidence > 0.0 {
        Err(Error::Mirrored {
            times: evidence.mirrored,
        })
    } else if confidence >= params.least_confidence {
        Ok(())
    } else {
        Err(Error::NoMatch {
            confidence,
            needs: params.least_confidence,
        })
    }
}

fn outcome(
    depth: &DepthMap,
    normalized: &Normalized,
    alignment: &Alignment,
    scores: Scores,
) -> MetricOutcome {
    let middle =
        |width: usize, height: usize| [(width - 1) as f64 / 2.0, (height - 1) as f64 / 2.0];
    let [u, v] = middle(normalized.ink.width(), normalized.ink.height());
    let [x, y] = alignment
        .print_from_depth
        .apply(middle(depth.levels.width(), depth.levels.height()));
    MetricOutcome {
        metric: alignment.metric,
        threshold_level: alignment.level,
        threshold_depth: depth.scale.height(alignment.level),
        print_from_depth: alignment.print_from_depth,
        angle_deg: alignment.print_from_depth.angle_deg(),
        scale: alignment.print_from_depth.scale(),
        shift_px: [x - u, y - v],
        scores,
        margin: alignment.margin,
        confidence: None,
        at_bound: alignment.at_bound,
    }
}

/// The level that normalisation chose for a metric, and whether it lay at the end of its range.
fn chosen(normalized: &Normalized, metric: ThresholdMetric) -> Result<(u16, bool), Error> {
    let mut choices = normalized.outcome.thresholds.iter();
    choices
        .find(|choice| choice.metric == metric)
        .map(|choice| (choice.level, choice.at_bound))
        .ok_or(Error::NoThreshold(metric))
}

#[cfg(test)]
mod tests;
