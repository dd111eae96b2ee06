//! Annotations of strokes and characters for training and labelling tools: COCO and VIA 2.

mod coco;
mod rle;
mod via;

pub(super) use coco::{CocoCategories, CocoText, StrokeAnnotation};
pub(super) use via::ViaRegions;
