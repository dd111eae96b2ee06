//! The built-in dataset: meshes of carved characters, images of their prints, and the ground truth.
//!
//! `scene` draws the strokes (`artwork`) and `damage` removes parts of them. `carving` computes the carved surface.
//! `scanner` and `scan_pose` turn the surface into a mesh. `inking`, `print_sheet`, `rendered_print` and `print_format`
//! make the print. `truth_line` records the true alignment. `generator` makes pairs in memory, from a seed, and
//! `dataset` writes them to disk.

mod artwork;
mod calligraphy;
mod carving;
mod damage;
mod dataset;
mod ellipse;
mod generator;
mod glyph;
mod inking;
mod noise;
mod pair;
mod polygon;
mod print_format;
mod print_sheet;
mod rendered_print;
mod scalar_field;
mod scan_pose;
mod scanner;
mod scene;
mod tier;
mod truth_line;

pub use dataset::{DatasetError, DatasetFiles, DemoOptions, find_dataset, write_dataset};
pub use generator::PairGenerator;
pub use pair::DemoPair;
pub use scan_pose::TopsPlane;
pub use tier::Tier;
pub use truth_line::TruthLine;
