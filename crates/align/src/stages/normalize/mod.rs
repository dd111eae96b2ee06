//! Prepares registration: finds the ink of the print, and the heights of tops and ground in the depth map.
//!
//! This stage chooses neither a pose nor a threshold. Registration finds the pose from soft strokes, which need no
//! threshold, and then chooses thresholds in the aligned frame. The paper's order is in `paper_method::normalize`.

mod height_histogram;
mod normalized;
mod params;
mod relief;
mod sampling;
mod steepness;

pub(super) use normalized::box_wrap;
pub use normalized::{Normalized, PrintMasks};
pub use params::{NormalizeError, NormalizeParams};
pub(super) use relief::{relative_depths, relief_heights, soft_stroke};

use super::print::Print;
use mocban_core::raster::{DepthMap, Mask, mask_of_print};

/// Raised by every change of the code that may change results.
pub const REVISION: u32 = 23;

/// Finds the ink in all possible interpretations of the print, and the heights of tops and ground.
///
/// The depth map must not be a mirror image of the print. Masks are in the frame of the print image, see [`PrintMasks`].
/// Heights are in mesh units over the fitted surface.
///
/// # Errors
/// Returns an error if the print shows no ink, or if the depth map has fewer than two distinct heights.
pub fn normalize(
    depth: &DepthMap,
    print: &Print,
    params: &NormalizeParams,
) -> Result<Normalized, NormalizeError> {
    let inks = print.hypotheses()?;
    let relief = relief::relief_heights(depth).ok_or(NormalizeError::NoStrokes)?;
    Normalized::new(inks, print.mask_scale(), Some(relief), params)
}

/// Returns the pixels of a print that are ink in the likeliest interpretation, for use without a scan. Registration may
/// choose another interpretation.
///
/// # Errors
/// Returns an error if the print shows no ink.
pub fn likeliest_ink(print: &Print) -> Result<Mask, NormalizeError> {
    // There is at least one interpretation.
    Ok(mask_of_print(
        &print.hypotheses()?[0].mask,
        print.mask_scale(),
    ))
}
