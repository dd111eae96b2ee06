//! Mesh to character plane (paper III-A).
//!
//! Two methods behind one entry: the paper's ([`FitMethod::Paper`]) and ours ([`FitMethod::UpperSurface`]), which looks at the
//! surface from both sides and fits a one-sided robust surface to what stands out.

mod carved_side;
mod least_squares;
mod params;
mod pca;
mod surface;
mod upper_surface;

pub use params::{FitError, FitMethod, FitParams};
pub(super) use pca::{Axes, frame};
pub(super) use surface::quantile;

use super::paper_method;
use super::print::Print;
use super::scan::Scan;
use crate::domain::FitOutcome;

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 10;

/// Finds the plane on which the tops of the strokes lie, and the side of it that is carved.
///
/// `scan` is in its own frame and unit. `scanned_face_down` says which way the carved face looks along the mesh's z,
/// where that is known; it decides only when nothing else tells. `print` helps to tell the carved side from the back
/// of an open sheet, whose winding cannot be trusted; the plane itself does not depend on it. The outcome's plane frame keeps the
/// mesh's x direction as far as it can, so an upright scan stays upright.
///
/// # Errors
/// When the vertices span no surface, nothing is carved, or no plane is found.
pub fn fit(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    params: &FitParams,
) -> Result<FitOutcome, FitError> {
    let count = scan.mesh().vertices.len();
    if count < 3 {
        return Err(FitError::TooFewPoints(count));
    }
    match params.method {
        FitMethod::Paper => paper_method::fit::fit(scan.mesh(), params),
        FitMethod::UpperSurface => upper_surface::fit(scan, print, scanned_face_down, params),
    }
}

#[cfg(test)]
mod tests;
