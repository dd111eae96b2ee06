//! Measures how well the relief of one side of a block resembles the print.

use super::side_surface::FittedSide;
use crate::stages::binarize::inside;
use crate::stages::pose::{
    BeamWidth, ImagePyramid, RefinementPass, Refiner, SearchRange, SoftMask, search_coarse_to_fine,
};
use crate::stages::print::{Print, pixel_sigma};
use mocban_core::domain::PrintOutline;

/// Lower bound of the agreement.
const LEAST_AGREEMENT: f64 = 0.02;
/// Limits of the pose search that compares a side with the print. The search is coarser than in registration.
const LIMITS: SearchRange = SearchRange {
    max_scale: 1.6,
    beam_width: mirrored(5),
};
const PASSES: [RefinementPass; 2] = [
    RefinementPass {
        size_px: 36,
        sigma_px: 0.8,
        max_steps: 6,
        beam_width: mirrored(2),
    },
    RefinementPass {
        size_px: JUDGED_PX,
        sigma_px: 1.0,
        max_steps: 5,
        beam_width: mirrored(1),
    },
];

/// Returns the width of a beam without upright poses, because a block seen from outside shows mirror writing.
const fn mirrored(count: usize) -> BeamWidth {
    BeamWidth {
        upright: 0,
        mirrored: count,
    }
}

/// Working size at which the agreement is measured.
const JUDGED_PX: usize = 56;
/// Pixels whose nearness to the surface is below this are assumed not to print. Without this limit, the slopes around
/// thin strokes would count as strokes. Only the pose search uses the slopes.
const PRINTS: f32 = 0.7;
/// Working size of the print and the tops.
const BASE_PX: usize = 72;

/// Image pyramids of all interpretations of a print, to be compared with many sides.
#[derive(Debug)]
pub(super) struct InkPyramids {
    inks: Vec<ImagePyramid>,
    /// Least smoothing, see [`pixel_sigma`].
    pixel_sigma: f64,
}

impl InkPyramids {
    /// Builds the pyramids of a print. Returns `None` if the print cannot be binarized.
    pub(super) fn new(print: &Print) -> Option<Self> {
        let read = print.hypotheses().ok()?;
        let inks = read
            .iter()
            .filter_map(|ink| ImagePyramid::new(&ink.soft, BASE_PX));
        let known = &read.first()?.soft.known;
        Some(Self {
            inks: inks.collect(),
            pixel_sigma: pixel_sigma(print.mask_scale(), known.bounding_box()),
        })
    }

    /// Builds the pyramids of the part of a print inside an outline in pixels of the print. Returns `None` if the outline
    /// contains no pixel, or if the print cannot be binarized.
    pub(super) fn within(print: &Print, outline: &PrintOutline) -> Option<Self> {
        let outline = outline.mapped(&print.mask_scale().masks_from_print());
        let read = print.hypotheses().ok()?;
        let known = &read.first()?.soft.known;
        let inside = inside(&outline, [known.width(), known.height()]);
        let bounds = inside.bounding_box()?;
        let mut inks = Vec::new();
        for ink in read {
            let known = ink
                .soft
                .known
                .zip_map(&inside, |known, inside| known && inside);
            let part = SoftMask {
                amount: ink.soft.amount.part(bounds),
                known: known.part(bounds),
            };
            inks.extend(ImagePyramid::new(&part, BASE_PX));
        }
        Some(Self {
            inks,
            pixel_sigma: pixel_sigma(print.mask_scale(), Some(bounds)),
        })
    }

    /// Returns the best agreement of a side with any interpretation of the print, from `LEAST_AGREEMENT` to 1.
    pub(super) fn agreement(&self, side: &FittedSide) -> f64 {
        // The samples show the block from outside, so the tops are in mirror writing.
        let tops = side.samples.soft_tops(&side.surface, side.relief);
        let passes = PASSES.map(|pass| pass.smoothed(self.pixel_sigma));
        let scores = self.inks.iter().map(|ink| best_score(ink, &tops, &passes));
        scores.fold(LEAST_AGREEMENT, f64::max)
    }
}

/// Returns the best agreement of a side with the ink: the correlation times the fraction of the stroke tops that
/// printed. It is measured at the size and the smoothing of the last pass.
fn best_score(ink: &ImagePyramid, tops: &SoftMask, passes: &[RefinementPass; 2]) -> f64 {
    let Some(wood) = ImagePyramid::new(tops, BASE_PX) else {
        return 0.0;
    };
    let found = search_coarse_to_fine(ink, &wood, LIMITS, passes);
    let RefinementPass {
        size_px, sigma_px, ..
    } = passes[1];
    let print = ink.level(size_px, sigma_px);
    let tops = wood
        .level_builder(size_px, sigma_px)
        .mapped_level(|near| ((near - PRINTS) / (1.0 - PRINTS)).max(0.0));
    let judge = Refiner::new(&print, &tops);
    let scores = found
        .iter()
        .map(|pose| judge.evaluate(pose).score * judge.overlap(pose).moving_covered);
    scores.fold(0.0, f64::max)
}
