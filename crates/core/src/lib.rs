//! Values that all crates share: domain types, meshes and images.
//!
//! - [`domain`]: ids, stages, states of jobs, transforms, outcomes, verdicts, the cancellation of a computation
//! - [`mesh`]: triangle meshes and point sets, with readers of OBJ, PLY, STL and XYZ
//! - [`raster`]: grids, masks, depth maps and print images, with decoders of PNG, JPEG and TIFF, and warps
//! - [`page_vec`]: vectors on huge pages, with a cache of freed pages
//! - [`simd`]: dispatch to the widest vector instructions of the processor
//! - [`zip_records`]: the records of ZIP archives
//! - [`locked()`]: a value behind a lock
//!
//! **Invariant:** no file is opened here, no clock is read and nothing is asynchronous. Readers and decoders take bytes,
//! so each function returns the same for the same arguments.

pub mod domain;
mod input_limits;
mod locked;
pub mod mesh;
pub mod page_vec;
pub mod raster;
pub mod simd;
pub mod zip_records;

pub use input_limits::InputLimits;
pub use locked::locked;
