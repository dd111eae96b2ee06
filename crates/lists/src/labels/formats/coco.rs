//! COCO: images, annotations with boxes or polygons, and categories.

use std::collections::HashMap;

use serde_json::{Map, Value};

use crate::labels::error::LabelsProblem;
use crate::labels::model::PageFile;
use crate::labels::page_choice::{PageEntry, choose_page};
use crate::labels::page_fit::check_count;
use crate::labels::region::{
    Corners, LabelRegion, PageRegions, class_text, coordinate, filled, name_attribute, object,
    polygon, shown, sized_box, text_attribute,
};

/// Returns whether an object has the lists of COCO.
pub(in crate::labels) fn is_coco(file: &Map<String, Value>) -> bool {
    let is_list = |key: &str| file.get(key).is_some_and(Value::is_array);
    is_list("annotations") && is_list("images")
}

/// Reads the regions of a page. A single polygon is kept; of several, and of run lengths, the box is used. The character
/// is an attribute of the annotation, or the name of its category.
pub(in crate::labels) fn read(
    file: &Map<String, Value>,
    page: &PageFile<'_>,
) -> Result<PageRegions, LabelsProblem> {
    let list = |key: &str| {
        file.get(key)
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
    };
    let mut by_image: HashMap<&str, Vec<&Value>> = HashMap::new();
    let mut numbered: HashMap<i64, Vec<&Value>> = HashMap::new();
    for annotation in list("annotations") {
        match annotation.get("image_id") {
            Some(Value::String(id)) => by_image.entry(id).or_default().push(annotation),
            Some(Value::Number(id)) => {
                let key = id.as_i64().unwrap_or(i64::MAX);
                numbered.entry(key).or_default().push(annotation);
            }
            _ => {}
        }
    }
    let of_image = |image: &Value| -> &[&Value] {
        let found = match image.get("id") {
            Some(Value::String(id)) => by_image.get(id.as_str()),
            Some(Value::Number(id)) => numbered.get(&id.as_i64().unwrap_or(i64::MAX)),
            _ => None,
        };
        found.map_or(&[], Vec::as_slice)
    };
    let images: Vec<&Value> = list("images").collect();
    let entry = |image: &&Value| PageEntry {
        file_name: image
            .get("file_name")
            .and_then(Value::as_str)
            .map(str::to_owned),
        bytes: None,
        has_boxes: !of_image(image).is_empty(),
    };
    let entries: Vec<PageEntry> = images.iter().map(entry).collect();
    let chosen = choose_page(&entries, page)?;
    let image = images[chosen];
    let categories = categories(list("categories"));
    check_count(of_image(image).len())?;
    let annotations = of_image(image).iter().enumerate();
    let regions = annotations.map(|(k, annotation)| read_region(k + 1, annotation, &categories));
    Ok(PageRegions {
        file_name: entries[chosen].file_name.clone(),
        bytes: None,
        size: size(image),
        regions: regions.collect::<Result<_, _>>()?,
    })
}

/// Returns width and height of an image, unless one is missing or zero.
fn size(image: &Value) -> Option<[f64; 2]> {
    let side = |key: &str| {
        image
            .get(key)
            .and_then(Value::as_f64)
            .filter(|side| *side >= 1.0)
    };
    Some([side("width")?, side("height")?])
}

/// Returns the characters of the categories by their ids.
fn categories<'a>(list: impl Iterator<Item = &'a Value>) -> HashMap<i64, String> {
    list.filter_map(|category| {
        let id = category.get("id")?.as_i64()?;
        Some((id, class_text(category.get("name")?.as_str()?)?))
    })
    .collect()
}

fn read_region(
    number: usize,
    value: &Value,
    categories: &HashMap<i64, String>,
) -> Result<LabelRegion, LabelsProblem> {
    let place = || format!("box {number}");
    let annotation = object(value, place)?;
    let attributes = annotation.get("attributes").and_then(Value::as_object);
    let own = |key: &str| annotation.get(key).and_then(Value::as_str).and_then(filled);
    let category = || annotation.get("category_id")?.as_i64();
    // The id of the annotation itself only counts annotations.
    let name = attributes
        .and_then(name_attribute)
        .or_else(|| own("name"))
        .or_else(|| own("pair"));
    let text = attributes
        .and_then(text_attribute)
        .or_else(|| text_attribute(annotation))
        .or_else(|| category().and_then(|id| categories.get(&id).cloned()));
    Ok(LabelRegion {
        number,
        name,
        text,
        corners: corners(annotation).map_err(|reason| LabelsProblem::at(place(), reason))?,
    })
}

fn corners(annotation: &Map<String, Value>) -> Result<Option<Corners>, String> {
    if let Some([Value::Array(points)]) = annotation
        .get("segmentation")
        .and_then(Value::as_array)
        .map(Vec::as_slice)
        && let Some(polygon) = polygon(numbers(points, "a number of segmentation")?)
    {
        return Ok(Some(polygon));
    }
    match annotation.get("bbox") {
        Some(Value::Array(sides)) if sides.len() == 4 => {
            let mut values = [0.0; 4];
            for (to, side) in values.iter_mut().zip(sides) {
                *to = coordinate(Some(side), "a number of bbox")?;
            }
            Ok(Some(sized_box(values)))
        }
        Some(other) => Err(format!(
            "bbox is {}, not [x, y, width, height]",
            shown(other)
        )),
        None => Err("bbox is missing, and segmentation is not one polygon".to_owned()),
    }
}

/// Reads x and y of points one after another.
fn numbers(points: &[Value], what: &str) -> Result<Corners, String> {
    if !points.len().is_multiple_of(2) {
        return Err(format!(
            "segmentation has {} numbers, an odd count",
            points.len()
        ));
    }
    let point = |pair: &[Value]| {
        Ok([
            coordinate(pair.first(), what)?,
            coordinate(pair.get(1), what)?,
        ])
    };
    points.chunks_exact(2).map(point).collect()
}
