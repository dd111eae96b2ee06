//! Scores of the alignments on the pair's canvas.

use super::confidence::ConfidenceInputs;
use super::params::RegisterError;
use super::stroke_map::StrokeMap;
use crate::stages::normalize::Normalized;
use crate::stages::score::{self, SsimReference, SsimWindow};
use mocban_core::domain::{
    Affine2, Disagreement, MetricOutcome, RegisterOutcome, Scores, ThresholdMetric,
};
use mocban_core::raster::{DepthMap, Grid, Mask, warp_mask};

/// A metric's threshold and pose before they are scored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alignment {
    /// Which metric.
    pub(crate) metric: ThresholdMetric,
    /// Depth-map levels from this one up are stroke.
    pub(crate) level: u16,
    /// Depth-map pixels to print-image pixels.
    pub(crate) print_from_depth: Affine2,
    /// Score of the pose minus the score of the best other pose.
    pub(crate) margin: f64,
    /// Whether the threshold or the scale lies at an end of its searched range.
    pub(crate) at_bound: bool,
}

/// Result of the register stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Registered {
    /// The numbers.
    pub outcome: RegisterOutcome,
    /// The print mask on the canvas, one for all metrics.
    pub canvas_print: Mask,
    /// The depth mask of each metric on the canvas, in the order of `outcome.metrics`.
    pub canvas_depths: Vec<Mask>,
    /// The map of missing ink and missing wood of each metric on the canvas, see [`StrokeMap::grey`]. In the order of
    /// `outcome.metrics`.
    pub stroke_maps: Vec<Grid<u8>>,
    /// Inputs of the confidence model for each metric, in the order of `outcome.metrics`. Empty if the paper's method
    /// was used. `cargo bench --bench accuracy -- --fit-confidence` fits the model to such inputs.
    pub confidence_inputs: Vec<ConfidenceInputs>,
}

impl Registered {
    /// Levels the depth map that was registered, if the registration did. Thresholds refer to the result.
    #[must_use]
    pub fn levelled(&self, depth: DepthMap) -> DepthMap {
        match &self.outcome.levelling {
            Some(levelling) => depth.levelled(levelling),
            None => depth,
        }
    }
}

/// Warps one interpretation of the print's ink to the pair's canvas.
pub(crate) fn canvas_print(normalized: &Normalized, ink: usize) -> Mask {
    let side = normalized.outcome.canvas_px as usize;
    let canvas_from_print = normalized.outcome.inks[ink].canvas_from_print;
    let masks = &normalized.prints[ink];
    let canvas_from_masks = canvas_from_print.after(&masks.print_from_masks());
    warp_mask(&masks.ink, &canvas_from_masks, side, side)
}

/// Warps the depth mask of each alignment to the canvas and scores it against `canvas_print`. `canvas_print` shows the
/// interpretation of the print with the index `ink`. `stroke_map` returns the map of an alignment.
///
/// # Errors
/// Returns an error if a threshold leaves no strokes.
pub(crate) fn score_alignments(
    depth: &DepthMap,
    normalized: &Normalized,
    ink: usize,
    canvas_print: Mask,
    alignments: &[Alignment],
    stroke_map: impl Fn(&Alignment) -> StrokeMap,
    window: SsimWindow,
) -> Result<Registered, RegisterError> {
    let canvas_from_print = normalized.outcome.inks[ink].canvas_from_print;
    let print_size = normalized.prints[ink].print_size();
    let side = normalized.outcome.canvas_px as usize;
    let print_means = SsimReference::new(&canvas_print, window);
    let mut masks = Vec::new();
    // Masks of one pose share their sampling.
    for alike in alignments.chunk_by(|one, other| one.print_from_depth == other.print_from_depth) {
        let levels: Vec<u16> = alike.iter().map(|alignment| alignment.level).collect();
        let canvas_from_depth = canvas_from_print.after(&alike[0].print_from_depth);
        masks.extend(depth.warped_stroke_masks(&canvas_from_depth, [side; 2], &levels));
    }
    let mut metrics: Vec<MetricOutcome> = Vec::new();
    let mut stroke_maps: Vec<Grid<u8>> = Vec::new();
    for (k, (alignment, mask)) in alignments.iter().zip(&masks).enumerate() {
        if mask.count() == 0 {
            return Err(RegisterError::EmptyMask(alignment.metric));
        }
        // Metrics often choose the same threshold.
        let mut before = alignments[..k].iter();
        let twin = before.position(|other| {
            (other.level, other.print_from_depth) == (alignment.level, alignment.print_from_depth)
        });
        let (scores, disagreement, grey) = if let Some(twin) = twin {
            let like = &metrics[twin];
            (like.scores, like.disagreement, stroke_maps[twin].clone())
        } else {
            let StrokeMap { grey, disagreement } = stroke_map(alignment);
            (score::score_masks(&print_means, mask), disagreement, grey)
        };
        metrics.push(outcome(depth, print_size, alignment, scores, disagreement));
        stroke_maps.push(grey);
    }
    Ok(Registered {
        outcome: RegisterOutcome {
            ink,
            metrics,
            features: None,
            levelling: None,
            displaced: None,
        },
        confidence_inputs: Vec::new(),
        canvas_print,
        canvas_depths: masks,
        stroke_maps,
    })
}

fn outcome(
    depth: &DepthMap,
    print_size: [usize; 2],
    alignment: &Alignment,
    scores: Scores,
    disagreement: Disagreement,
) -> MetricOutcome {
    let middle =
        |width: usize, height: usize| [(width - 1) as f64 / 2.0, (height - 1) as f64 / 2.0];
    let [u, v] = middle(print_size[0], print_size[1]);
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
        disagreement,
        margin: alignment.margin,
        confidence: None,
        at_bound: alignment.at_bound,
    }
}
