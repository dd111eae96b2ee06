//! The fit stage (paper III-A): finds the plane of the stroke tops and the carved side of a mesh.
//!
//! Both sides of the mesh are rendered, and a surface is fitted to the stroke tops of each rendering. The plane depends
//! on the mesh only. The choice of the side also depends on the print. `src/lib.rs` explains why the side is chosen in
//! this stage. The paper's own fit is in `paper_method::fit`.

mod carved_side;
mod least_squares;
mod params;
mod pca;
mod surface;
mod upper_surface;

pub use params::{FitError, FitParams};
pub(super) use pca::{Axes, frame};
pub(super) use surface::quantile;
pub use upper_surface::fit;

/// Raised by every change of the code that may change results.
pub const REVISION: u32 = 11;

#[cfg(test)]
mod tests;
