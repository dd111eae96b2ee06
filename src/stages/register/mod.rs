//! Masks to alignment and scores (paper III-D).
//!
//! [`RegisterMethod::Exhaustive`] is the paper's: turns of the wrapped mask, the shift of each by climbing. [`RegisterMethod::Refine`] is
//! ours: the pose that normalisation found, refined at full size.

mod alignment;
mod anisotropic_scale;
mod confidence;
mod params;
mod refine;
mod soft_thresholds;

pub(super) use alignment::{Alignment, chosen};
pub use params::{RegisterError, RegisterMethod, RegisterParams};

use super::normalize::{Normalized, Relief};
use super::paper_method::register as exhaustive;
use super::score::{self, SsimReference};
use crate::domain::{
    Affine2, MetricOutcome, PoseFeatures, RegisterOutcome, Scores, ThresholdMetric,
};
use crate::raster::{DepthMap, Mask, warp_mask};

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 10;

/// Mirrored must win by this factor to be named the cause: symmetric characters score alike both ways.
const MIRROR_WINS: f64 = 1.06;

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

/// Aligns the depth map with the print for each metric's threshold and scores the masks on the canvas.
///
/// The canvas is the print character's: see [`super::normalize`]. Every metric is scored on the same print mask.
///
/// # Errors
/// When there is no pose to refine, the best one is not to be trusted, or a threshold leaves no strokes.
pub fn register(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &RegisterParams,
) -> Result<Registered, RegisterError> {
    let side = normalized.outcome.canvas_px as usize;
    let canvas_from_print = normalized.outcome.canvas_from_print;
    let canvas_print = warp_mask(&normalized.ink, &canvas_from_print, side, side);
    let (alignments, evidence) = match params.method {
        RegisterMethod::Refine => {
            let relief = Relief::of(depth).ok_or(RegisterError::NoPose)?;
            let (alignments, evidence) = refine::align(depth, &relief, normalized, params)?;
            require_match(&evidence, params)?;
            (alignments, Some((evidence, relief)))
        }
        RegisterMethod::Exhaustive => (
            exhaustive::align(depth, &canvas_print, normalized, params)?,
            None,
        ),
    };
    let print_means = SsimReference::new(&canvas_print, params.window);
    let masks = masks(&alignments, |pose, levels| {
        depth.warped_stroke_masks(&canvas_from_print.after(pose), [side; 2], levels)
    });
    let mut metrics: Vec<MetricOutcome> = Vec::new();
    for (k, (alignment, mask)) in alignments.iter().zip(&masks).enumerate() {
        if mask.count() == 0 {
            return Err(RegisterError::NoStrokes(alignment.metric));
        }
        // Metrics often choose the same threshold.
        let mut before = alignments[..k].iter();
        let twin = before.position(|other| other.is_as(alignment));
        let scores = twin.map_or_else(
            || score::score_masks(&print_means, mask),
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
fn require_match(evidence: &PoseFeatures, params: &RegisterParams) -> Result<(), RegisterError> {
    let confidence = confidence::of_pose(evidence);
    if evidence.mirrored > MIRROR_WINS && params.min_confidence > 0.0 {
        Err(RegisterError::Mirrored {
            times: evidence.mirrored,
        })
    } else if confidence >= params.min_confidence {
        Ok(())
    } else {
        Err(RegisterError::NoMatch {
            confidence,
            needs: params.min_confidence,
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

#[cfg(test)]
mod tests;
