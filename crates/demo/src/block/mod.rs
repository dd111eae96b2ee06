//! Whole blocks and their pages: one carved block with a page of text, the scan of it, the image of its page, and the
//! exact truth.
//!
//! `kind` names the kinds and has their ranges. `layout`, `page_appearance`, `page_measures`, `page_rule`, `column`, `text_cell`
//! and `text_source` draw a page of text. `carved_page` carves it with `carved_text` and `carved_line`, as outlines that
//! `face_field` holds on a large grid. `relief` and `block_damage` compute the carved surface, and `solid`, `support` and
//! `pose` the scan, which `ply_file` writes row by row with `facets`. `leaf`, `true_map`, `page_sheet`, `page_marks`,
//! `impression` and `page_image` make the image of the page, and `page_file` encodes it. `block_truth` records the true
//! alignment, and `via_labels` draws boxes around the characters. `world` makes all of it from a seed, and `files` writes it
//! to disk. `pair_truth` gives the true alignment of the pairs that are cut from the block.

mod block_damage;
mod block_truth;
mod carved_line;
mod carved_page;
mod carved_text;
mod column;
mod face_field;
mod facets;
mod files;
mod impression;
mod kind;
mod layout;
mod leaf;
mod page_appearance;
mod page_file;
mod page_image;
mod page_marks;
mod page_measures;
mod page_rule;
mod page_sheet;
mod pair_truth;
mod ply_file;
mod pose;
mod relief;
mod seeding;
mod solid;
mod support;
mod text_cell;
mod text_source;
mod true_map;
mod via_labels;
mod world;

#[cfg(test)]
mod tests;

pub use block_truth::{BlockCharacterTruth, BlockLandmark, BlockTextPart, BlockTruth};
pub use files::{BlockFiles, block_options, find_block, write_block};
pub use kind::{BlockKind, BlockOptions};
pub use page_file::PageFileBytes;
pub use pose::FaceSide;
pub use world::BlockWorld;
