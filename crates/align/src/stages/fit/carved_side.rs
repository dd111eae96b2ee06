//! Decides which side of the plane is carved.
//!
//! Four kinds of evidence are combined as log-odds:
//!
//! - Winding: the faces are wound outward in most files.
//! - Flatness: stroke tops are planed and have about the same height; the ground is gouged and rough.
//! - Manifest: it may state whether the block lay face down in the scan.
//! - Print: the relief of the carved side resembles the print. This weighs most, as only the print shows the character.

use super::height_samples::quantile;
use super::print_agreement::InkPyramids;
use super::side_surface::FittedSide;
use crate::stages::zbuffer::IndexedSurface;
use mocban_core::domain::SideEvidence;

/// If the relief of a side is below this fraction of the other side's relief, the side is the back of the block.
const BACK: f64 = 0.35;
/// Log-odds against the back. Spikes and debris can hide the relief of the carved side, so the print may outweigh them.
const BACK_ODDS: f64 = 4.0;
/// Weight of the winding, from -1 (inward) to 1 (outward).
const WINDING: f64 = 2.0;
/// Nearly all faces point to one side if the winding exceeds this in either direction. If the agreements are low, the
/// log-odds of that side are then higher by [`UNANIMOUS_ODDS`].
const UNANIMOUS: f64 = 0.9;
const UNANIMOUS_ODDS: f64 = 1.5;
/// Weight of the logarithm of the ratio of the two layer widths.
const SHARPNESS: f64 = 0.7;
/// Weight of the logarithm of the ratio of the two agreements.
pub(super) const AGREEMENT: f64 = 14.0;
/// Weight of the scan direction in the manifest, from -1 to 1.
const MANIFEST: f64 = 0.4;
/// If the side that is likelier without the print agrees with the print at least this much, the agreement of the other
/// side is not measured. Backs of blocks had agreements up to 0.55.
const CERTAIN: f64 = 0.62;
/// Agreement that is assumed for a side that was not measured.
const UNMEASURED: f64 = 0.45;
/// Further evidence for the side.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideInputs<'a> {
    pub(super) indexed: &'a IndexedSurface,
    pub(super) inks: Option<&'a InkPyramids>,
    pub(super) scanned_face_down: Option<bool>,
}

/// Log-odds of a side, and the agreements of both sides with the print, as far as they were measured.
#[derive(Debug, Clone, Copy)]
struct SideOdds {
    odds: f64,
    agreements: [Option<f64>; 2],
}

/// The chosen side.
#[derive(Debug)]
pub(super) struct CarvedSide {
    pub(super) side: FittedSide,
    pub(super) evidence: SideEvidence,
    /// Agreement of this side with the print, from 0 to 1. `None` if it was not measured.
    pub(super) agreement: Option<f64>,
    /// The side that was not chosen.
    pub(super) other: Option<FittedSide>,
}

impl CarvedSide {
    /// Returns the evidence for the side that was not chosen.
    pub(super) fn evidence_of_other(&self, other: &FittedSide) -> SideEvidence {
        SideEvidence {
            winding: self.evidence.winding.map(|out| 1.0 - out),
            flatness: other.surface.tops,
            confidence: 0.0,
        }
    }
}

/// Chooses the carved side. Returns the side with the evidence for it, or `None` if neither side shows a surface.
pub(super) fn choose(sides: [Option<FittedSide>; 2], inputs: SideInputs<'_>) -> Option<CarvedSide> {
    let winding = |side: &FittedSide| inputs.indexed.upward_facing_share(&side.plane_from_mesh);
    let (side, other, confidence, winding, agreement) = match sides {
        [Some(first), Some(second)] => {
            let winding = winding(&first);
            let SideOdds {
                odds,
                agreements: [of_first, of_second],
            } = log_odds(&first, &second, winding, inputs);
            let confidence = (odds.abs() / 2.0).tanh();
            // Faces that point outward on one side point inward on the other.
            if odds >= 0.0 {
                (first, Some(second), confidence, winding, of_first)
            } else {
                let winding = winding.map(|out| 1.0 - out);
                (second, Some(first), confidence, winding, of_second)
            }
        }
        [Some(only), None] | [None, Some(only)] => {
            let winding = winding(&only);
            (only, None, 1.0, winding, None)
        }
        [None, None] => return None,
    };
    let evidence = SideEvidence {
        winding,
        flatness: side.surface.tops,
        confidence,
    };
    Some(CarvedSide {
        side,
        evidence,
        agreement,
        other,
    })
}

