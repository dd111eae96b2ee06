//! JSON of the VGG Image Annotator: annotations of versions 1 and 2, and projects of version 2.

use serde_json::{Map, Value};

use super::via_shape::region;
use crate::labels::error::LabelsProblem;
use crate::labels::message::quoted;
use crate::labels::model::{LabelFormat, PageFile};
use crate::labels::page_choice::{PageEntry, choose_page};
use crate::labels::page_fit::check_count;
use crate::labels::region::{LabelRegion, PageRegions, object, shown};

/// Key of the images in a project.
pub(in crate::labels) const PROJECT_IMAGES: &str = "_via_img_metadata";

/// Returns whether all values of an object look like images of VIA.
pub(in crate::labels) fn is_annotations(file: &Map<String, Value>) -> bool {
    let is_image = |value: &Value| {
        value
            .get("regions")
            .is_some_and(|r| r.is_array() || r.is_object())
    };
    !file.is_empty() && file.values().all(is_image)
}

/// Reads the regions of a page from the images of a file, by key: name of the image followed by its size in bytes.
pub(in crate::labels) fn read(
    images: &Map<String, Value>,
    page: &PageFile<'_>,
) -> Result<(LabelFormat, PageRegions), LabelsProblem> {
    let entries: Vec<PageEntry> = images
        .iter()
        .map(|(key, image)| entry(key, image))
        .collect();
    let chosen = choose_page(&entries, page)?;
    let Some((key, image)) = images.iter().nth(chosen) else {
        return Err(LabelsProblem::NoBoxes(None));
    };
    let (format, all) = regions_of(image).ok_or_else(|| {
        let found = image
            .get("regions")
            .map_or_else(|| "missing".to_owned(), shown);
        LabelsProblem::at(
            format!("image {}", quoted(key)),
            format!("regions are {found}"),
        )
    })?;
    check_count(all.len())?;
    let mut regions = Vec::with_capacity(all.len());
    for (k, value) in all.into_iter().enumerate() {
        regions.push(read_region(k + 1, value)?);
    }
    let entry = &entries[chosen];
    Ok((
        format,
        PageRegions {
            file_name: entry.file_name.clone(),
            bytes: entry.bytes,
            regions,
            ..PageRegions::default()
        },
    ))
}

fn entry(key: &str, image: &Value) -> PageEntry {
    // Images that VIA loads from an address have the size -1.
    let bytes = image.get("size").and_then(Value::as_u64);
    let file_name = image.get("filename").and_then(Value::as_str);
    let from_key = || bytes.and_then(|bytes| key.strip_suffix(&bytes.to_string()));
    PageEntry {
        file_name: file_name.or_else(from_key).map(str::to_owned),
        bytes,
        has_boxes: regions_of(image).is_some_and(|(_, regions)| !regions.is_empty()),
    }
}

/// Returns the regions of an image in order, or `None` if there is no list of them.
fn regions_of(image: &Value) -> Option<(LabelFormat, Vec<&Value>)> {
    match image.get("regions")? {
        Value::Array(regions) => Some((LabelFormat::Via2, regions.iter().collect())),
        Value::Object(regions) => {
            let number = |key: &str| key.parse::<u64>().unwrap_or(u64::MAX);
            let mut all: Vec<(&String, &Value)> = regions.iter().collect();
            all.sort_by_key(|(key, _)| (number(key), *key));
            let values = all.into_iter().map(|(_, value)| value);
            Some((LabelFormat::Via1, values.collect()))
        }
        _ => None,
    }
}

fn read_region(number: usize, value: &Value) -> Result<LabelRegion, LabelsProblem> {
    let place = || format!("box {number}");
    let none = Value::Object(Map::new());
    let part = |key: &str| value.get(key).unwrap_or(&Value::Null);
    let attributes = match part("region_attributes") {
        Value::Null => &none,
        attributes => attributes,
    };
    let shape = match part("shape_attributes") {
        Value::Null => return Err(LabelsProblem::at(place(), "shape_attributes are missing")),
        shape => object(shape, place)?,
    };
    region(number, shape, object(attributes, place)?)
}
