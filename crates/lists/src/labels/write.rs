//! Writers of labels: projects of VIA 2, also of boxes that were changed on the page of a block, and COCO.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Value, json};

use super::model::{LabelBox, PageFile};
use mocban_core::domain::rounded_edge;

/// Key of the path of the labels that changed boxes replace. VIA and the reader of this crate ignore it.
const REPLACES: &str = "mocban_replaces";

/// What [`replaced_labels`] reads of a file. All else is skipped, so that it takes no memory.
#[derive(Deserialize)]
struct EditedProject {
    mocban_replaces: StoredPath,
}

/// A path or null, which must be there.
#[derive(Deserialize)]
struct StoredPath(Option<String>);

/// Category of boxes without a character.
const NO_TEXT: &str = "character";

/// Returns a project of VIA 2 with the boxes of a page. VIA finds the image if it lies beside the project, because the
/// key of an image is its name followed by its size in bytes. Names are the attribute `id`, characters `character`.
pub fn write_via(boxes: &[LabelBox], page: &PageFile<'_>) -> Vec<u8> {
    text(&via_project(boxes, page))
}

/// What labels have replaced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplacedLabels {
    /// Path of the earlier labels, as stored; `None` if the boxes were found.
    pub path: Option<String>,
}

/// Returns the same project as [`write_via`], which also names the labels that it replaces.
pub fn write_edited(boxes: &[LabelBox], page: &PageFile<'_>, replaced: &ReplacedLabels) -> Vec<u8> {
    let mut project = via_project(boxes, page);
    project[REPLACES] = json!(replaced.path);
    text(&project)
}

/// Returns which labels a file has replaced; `None` if [`write_edited`] did not write it.
pub fn replaced_labels(bytes: &[u8]) -> Option<ReplacedLabels> {
    let EditedProject {
        mocban_replaces: StoredPath(path),
    } = serde_json::from_slice(bytes).ok()?;
    Some(ReplacedLabels { path })
}

fn via_project(boxes: &[LabelBox], page: &PageFile<'_>) -> Value {
    let name = file_name(page);
    let key = format!("{name}{}", page.bytes);
    let attribute = |description: &str| json!({"type": "text", "description": description, "default_value": ""});
    let image = json!({
        "filename": name,
        "size": page.bytes,
        "regions": boxes.iter().map(via_region).collect::<Vec<_>>(),
        "file_attributes": {},
    });
    json!({
        "_via_settings": {
            "ui": {
                "image": {"region_label": "character", "region_color": "__via_default_region_color__"},
            },
            "core": {"buffer_size": 18, "filepath": {}, "default_filepath": ""},
            "project": {"name": name},
        },
        "_via_img_metadata": {key.clone(): image},
        "_via_attributes": {
            "region": {
                "id": attribute("name of the box, unique on the page"),
                "character": attribute("the character"),
            },
            "file": {},
        },
        "_via_data_format_version": "2.0.10",
        "_via_image_id_list": [key],
    })
}

/// Returns a COCO file with the boxes of a page. A category is a character; names and characters are attributes too.
pub fn write_coco(boxes: &[LabelBox], page: &PageFile<'_>) -> Vec<u8> {
    let mut categories: BTreeMap<&str, usize> = BTreeMap::new();
    let mut list = Vec::new();
    let mut annotations = Vec::with_capacity(boxes.len());
    for (k, label) in boxes.iter().enumerate() {
        let category = label.text.as_deref().unwrap_or(NO_TEXT);
        let id = *categories.entry(category).or_insert_with(|| {
            let id = list.len() + 1;
            list.push(json!({"id": id, "name": category, "supercategory": "character"}));
            id
        });
        let corners = label
            .outline
            .iter()
            .flatten()
            .map(|edge| number(edge + 0.5));
        annotations.push(json!({
            "id": k + 1,
            "image_id": 1,
            "category_id": id,
            "iscrowd": 0,
            "area": number(area(&label.outline)),
            "bbox": sides(label).map(number),
            "segmentation": [corners.collect::<Vec<_>>()],
            "attributes": attributes(label),
        }));
    }
    let image = json!({
        "id": 1,
        "file_name": file_name(page),
        "width": page.width,
        "height": page.height,
    });
    text(&json!({
        "info": {"description": "characters of a page", "version": env!("CARGO_PKG_VERSION")},
        "licenses": [],
        "images": [image],
        "annotations": annotations,
        "categories": list,
    }))
}

/// Returns the file name of a page without folders.
fn file_name<'a>(page: &PageFile<'a>) -> &'a str {
    page.name.rsplit(['/', '\\']).next().unwrap_or_default()
}

fn text(value: &Value) -> Vec<u8> {
    let mut text = value.to_string().into_bytes();
    text.push(b'\n');
    text
}

fn via_region(label: &LabelBox) -> Value {
    let shape = if label.is_rectangle() {
        let [x, y, width, height] = sides(label).map(number);
        json!({"name": "rect", "x": x, "y": y, "width": width, "height": height})
    } else {
        let all = |axis: usize| -> Vec<Value> {
            let edges = label
                .outline
                .iter()
                .map(|corner| number(corner[axis] + 0.5));
            edges.collect()
        };
        json!({"name": "polygon", "all_points_x": all(0), "all_points_y": all(1)})
    };
    json!({"shape_attributes": shape, "region_attributes": attributes(label)})
}

/// Returns the attributes of a box, without empty ones.
fn attributes(label: &LabelBox) -> Value {
    let mut attributes = json!({});
    for (key, value) in [("id", &label.name), ("character", &label.text)] {
        if let Some(value) = value {
            attributes[key] = json!(value);
        }
    }
    attributes
}

/// Returns left, top, width and height in the frame of the files.
fn sides(label: &LabelBox) -> [f64; 4] {
    let [x0, y0, x1, y1] = label.bounds();
    [x0 + 0.5, y0 + 0.5, x1 - x0, y1 - y0]
}

/// Returns a number rounded to thousandths, without a decimal point if it is whole.
fn number(value: f64) -> Value {
    let rounded = rounded_edge(value);
    if rounded.fract() == 0.0 && rounded.abs() < 1e15 {
        json!(rounded as i64)
    } else {
        json!(rounded)
    }
}

/// Returns the area of a polygon in square pixels.
fn area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let cross = |(a, b): (&[f64; 2], &[f64; 2])| a[0] * b[1] - a[1] * b[0];
    (corners.iter().zip(next).map(cross).sum::<f64>() / 2.0).abs()
}
