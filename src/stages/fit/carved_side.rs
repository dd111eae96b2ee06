//! Decides which side of the plane is carved.
//!
//! Four kinds of evidence are combined as log-odds:
//!
//! - Winding: the faces are wound outward in most files.
//! - Flatness: stroke tops are planed and have about the same height; the ground is gouged and rough.
//! - Manifest: it may give the direction of the scan.
//! - Print: the relief of the carved side resembles the print. This weighs most, as only the print shows the character.

use super::surface::{HeightSamples, Surface, quantile};
use crate::domain::{Bow, Rigid3, SideEvidence};
use crate::stages::pose::{
    BeamWidth, ImagePyramid, RefinementPass, Refiner, SearchRange, SoftMask, search_coarse_to_fine,
};
use crate::stages::print::Print;
use crate::stages::zbuffer::IndexedSurface;

/// If the relief of one side is below this share of the opposite relief, that side is the back of the block.
const BACK: f64 = 0.35;
/// Weight of the winding, from -1 (inward) to 1 (outward).
const WINDING: f64 = 2.0;
/// Weight of the logarithm of the ratio of the two layer widths.
const SHARPNESS: f64 = 0.7;
/// Weight of the logarithm of the ratio of the two agreements.
const AGREEMENT: f64 = 14.0;
/// Weight of the scan direction in the manifest, from -1 to 1.
const MANIFEST: f64 = 0.4;
/// If the likelier side reaches this agreement with the print, the other side is not measured. The highest agreement of
/// 500 backs was 0.55, with walls and frame lines included.
const CERTAIN: f64 = 0.62;
/// Agreement that is assumed for a side that was not measured.
const UNMEASURED: f64 = 0.45;
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

/// Returns a beam of mirrored poses only, because a block seen from outside shows mirror writing.
const fn mirrored(count: usize) -> BeamWidth {
    BeamWidth {
        upright: 0,
        mirrored: count,
    }
}

/// Working size at which the agreement is measured.
const JUDGED_PX: usize = 56;
/// Pixels with a lower nearness to the surface are assumed not to print. Without this limit, the slopes around thin
/// strokes would count as strokes. Only the pose search uses the slopes.
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

/// Chooses the carved side. Returns the side with the evidence for it, or `None` if neither side shows a surface.
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

/// Returns `ln(a / b)` for the agreement a of the likelier side with the print and the agreement b of the other side.
/// If a is at least `CERTAIN`, b is not measured. Returns 0 if the print shows no ink.
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

/// Returns the best agreement of a side with the ink: the correlation times the share of the stroke tops that printed.
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

/// Returns the interquartile range of the heights near the stroke tops, as a share of the relief. Heights far below the
/// surface are left out.
fn layer_width(side: &FittedSide) -> f64 {
    let mut upper = side.samples.residuals(&side.surface);
    upper.retain(|r| *r > -0.4 * side.relief);
    if upper.len() < 8 {
        return 1.0;
    }
    let (low, high) = (quantile(&mut upper, 0.25), quantile(&mut upper, 0.75));
    ((high - low) / side.relief.max(f64::MIN_POSITIVE)).max(0.005)
}
