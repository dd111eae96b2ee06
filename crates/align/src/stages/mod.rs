//! The four stages as pure functions.
//!
//! They use no files, no SQL, no async and no clock. Each stage has its own settings, errors and entry function.

mod binarize;
#[cfg(test)]
mod cancel_tests;
pub mod depth;
mod face;
pub mod fit;
#[cfg(test)]
mod golden;
pub mod normalize;
mod paper_method;
pub mod pipeline;
mod pose;
mod print;
pub mod register;
mod scan;
pub mod score;
mod settings;
#[cfg(test)]
mod testing;
mod zbuffer;

pub use pipeline::{AlignedPair, ScanHints, StageError};
pub use print::Print;
pub use scan::Scan;
pub use settings::{AlignmentMethod, PipelineParams, Settings};
