//! The built-in dataset: glyphs carved into meshes and printed, with known truth, from one seed.
//!
//! A pair is a pure function of seed, tier and place: `artwork` draws the strokes, `damage` breaks some,
//! `relief` carves them, `scan` and `pose` make the mesh, `ink`, `paper` and `print` the print,
//! `truth` writes down the answer, `pairs` makes them in memory, `dataset` puts all of it on disk, `decoy` makes pairs
//! that have no answer.

mod artwork;
mod calligraphy;
mod damage;
mod dataset;
mod decoy;
mod field;
mod glyph;
mod ink;
mod noise;
mod pair;
mod pairs;
mod paper;
mod picture_file;
mod polygon;
mod pose;
mod print;
mod relief;
mod scan;
mod tier;
mod truth;

pub use dataset::{DatasetFiles, DemoOptions, Error, write_dataset};
pub use decoy::{Decoy, DecoyPair};
pub use pair::Pair;
pub use pairs::Pairs;
pub use pose::TopsPlane;
pub use tier::Tier;
pub use truth::TruthLine;
