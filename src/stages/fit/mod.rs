//! Mesh to character plane (paper III-A): a one-sided robust surface over the highest parts, and the carved side.
//!
//! The mesh is rendered from both sides and a surface is fitted to the tops of each. The plane depends on the mesh
//! only. The side depends on the print as well: `src/lib.rs` explains why it is decided here. The paper's fit is in
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
pub use upper_surface::fit;

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 10;

#[cfg(test)]
mod tests;
