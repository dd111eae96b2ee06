//! Searches the parts of a print for the character of the block, if the whole print does not resemble the block.
//!
//! A print may show neighbouring characters around the character that the block shows alone.

use super::params::FitParams;
use super::print_agreement::InkPyramids;
use super::print_parts::print_parts;
use super::side_surface::{FINE, FittedSide, coarse_sides, fit_view};
use super::wider_search::{FoundSide, LEAST, evidence};
use crate::stages::print::Print;
use crate::stages::zbuffer::IndexedSurface;
use mocban_core::domain::{PrintOutline, Rigid3};

/// The parts of a print that is enlarged more times are not tried: they show too few pixels of a character.
const MOST_ENLARGED: u32 = 2;

/// Compares both sides of `start`'s plane with the parts of the print. Returns the side that resembles a part best,
/// with the outline of the part. Returns `None` if no agreement reaches [`LEAST`], or if the finer fit of the side
/// finds no carving.
pub(super) fn search(
    indexed: &IndexedSurface,
    start: &Rigid3,
    print: &Print,
    params: &FitParams,
) -> Option<FoundSide> {
    let scale = print.mask_scale();
    if scale
        .enlargement()
        .is_some_and(|times| times.get() > MOST_ENLARGED)
    {
        return None;
    }
    let inks = print.hypotheses().ok()?;
    let print_from_mask = scale.print_from_masks();
    let mut parts: Vec<PrintOutline> = inks
        .iter()
        .flat_map(|ink| print_parts(&ink.mask))
        .map(|part| part.mapped(&print_from_mask))
        .collect();
    if parts.is_empty() {
        return None;
    }
    let is_carved = |side: &FittedSide| side.relief >= params.min_relief * side.extent;
    let sides =
        coarse_sides(indexed, start, params.curved_blocks).map(|side| side.filter(is_carved));
    // Highest agreement of each side, and the part that reaches it.
    let mut best = [(0.0, 0); 2];
    for (k, part) in parts.iter().enumerate() {
        let Some(ink) = InkPyramids::within(print, part) else {
            continue;
        };
        for (side, best) in sides.iter().zip(&mut best) {
            let agreement = side.as_ref().map_or(0.0, |side| ink.agreement(side));
            if agreement > best.0 {
                *best = (agreement, k);
            }
        }
    }
    let chosen = usize::from(best[1].0 > best[0].0);
    let [(agreement, part), (rival, _)] = [best[chosen], best[1 - chosen]];
    if agreement < LEAST {
        return None;
    }
    let plane = sides[chosen].as_ref()?.plane_from_mesh;
    let side = fit_view(indexed, &plane, params.curved_blocks, FINE)?;
    is_carved(&side).then(|| FoundSide {
        evidence: evidence(indexed, &side, agreement, rival),
        region: None,
        print_outline: Some(parts.swap_remove(part)),
        agreement,
        is_piece: false,
        side,
    })
}
