//! Labels of a page: boxes of characters that a person or a program drew on the image of a page.
//!
//! The formats of [`LabelFormat`] are read, recognized by their content; VIA 2 and COCO are written. The functions
//! take and return bytes and touch no files.
//!
//! # Frame
//! In all formats, coordinates are edges: x from 0 to the width of the page, (0, 0) is the **outer corner** of the
//! top-left pixel, and a box around exactly this pixel is x = 0, y = 0, width = 1, height = 1. The outlines of
//! [`LabelBox`] have the pixel convention of this crate instead, in which (0, 0) is the **centre** of the top-left
//! pixel: reading subtracts 0.5 from both coordinates, and writing adds it. The box around the top-left pixel is
//! therefore [-0.5, -0.5, 0.5, 0.5] here.

mod box_names;
mod error;
mod formats;
mod json_size;
mod message;
mod model;
mod page_choice;
mod page_fit;
mod read;
mod reading_order;
mod region;
#[cfg(test)]
mod tests;
mod write;

pub use box_names::box_names;
pub use error::{LabelsError, LabelsProblem};
pub use model::{LabelBox, LabelFormat, Labels, PageFile};
pub use page_fit::MAX_BOXES;
pub use read::{MAX_BYTES, read};
pub use reading_order::reading_order;
pub use region::{NAME_ATTRIBUTES, TEXT_ATTRIBUTES};
pub use write::{ReplacedLabels, replaced_labels, write_coco, write_edited, write_via};
