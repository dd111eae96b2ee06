//! The built-in dataset: meshes of carved characters, images of their prints, and the ground truth.
//!
//! `tier` names the kinds of pairs, `kind` has their ranges, and `conditions` draws from them. `scene` draws the strokes
//! (`artwork`) and `damage` removes parts of them. `carving` and `weathering` compute the carved surface. `scanner`,
//! `block_body`, `debris` and `scan_pose` turn the surface into a mesh. `inking`, `print_sheet`, `paper_geometry`,
//! `rendered_print` and `print_format` make the print. `truth_line` records the true alignment. `generator` makes pairs
//! in memory, from a seed, and `dataset` writes them to disk. [`block`] does the same for a whole block and its page.
//!
//! **Invariant:** the same seed gives the same bytes, and the ground truth is known, not measured.

mod artwork;
pub mod block;
mod block_body;
mod calligraphy;
mod carved_block;
mod carving;
mod conditions;
mod damage;
mod dataset;
mod debris;
mod draw;
mod ellipse;
mod generator;
mod glyph;
mod inking;
mod kind;
mod mesh_of_points;
mod noise;
mod other_pieces;
mod pair;
mod paper_geometry;
mod polygon;
mod print_format;
mod print_sheet;
mod rendered_print;
mod scalar_field;
mod scan_pose;
mod scanner;
mod scene;
mod slid_part;
mod slow_errors;
mod solvable;
mod tear;
mod tier;
mod truth_line;
mod weathering;

pub use dataset::{DatasetError, DatasetFiles, DemoOptions, find_dataset, write_dataset};
pub use generator::PairGenerator;
pub use pair::DemoPair;
pub use scan_pose::TopsPlane;
pub use tier::Tier;
pub use truth_line::TruthLine;
