//! The fit stage (paper III-A): finds the plane of the stroke tops and the carved side of a mesh.
//!
//! Both sides of the mesh are rendered, and a surface is fitted to the stroke tops of each rendering. Side walls, a
//! foot or a table below the carved face are left out; if there are any, the outcome has a region. The plane of a
//! side depends on the mesh only. The choice of the side also depends on the print. `src/lib.rs` explains why the
//! side is chosen in this stage. If the chosen side does not resemble the print, or if the scan shows several pieces,
//! the side is registered (`trials`). Unless it is sure, all sides and parts of the scan are sought (`wider_search`), and
//! parts of the print (`part_search`). The likeliest of them are registered until one is sure. The outcome of `wider_search` always has a region, which is the
//! part of the scan that the depth map shows. The outcome of `part_search` has an outline, which is the part of the
//! print that shows the character. If a pair was cut from a block and its strokes do not determine a plane, the block's
//! normal decides (`block_face`). The paper's own fit is in `paper_method::fit`.

mod block_face;
mod carved_side;
mod directions;
mod height_samples;
mod least_squares;
mod near_plane;
mod params;
mod part_search;
mod pca;
mod print_agreement;
mod print_parts;
mod scan_parts;
mod side_surface;
mod surface;
mod tightest_frame;
mod trials;
mod upper_surface;
mod wider_search;

pub use block_face::fit_in_block;
pub(super) use height_samples::quantile;
pub use params::{ExpectedFace, FitError, FitParams};
pub(super) use pca::{Axes, frame};
pub use upper_surface::fit;

/// Raised by every change of the code that may change results. A candidate may be registered (`trials`), so the
/// fingerprint of this stage holds the revisions of the later stages too.
pub const REVISION: u32 = 29;

#[cfg(test)]
mod tests;
