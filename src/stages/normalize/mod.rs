//! Prepares print and relief for registration: ink of the print, heights of tops and ground of the depth map.
//!
//! Neither a pose nor a threshold is chosen here: the pose is found from soft strokes, which need no threshold, and
//! thresholds are chosen in the aligned frame. The paper's order is in `paper_method::normalize`.

mod height_histogram;
mod normalized;
mod params;
mod relief;

pub(super) use normalized::box_wrap;
pub use normalized::{Normalized, PrintMasks};
pub use params::{NormalizeError, NormalizeParams};
pub(super) use relief::{relative_depths, soft_stroke, stroke_growth};

use super::print::Print;
use crate::raster::DepthMap;

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 10;

/// Finds the print's ink under every interpretation that the image leaves possible, and the heights of tops and ground.
///
/// `depth` reads like the print; `print` is the whole image as given. Masks are in the print image's frame, heights in
/// mesh units over the fitted surface.
///
/// # Errors
/// Returns an error if the print shows no ink or the depth map only one height.
pub fn normalize(
    depth: &DepthMap,
    print: &Print,
    params: &NormalizeParams,
) -> Result<Normalized, NormalizeError> {
    let inks = print.hypotheses()?;
    let relief = relief::relief_heights(depth).ok_or(NormalizeError::NoStrokes)?;
    Normalized::new(inks, Some(relief), params)
}
