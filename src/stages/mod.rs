//! The four stages as pure functions: values in, values out.
//!
//! No files, no SQL, no async, no clock. Each stage has its `Params`, its `Error` and one entry function.

mod binarize;
mod blur;
mod components;
pub mod depth;
pub mod fit;
#[cfg(test)]
mod golden;
pub mod normalize;
mod paper_method;
pub mod pipeline;
mod pose;
mod print;
pub mod register;
mod robust_bounds;
mod scan;
pub mod score;
mod settings;
#[cfg(test)]
mod testing;
mod zbuffer;

pub use pipeline::{AlignedPair, StageError};
pub use print::Print;
pub use scan::Scan;
pub use settings::{AlignmentMethod, PipelineParams, Settings};