/// Returns the log-odds that the first side is the carved one.
fn log_odds(
    first: &FittedSide,
    second: &FittedSide,
    winding: Option<f64>,
    inputs: SideInputs<'_>,
) -> SideOdds {
    let winding = winding.map_or(0.0, |out| 2.0 * out - 1.0);
    let sharpness = (layer_width(second) / layer_width(first)).ln();
    let up = first.plane_from_mesh.0[2][2];
    let manifest = inputs
        .scanned_face_down
        .map_or(0.0, |down| if down { -up } else { up });
    let mesh_only = if first.relief < BACK * second.relief {
        -BACK_ODDS
    } else if second.relief < BACK * first.relief {
        BACK_ODDS
    } else {
        WINDING * winding + SHARPNESS * sharpness.clamp(-1.5, 1.5) + MANIFEST * manifest
    };
    let Some(inks) = inputs.inks else {
        return SideOdds {
            odds: mesh_only,
            agreements: [None; 2],
        };
    };
    let (likelier, other) = if mesh_only >= 0.0 {
        (first, second)
    } else {
        (second, first)
    };
    let a = inks.agreement(likelier);
    let measured = (a < CERTAIN).then(|| inks.agreement(other));
    let advantage = AGREEMENT * (a / measured.unwrap_or(UNMEASURED)).ln();
    let unanimous = measured.map_or(0.0, |b| unanimous_odds(winding, a.max(b)));
    let (odds, agreements) = if mesh_only >= 0.0 {
        (mesh_only + unanimous + advantage, [Some(a), measured])
    } else {
        (mesh_only + unanimous - advantage, [measured, Some(a)])
    };
    SideOdds { odds, agreements }
}

/// Returns the log-odds of the first side, if nearly all faces point to one side and even the higher agreement is low:
/// such agreements are no better than chance. `winding` is from -1 to 1.
fn unanimous_odds(winding: f64, agreement: f64) -> f64 {
    if agreement < CERTAIN && winding.abs() > UNANIMOUS {
        UNANIMOUS_ODDS * winding.signum()
    } else {
        0.0
    }
}

/// Returns the interquartile range of the heights near the stroke tops, as a fraction of the relief, 0.005 or more.
/// Uses the heights that are less than 0.4 times the relief below the surface. Returns 1 if these are fewer than 8.
fn layer_width(side: &FittedSide) -> f64 {
    let mut upper = side.samples.residuals(&side.surface);
    upper.retain(|r| *r > -0.4 * side.relief);
    if upper.len() < 8 {
        return 1.0;
    }
    let (low, high) = (quantile(&mut upper, 0.25), quantile(&mut upper, 0.75));
    ((high - low) / side.relief.max(f64::MIN_POSITIVE)).max(0.005)
}

#[cfg(test)]
mod tests {
    use super::{AGREEMENT, WINDING, unanimous_odds};

    #[test]
    fn unanimous_winding_outweighs_a_small_difference_of_low_agreements() {
        // The side that all faces point away from agrees better by a fifth.
        let advantage = AGREEMENT * (0.42_f64 / 0.35).ln();
        assert!(advantage > WINDING);
        assert!(advantage < WINDING + unanimous_odds(1.0, 0.42));
        assert_eq!(unanimous_odds(-1.0, 0.42), -unanimous_odds(1.0, 0.42));
        // An agreement that is seldom reached by chance, or faces that point both ways.
        assert_eq!(unanimous_odds(1.0, 0.8), 0.0);
        assert_eq!(unanimous_odds(0.6, 0.42), 0.0);
    }
}
