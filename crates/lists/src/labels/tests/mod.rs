//! Labels of one page in all formats.

mod any_bytes;
mod coco_ids;
mod errors;
mod format_agreement;
mod levels;
mod limits;
mod page_fit;
mod round_trips;
mod samples;
mod yolo;
