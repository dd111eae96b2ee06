//! Mesh to character plane (paper III-A): a one-sided robust surface over what stands out, and the carved side.
//!
//! The mesh is rendered from both sides and a surface is fitted to the tops of each. The plane depends on the mesh only.
//! The side depends on the print as well: see `carved_side.rs` for why that is decided here. The paper's fit is in
//! `paper_method::fit`.

mod carved_side;
mod least_squares;
mod params;
mod pca;
mod surface;
mod upper_surface;

pub use params::{FitError, FitParams};
pub(super) use pca::{Axes, frame};
pub(super) use surface::quantile;

use super::print::Print;
use super::scan::Scan;
use crate::domain::FitOutcome;

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 10;

/// Fits the surface on which the tops of the strokes lie and finds the carved side.
///
/// `scan` is in its own frame and unit. `scanned_face_down` gives the direction of the carved face along the mesh's z
/// where it is known; it decides only when nothing else does. `print` helps to separate the carved side from the back
/// of an open sheet, whose winding is not reliable; the plane does not depend on it. The frame of the outcome keeps the
/// mesh's x direction as far as possible, so an upright scan stays upright; lengths are in mesh units.
///
/// # Errors
/// When the vertices span no surface, nothing is carved, or no plane is found.
///
/// # Examples
/// ```
/// # use mocban::{config, demo, raster};
/// # let settings = config::load(&config::Sources::default())?.config.stages;
/// # let pair = demo::PairGenerator::new(demo::Tier::Pose, 7).with_vertices(Some(20_000)).pair(0)?;
/// # let image = raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED)?;
/// use mocban::stages::{Print, Scan, fit};
///
/// let (scan, print) = (Scan::from(pair.mesh), Print::from(image));
/// let found = fit::fit(&scan, Some(&print), None, &settings.fit)?;
/// // A carving is a few percent as deep as the character is wide.
/// assert!(found.relief > 0.0 && (0.0..=1.0).contains(&found.inlier_ratio));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    params: &FitParams,
) -> Result<FitOutcome, FitError> {
    upper_surface::fit(scan, print, scanned_face_down, params)
}

#[cfg(test)]
mod tests;
