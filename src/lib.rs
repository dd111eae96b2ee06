//! `mocban` aligns 3D scans of carved woodblock characters with images of their prints.
//!
//! [`docs/architecture.md`](https://github.com/mocban/mocban/blob/main/docs/architecture.md) is the entrance to the code: a
//! picture, six nouns, one line for each crate, and the way of a pair, a block, a verdict and an export.
//!
//! This package is the program. [`cli`] has one file per command, [`documentation`] the pages of `docs/`. Everything else is
//! in the libraries below `crates/`, which are re-exported here under the names of their topics.
//!
//! Benches: `benches/accuracy` compares the stages with ground truth on pairs of [`demo`], `benches/speed` times readers and
//! stages, `benches/queue` the catalog, and `benches/pages` finds boxes on pages of blocks. `benches/peers` and
//! `benches/peers-queue` run other tools under the same load.

pub mod cli;
pub mod documentation;
pub use mocban_align::{block, stages};
pub use mocban_catalog as catalog;
pub use mocban_config as config;
pub use mocban_core::{domain, mesh, page_vec, raster, simd};
pub use mocban_demo as demo;
pub use mocban_export as export;
pub use mocban_lists::{labels, manifest, workbook};
pub use mocban_pages::{local_server, review, view};
pub use mocban_project as project;
pub use mocban_report as report;
pub use mocban_results as results;
pub use mocban_runner::{self as runner, check};
pub use mocban_store as store;
