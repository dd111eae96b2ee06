//! COCO: images, annotations with boxes or polygons, and categories.

use std::cell::OnceCell;
use std::collections::HashMap;

use serde_json::{Map, Value};

use crate::json_numbers::MAX_EXACT;
use crate::labels::error::LabelsProblem;
use crate::labels::message::boxes;
use crate::labels::model::PageFile;
use crate::labels::page_choice::{PageEntry, choose_page, comparable};
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
    let images: Vec<&Value> = list("images").collect();
    let (by_image, others) = by_image(&images, list("annotations"))?;
    let entry = |(k, image): (usize, &&Value)| PageEntry {
        file_name: file_name(image).map(str::to_owned),
        bytes: None,
        has_boxes: !by_image[k].is_empty(),
    };
    let entries: Vec<PageEntry> = images.iter().enumerate().map(entry).collect();
    let chosen = choose_page(&entries, page).map_err(|problem| match problem {
        LabelsProblem::NoBoxes(_) if others > 0 => LabelsProblem::OfNoImage(others),
        problem => problem,
    })?;
    if by_image[chosen].is_empty() && others > 0 {
        return Err(LabelsProblem::OfNoImage(others));
    }
    let warning = format!(
        "{} left out, whose image_id is that of no image",
        boxes(others)
    );
    let categories = categories(list("categories"));
    check_count(by_image[chosen].len())?;
    let annotations = by_image[chosen].iter().enumerate();
    let regions = annotations.map(|(k, annotation)| read_region(k + 1, annotation, &categories));
    Ok(PageRegions {
        file_name: entries[chosen].file_name.clone(),
        bytes: None,
        size: size(images[chosen]),
        regions: regions.collect::<Result<_, _>>()?,
        warnings: (others > 0).then_some(warning).into_iter().collect(),
    })
}

fn file_name(image: &Value) -> Option<&str> {
    image.get("file_name").and_then(Value::as_str)
}

/// Returns an id for comparison: some programs write numbers as text.
fn id_key(id: Option<&Value>) -> Option<String> {
    match id? {
        Value::String(text) => filled(text),
        Value::Number(number) => Some(match number.as_f64() {
            Some(whole) if number.is_f64() => whole.to_string(),
            _ => number.to_string(),
        }),
        _ => None,
    }
}

/// Returns the annotations of each image, and the number of those of no image. Instead of the id of an image, an annotation
/// may have its file name.
fn by_image<'a>(
    images: &[&Value],
    annotations: impl Iterator<Item = &'a Value>,
) -> Result<(Vec<Vec<&'a Value>>, usize), LabelsProblem> {
    let mut known: HashMap<String, usize> = HashMap::new();
    for (k, image) in images.iter().enumerate() {
        let Some(id) = id_key(image.get("id")) else {
            continue;
        };
        if let Some(first) = known.insert(id, k) {
            let reason = format!("it has the id of image {}", first + 1);
            return Err(LabelsProblem::at(format!("image {}", k + 1), reason));
        }
    }
    for (k, image) in images.iter().enumerate() {
        if let Some(name) = file_name(image) {
            known.entry(name.to_owned()).or_insert(k);
        }
    }
    let similar = OnceCell::new();
    let mut found = vec![Vec::new(); images.len()];
    let mut others = 0;
    for (k, annotation) in annotations.enumerate() {
        let id = id_key(annotation.get("image_id")).ok_or_else(|| {
            let id = annotation
                .get("image_id")
                .map_or_else(|| "missing".to_owned(), shown);
            LabelsProblem::at(format!("annotation {}", k + 1), format!("image_id is {id}"))
        })?;
        let image = known.get(&id).copied().or_else(|| {
            let similar = similar.get_or_init(|| similar_ids(images));
            similar.get(&similar_form(&id)).copied().flatten()
        });
        match image {
            Some(image) => found[image].push(annotation),
            None => others += 1,
        }
    }
    Ok((found, others))
}

/// Returns the images by the forms of their ids and file names in which case, folders, zeros before a number and decimals do
/// not matter, and by file names without extensions. A form of several images is that of none.
fn similar_ids(images: &[&Value]) -> HashMap<String, Option<usize>> {
    let mut found: HashMap<String, Option<usize>> = HashMap::new();
    for (k, image) in images.iter().enumerate() {
        let name = file_name(image);
        let stem = name.and_then(|name| Some(name.rsplit_once('.')?.0));
        // A number in place of an id may count images in another order than the numbers in file names.
        let stem = stem.map(comparable).filter(|stem| !is_number(stem));
        let forms = [
            id_key(image.get("id")).map(|id| similar_form(&id)),
            name.map(comparable),
            stem,
        ];
        for form in forms.into_iter().flatten() {
            let known = found.entry(form).or_insert(Some(k));
            *known = known.filter(|first| *first == k);
        }
    }
    found
}

/// Returns the form of an id that is compared if it is that of no image.
fn similar_form(id: &str) -> String {
    match id.parse::<f64>() {
        Ok(number) if number.fract() == 0.0 && number.abs() < MAX_EXACT => format!("{number:.0}"),
        Ok(_) => id.to_owned(),
        Err(_) => comparable(id),
    }
}

fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok()
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
fn categories<'a>(list: impl Iterator<Item = &'a Value>) -> HashMap<String, String> {
    list.filter_map(|category| {
        let id = id_key(category.get("id"))?;
        Some((id, class_text(category.get("name")?.as_str()?)?))
    })
    .collect()
}

fn read_region(
    number: usize,
    value: &Value,
    categories: &HashMap<String, String>,
) -> Result<LabelRegion, LabelsProblem> {
    let place = || format!("box {number}");
    let annotation = object(value, place)?;
    let attributes = annotation.get("attributes").and_then(Value::as_object);
    let own = |key: &str| annotation.get(key).and_then(Value::as_str).and_then(filled);
    let category = || id_key(annotation.get("category_id"));
    // The id of the annotation itself only counts annotations.
    let name = attributes.map_or(Ok(None), name_attribute);
    let name = name
        .map_err(|reason| LabelsProblem::at(place(), reason))?
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
