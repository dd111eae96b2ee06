//! Boxes of characters as a person would draw them, in the format of the VGG Image Annotator 2.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::block_truth::box_edges;
use super::text_cell::TextCell;

/// Largest error of an edge of a drawn box, as a fraction of the box's width or height.
const SLACK: f64 = 0.03;

/// A character on the page and the box of its ink.
pub(super) struct LabelledBox<'a> {
    pub cell: &'a TextCell,
    /// First and last column, first and last row.
    pub ink: [u32; 4],
}

/// Returns a VIA 2 project with roughly drawn boxes of a page file of `page_bytes` bytes. In VIA, (0, 0) is the corner
/// of the first pixel.
pub(super) fn via_project(
    page: &str,
    page_bytes: usize,
    boxes: &[LabelledBox],
    rng: &mut ChaCha8Rng,
) -> Vec<u8> {
    let regions: Vec<Value> = boxes.iter().map(|drawn| region(drawn, rng)).collect();
    let key = format!("{page}{page_bytes}");
    let image = json!({
        "filename": page,
        "size": page_bytes,
        "regions": regions,
        "file_attributes": {},
    });
    let text_attribute = |description: &str| json!({"type": "text", "description": description, "default_value": ""});
    let project = json!({
        "_via_settings": {"project": {"name": "block"}},
        "_via_img_metadata": {key.clone(): image},
        "_via_attributes": {
            "region": {
                "name": text_attribute("column and row"),
                "character": text_attribute("character"),
            },
            "file": {},
        },
        "_via_data_format_version": "2.0.10",
        "_via_image_id_list": [key],
    });
    project.to_string().into_bytes()
}

fn region(drawn: &LabelledBox, rng: &mut ChaCha8Rng) -> Value {
    let [x0, y0, x1, y1] = box_edges(drawn.ink).map(|edge| edge + 0.5);
    let (width, height) = (x1 - x0, y1 - y0);
    let mut move_edge =
        |edge: f64, size: f64| (edge + rng.random_range(-SLACK..SLACK) * size).round();
    let [left, right] = [x0, x1].map(|edge| move_edge(edge, width));
    let [top, bottom] = [y0, y1].map(|edge| move_edge(edge, height));
    json!({
        "shape_attributes": {
            "name": "rect",
            "x": left.max(0.0) as u64,
            "y": top.max(0.0) as u64,
            "width": (right - left.max(0.0)).max(1.0) as u64,
            "height": (bottom - top.max(0.0)).max(1.0) as u64,
        },
        "region_attributes": {"name": drawn.cell.name, "character": drawn.cell.character.to_string()},
    })
}
