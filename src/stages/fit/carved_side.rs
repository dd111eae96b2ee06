//! Decides which side of the plane is carved.
//!
//! Four kinds of evidence are combined as log-odds. The winding of the faces is right in most files and reversed in
//! some. Stroke tops are planed wood, so their heights are concentrated at one level; ground is gouged. The manifest
//! may give the direction of the scan. And the relief of the carved side agrees with the print. That weighs most,
//! because only the print shows the character.

use super::surface::{HeightSamples, Surface, quantile};
use crate::domain::{Bow, Rigid3, SideEvidence};
use crate::stages::pose::{
    BeamWidth, ImagePyramid, RefinementPass, Refiner, SearchRange, SoftMask, search_coarse_to_fine,
};
use crate::stages::print::Print;
use crate::stages::zbuffer::IndexedSurface;

/// A side with less than this share of the other side's relief is the back of the block.
const BACK: f64 = 0.35;
/// Weights in the log-odds: winding from -1 (inward) to 1 (outward), logarithm of the ratio of the layers' widths,
/// logarithm of the ratio of the agreements with the print, attribute of the manifest.
const WINDING: f64 = 2.0;
const SHARPNESS: f64 = 0.7;
const AGREEMENT: f64 = 14.0;
const MANIFEST: f64 = 0.4;
/// If the likelier side reaches this agreement, the other one is not measured: the highest agreement of 500 backs was
/// 0.55, measured with walls and frame lines included.
const CERTAIN: f64 = 0.62;
/// Agreement that is assumed for a side that was not measured.
const UNMEASURED: f64 = 0.45;
/// Lower bound of the agreement.
const LEAST_AGREEMENT: f64 = 0.02;
/// Limits of the search against the print: as in registration, but coarser.
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

/// Returns a beam with mirrored poses only. A side is rendered from outside, so its character is in mirror writing.
const fn mirrored(count: usize) -> BeamWidth {
    BeamWidth {
        upright: 0,
        mirrored: count,
    }
}

/// Working size at which the agreement is measured.
const JUDGED_PX: usize = 56;
/// Nearness to the tops below which nothing prints. The pose search uses the slopes around strokes as well, but around
/// thin strokes the slopes are too broad to measure the agreement.
const PRINTS: f32 = 0.7;
/// Working size of the print and the tops.
const BASE_PX: usize = 72;

/// Surface and measurements of one side.
#[derive(Debug)]
pub(super) struct FittedSide {
    pub(super) plane_from_mesh: Rigid3,
    pub(super) bow: Option<Bow>,
    pub(super) bow_height: f64,
    pub(super) relief: f64,
    pub(super) extent: f64,
    pub(super) surface: Surface,
    pub(super) samples: HeightSamples,
}

/// Further evidence for the side.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideInputs<'a> {
    pub(super) indexed: &'a IndexedSurface,
    pub(super) print: Option<&'a Print>,
    pub(super) scanned_face_down: Option<bool>,
}

/// Returns the carved side with the evidence for it. Returns `None` if neither side shows a surface.
pub(super) fn choose(
    sides: [Option<FittedSide>; 2],
    inputs: SideInputs<'_>,
) -> Option<(FittedSide, SideEvidence)> {
    let winding = |side: &FittedSide| inputs.indexed.upward_facing_share(&side.plane_from_mesh);
    let (side, confidence, winding) = match sides {
        [Some(first), Some(second)] => {
            let winding = winding(&first);
            let odds = log_odds(&first, &second, winding, inputs);
            let confidence = (odds.abs() / 2.0).tanh();
            // Faces that point outward on one side point inward on the other.
            if odds >= 0.0 {
                (first, confidence, winding)
            } else {
                (second, confidence, winding.map(|out| 1.0 - out))
            }
        }
        [Some(only), None] | [None, Some(only)] => {
            let winding = winding(&only);
            (only, 1.0, winding)
        }
        [None, None] => return None,
    };
    let evidence = SideEvidence {
        winding,
        flatness: side.surface.tops,
        confidence,
    };
    Some((side, evidence))
}

/// Returns the log-odds that the first side is the carved one.
fn log_odds(
    first: &FittedSide,
    second: &FittedSide,
    winding: Option<f64>,
    inputs: SideInputs<'_>,
) -> f64 {
    if first.relief < BACK * second.relief {
        return -10.0;
    }
    if second.relief < BACK * first.relief {
        return 10.0;
    }
    let winding = winding.map_or(0.0, |out| 2.0 * out - 1.0);
    let sharpness = (layer_width(second) / layer_width(first)).ln();
    let up = first.plane_from_mesh.0[2][2];
    let manifest = inputs
        .scanned_face_down
        .map_or(0.0, |down| if down { -up } else { up });
    let mesh_only =
        WINDING * winding + SHARPNESS * sharpness.clamp(-1.5, 1.5) + MANIFEST * manifest;
    let agreement = inputs.print.map_or(0.0, |print| {
        if mesh_only >= 0.0 {
            agreement(first, second, print)
        } else {
            -agreement(second, first, print)
        }
    });
    mesh_only + AGREEMENT * agreement
}

/// Returns the logarithm of the likelier side's agreement with the print divided by the other's, which is measured only
/// if the likelier one is not certain; 0 when the print shows no ink.
fn agreement(likelier: &FittedSide, other: &FittedSide, print: &Print) -> f64 {
    let Ok(hypotheses) = print.hypotheses() else {
        return 0.0;
    };
    let inks: Vec<ImagePyramid> = hypotheses
        .iter()
        .filter_map(|ink| ImagePyramid::new(&ink.soft, BASE_PX))
        .collect();
    let score = |side: &FittedSide| {
        // Seen from outside, so in mirror writing.
        let tops = side.samples.soft_tops(&side.surface, side.relief);
        let scores = inks.iter().map(|ink| best_score(ink, &tops));
        scores.fold(LEAST_AGREEMENT, f64::max)
    };
    let first = score(likelier);
    let second = if first >= CERTAIN {
        UNMEASURED
    } else {
        score(other)
    };
    (first / second).ln()
}

/// Returns the agreement of the mirrored rendering of a side with the ink: correlation times the share of the tops
/// that printed.
fn best_score(ink: &ImagePyramid, tops: &SoftMask) -> f64 {
    let Some(wood) = ImagePyramid::new(tops, BASE_PX) else {
        return 0.0;
    };
    let found = search_coarse_to_fine(ink, &wood, LIMITS, &PASSES);
    let print = ink.level(JUDGED_PX, 1.0);
    let tops = wood
        .level_builder(JUDGED_PX, 1.0)
        .mapped_level(|near| ((near - PRINTS) / (1.0 - PRINTS)).max(0.0));
    let judge = Refiner::new(&print, &tops);
    let scores = found
        .iter()
        .map(|pose| judge.evaluate(pose).score * judge.overlap(pose).moving_covered);
    scores.fold(0.0, f64::max)
}

/// Returns the width of the layer of heights at the tops: the interquartile range of the upper part of the relief, as a
/// share of the relief.
fn layer_width(side: &FittedSide) -> f64 {
    let mut upper = side.samples.residuals(&side.surface);
    upper.retain(|r| *r > -0.4 * side.relief);
    if upper.len() < 8 {
        return 1.0;
    }
    let (low, high) = (quantile(&mut upper, 0.25), quantile(&mut upper, 0.75));
    ((high - low) / side.relief.max(f64::MIN_POSITIVE)).max(0.005)
}
