//! What people hand in: lists of pairs and blocks, and boxes of characters on a page.
//!
//! - [`manifest`]: rows of CSV, JSON Lines and folders become drafts of pairs and blocks
//! - [`columns`]: names of columns in any case, with blanks, and in Vietnamese
//! - [`json_numbers`]: `NaN` and `Infinity` in JSON, and its numbers as text
//! - [`quotes`]: refuses CSV text with a quotation mark that takes in further rows
//! - [`workbook`]: sheets of XLSX workbooks as CSV
//! - [`zip`]: files of ZIP archives; [`relative_path`]: paths in them and from browsers that are safe on every system
//! - [`labels`]: readers of formats of boxes, writers of VIA and COCO, names in reading order
//!
//! **Invariant:** a row or label is either understood or refused with its line and the reason. Nothing is guessed in
//! silence, and no file is opened here.

pub mod columns;
pub mod json_numbers;
pub mod labels;
pub mod manifest;
pub mod quotes;
pub mod relative_path;
pub mod workbook;
mod xml;
pub mod zip;
