//! `mocban` aligns 3D scans of carved woodblock characters with images of their prints.
//!
//! # Code map
//!
//! A **pair** is one character: a mesh of the carved block and an image of its print. Its **job** is the way
//! through four **stages**, `fit`, `depth`, `normalize` and `register`. A worker leases the pair, runs the stages
//! that are left and writes a **checkpoint** after each, while the next is computed: files first, then one short
//! transaction. The stages are pure functions; the catalog is the only place with SQL, the store the only one with
//! artifact files, and the runner ties the two to the stages.
//!
//! To follow one pair: [`manifest`] reads its line, [`catalog`] keeps it, [`runner`] leases it and calls
//! [`stages`] with what [`mesh`] and [`raster`] decoded, [`store`] and [`catalog`] take the results, and
//! [`report`] and [`export`] tell them. `benches/accuracy` gives pairs of [`demo`] straight to the stages and prints how
//! often they are right, how far off, and how long each takes.
//!
//! `benches/queue` measures what the catalog costs on many pairs, beside other queues; `benches/speed` how long readers
//! and stages take by the size of a scan, and `benches/peers` runs other libraries on the same files.
//!
//! The table below is kept by `tests/it/layers.rs`: a room imports those of its line and no others.
//!
//! | room | what it is for | may import |
//! |---|---|---|
//! | `domain` | nouns: ids, stages, job states, transforms, outcomes, verdicts | |
//! | `simd` | loops over numbers, with the widest instructions that the processor has | |
//! | `raster` | grids, masks, depth maps, pictures, warps; readers of PNG, JPEG, TIFF | `domain`, `simd` |
//! | `page_vec` | vectors of millions of numbers | |
//! | `mesh` | triangles and points in their own frame; readers of OBJ, PLY, STL, XYZ | `domain`, `page_vec` |
//! | `manifest` | lists of pairs: CSV, JSON Lines, two folders | `domain` |
//! | `stages` | fit, depth, normalize, register as pure functions, and the scores | `domain`, `simd`, `page_vec`, `mesh`, `raster` |
//! | `failpoint` | named points where a test makes the process die | `domain` |
//! | `store` | a project on disk: inputs and artifacts by content hash | `domain`, `page_vec`, `mesh`, `raster` |
//! | `catalog` | SQLite: pairs, jobs, leases, results, verdicts; all the SQL there is | `domain`, `failpoint` |
//! | `runner` | workers, policy, execution of one pair, events | `domain`, `page_vec`, `mesh`, `raster`, `stages`, `store`, `catalog`, `failpoint` |
//! | `check` | a project held against itself, and mended | `domain`, `store`, `catalog`, `runner` |
//! | `report` | catalog to table: plain data, then text, CSV, JSON, Markdown, LaTeX, HTML | `domain`, `raster`, `store`, `catalog` |
//! | `export` | aligned pairs for other tools, overlays, contact sheets, pictures of a report | `domain`, `raster`, `store`, `catalog`, `report` |
//! | `review` | the review page: verdicts and alignments by hand, planted faults, a server on loopback | `domain`, `raster`, `store`, `catalog`, `report`, `export` |
//! | `demo` | the built-in dataset: carved reliefs and prints with known truth, from one seed | `domain`, `mesh`, `raster` |
//! | `config` | settings in layers, typed and checked, each with its origin | `domain`, `mesh`, `raster`, `stages`, `runner` |
//! | `cli` | one thin file a command; exit codes, progress, log | all |

pub mod catalog;
pub mod check;
pub mod cli;
pub mod config;
pub mod demo;
pub mod domain;
pub mod export;
mod failpoint;
pub mod manifest;
pub mod mesh;
pub mod page_vec;
pub mod raster;
pub mod report;
pub mod review;
pub mod runner;
mod simd;
pub mod stages;
pub mod store;
