//! Readers of the formats: from parsed text to the regions of one page.

pub(super) mod bboxes;
pub(super) mod coco;
pub(super) mod labelme;
mod page_levels;
pub(super) mod page_xml;
pub(super) mod via_csv;
pub(super) mod via_json;
mod via_shape;
pub(super) mod yolo;
mod yolo_columns;
