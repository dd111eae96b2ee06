//! Fitting of regions to their page: scale, boxes outside, repeated boxes, names.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::error::LabelsProblem;
use super::message::{boxes, for_count, list, quoted};
use super::model::{LabelBox, PageFile, bounds};
use super::page_choice::is_same_file;
use super::region::{Corners, LabelRegion, PageRegions};
use mocban_core::domain::{PairName, rounded_edge};

/// Maximum number of boxes of a page.
pub const MAX_BOXES: usize = 100_000;
/// Maximum number of corners of an outline.
pub(super) const MAX_CORNERS: usize = 100_000;
/// Largest area of all boxes together, as a multiple of the area of the page.
const MAX_OVERLAP: f64 = 32.0;
/// If the ratio of width to height differs by more than this between labels and page, the labels are refused, not scaled.
const MAX_STRETCH: f64 = 0.01;
/// Smallest side of a box in pixels of the page.
const MIN_SIDE: f64 = 1.0;
/// Boxes with a smaller share of their area on the page lie outside.
const MIN_INSIDE: f64 = 0.5;
/// Edges are rounded to multiples of this many pixels. Boxes whose rounded edges are equal are the same.
const SAME_EDGE: f64 = 0.01;

/// A region with an area. Its corners were moved out of it and are on the page.
struct PlacedRegion {
    region: LabelRegion,
    corners: Corners,
}

/// Returns the boxes of a page in the order of the file, in the pixel convention of [`LabelBox`], and warnings.
///
/// A box with less than half of its area on the page is left out. The others are cut at the edges of the page.
pub(super) fn fit_to_page(
    file: PageRegions,
    page: &PageFile<'_>,
) -> Result<(Vec<LabelBox>, Vec<String>), LabelsProblem> {
    if file.regions.is_empty() {
        return Err(LabelsProblem::NoBoxes(file.file_name));
    }
    check_count(file.regions.len())?;
    let mut warnings = page_warnings(&file, page);
    warnings.extend(file.warnings);
    let scale = scale(file.size, page, &mut warnings)?;
    let placed = with_area(file.regions, scale, &mut warnings)?;
    if placed.is_empty() {
        return Err(LabelsProblem::NoBoxes(file.file_name));
    }
    let inside = on_page(placed, page, &mut warnings)?;
    let unique = without_repeats(inside, &mut warnings);
    let names = names(&unique)?;
    check_overlap(&unique, page)?;
    let pixel_centres = |corners: Corners| {
        let corners = corners.into_iter();
        corners.map(|corner| corner.map(|edge| rounded_edge(edge - 0.5)))
    };
    let finished = unique
        .into_iter()
        .zip(names)
        .map(|(placed, name)| LabelBox {
            name: name.map(String::from),
            text: placed.region.text,
            outline: pixel_centres(placed.corners).collect(),
        });
    Ok((finished.collect(), warnings))
}

/// Checks a number of boxes of a page, while they are read.
pub(super) fn check_count(count: usize) -> Result<(), LabelsProblem> {
    if count <= MAX_BOXES {
        return Ok(());
    }
    let limit = MAX_BOXES;
    Err(LabelsProblem::TooManyBoxes { limit })
}

/// Refuses boxes that cover the page so often that cutting all of them out would take very long.
fn check_overlap(placed: &[PlacedRegion], page: &PageFile<'_>) -> Result<(), LabelsProblem> {
    let area = |placed: &PlacedRegion| {
        let [x0, y0, x1, y1] = bounds(&placed.corners);
        (x1 - x0) * (y1 - y0)
    };
    let page_area = f64::from(page.width) * f64::from(page.height);
    let times = placed.iter().map(area).sum::<f64>() / page_area;
    let limit = MAX_OVERLAP;
    if times > limit {
        return Err(LabelsProblem::Overlap { times, limit });
    }
    Ok(())
}

/// Warns about another file name and another size in bytes.
fn page_warnings(file: &PageRegions, page: &PageFile<'_>) -> Vec<String> {
    let mut warnings = Vec::new();
    // A page of the same size in bytes is a copy under another name, such as that of an export.
    if let Some(name) = file.file_name.as_deref()
        && !is_same_file(name, page.name)
        && file.bytes != Some(page.bytes)
    {
        let (labelled, name) = (quoted(name), quoted(page.name));
        warnings.push(format!("the labels are of {labelled}, the page is {name}"));
    }
    if let Some(bytes) = file.bytes.filter(|bytes| *bytes != page.bytes) {
        warnings.push(format!(
            "the labels were made for a file of {bytes} bytes, the page has {}",
            page.bytes
        ));
    }
    warnings
}

/// Returns the factors from the size that the file names to that of the page.
fn scale(
    size: Option<[f64; 2]>,
    page: &PageFile<'_>,
    warnings: &mut Vec<String>,
) -> Result<[f64; 2], LabelsProblem> {
    let page_size = [page.width, page.height];
    let Some(labels) = size else {
        return Ok([1.0; 2]);
    };
    let scale = [0, 1].map(|axis| f64::from(page_size[axis]) / labels[axis]);
    if scale == [1.0; 2] {
        return Ok(scale);
    }
    if (scale[0] / scale[1] - 1.0).abs() > MAX_STRETCH {
        return Err(LabelsProblem::OtherSize {
            labels,
            page: page_size,
        });
    }
    warnings.push(format!(
        "the labels are for an image of {} x {} px, the page is {} x {} px; the boxes were scaled",
        labels[0], labels[1], page.width, page.height
    ));
    Ok(scale)
}

/// Drops points, lines and boxes smaller than a pixel. Refuses boxes that all look like fractions of the page.
fn with_area(
    regions: Vec<LabelRegion>,
    scale: [f64; 2],
    warnings: &mut Vec<String>,
) -> Result<Vec<PlacedRegion>, LabelsProblem> {
    let (mut flat, mut fractions) = (Vec::new(), 0);
    let mut placed = Vec::with_capacity(regions.len());
    for mut region in regions {
        let mut corners = region.corners.take().unwrap_or_default();
        for [x, y] in &mut corners {
            *x *= scale[0];
            *y *= scale[1];
        }
        let [x0, y0, x1, y1] = bounds(&corners);
        if x1 - x0 >= MIN_SIDE && y1 - y0 >= MIN_SIDE {
            placed.push(PlacedRegion { region, corners });
        } else {
            flat.push(region.shown());
            let has_area = x1 > x0 && y1 > y0;
            let is_fraction = x0 >= 0.0 && y0 >= 0.0 && x1 <= scale[0] && y1 <= scale[1];
            fractions += usize::from(has_area && is_fraction);
        }
    }
    if placed.is_empty() && fractions == flat.len() {
        return Err(LabelsProblem::Fractions);
    }
    if !flat.is_empty() {
        let verb = for_count(flat.len(), "is", "are");
        let left_out = for_count(flat.len(), "was", "were");
        let (count, names) = (boxes(flat.len()), list(&flat));
        warnings.push(format!(
            "{count} {verb} smaller than a pixel, a point or a line and {left_out} left out: {names}"
        ));
    }
    Ok(placed)
}

/// Drops boxes outside the page and cuts the others at its edges.
fn on_page(
    placed: Vec<PlacedRegion>,
    page: &PageFile<'_>,
    warnings: &mut Vec<String>,
) -> Result<Vec<PlacedRegion>, LabelsProblem> {
    let count = placed.len();
    let size = [f64::from(page.width), f64::from(page.height)];
    let is_inside =
        |placed: &PlacedRegion| share_inside(bounds(&placed.corners), size) >= MIN_INSIDE;
    let are_corners = are_corners(&placed, size);
    let (mut inside, outside): (Vec<_>, Vec<_>) = placed.into_iter().partition(is_inside);
    if 2 * outside.len() > count {
        return Err(LabelsProblem::Outside {
            outside: outside.len(),
            count,
            page: [page.width, page.height],
            are_corners,
        });
    }
    if !outside.is_empty() {
        let names: Vec<String> = outside.iter().map(|placed| placed.region.shown()).collect();
        let verb = for_count(
            names.len(),
            "lies outside the page and was",
            "lie outside the page and were",
        );
        let (outside, names) = (names.len(), list(&names));
        warnings.push(format!(
            "{outside} of {} {verb} left out: {names}",
            boxes(count)
        ));
    }
    warnings.extend(over_edges(&inside, size));
    for corner in inside.iter_mut().flat_map(|placed| &mut placed.corners) {
        *corner = [corner[0].clamp(0.0, size[0]), corner[1].clamp(0.0, size[1])];
    }
    Ok(inside)
}

/// Returns whether all boxes lie on the page if the numbers that were read as width and height are the second corner:
/// beside the first corner, as in COCO, or beside the centre, as in YOLO.
fn are_corners(placed: &[PlacedRegion], [width, height]: [f64; 2]) -> bool {
    let all = |first: fn([f64; 4]) -> [f64; 2]| {
        placed.iter().all(|placed| {
            let edges = bounds(&placed.corners);
            let ([x0, y0], [x1, y1]) = (first(edges), [edges[2] - edges[0], edges[3] - edges[1]]);
            x0 >= 0.0 && y0 >= 0.0 && x0 < x1 && y0 < y1 && x1 <= width && y1 <= height
        })
    };
    all(|[x0, y0, _, _]| [x0, y0])
        || all(|[x0, y0, x1, y1]| [f64::midpoint(x0, x1), f64::midpoint(y0, y1)])
}

/// Warns about boxes that reach over an edge of the page by a pixel or more.
fn over_edges(inside: &[PlacedRegion], [width, height]: [f64; 2]) -> Option<String> {
    let is_over = |placed: &&PlacedRegion| {
        let [x0, y0, x1, y1] = bounds(&placed.corners);
        (-x0).max(-y0).max(x1 - width).max(y1 - height) >= MIN_SIDE
    };
    let over = inside.iter().filter(is_over);
    let names: Vec<String> = over.map(|placed| placed.region.shown()).collect();
    let verb = for_count(
        names.len(),
        "reaches over an edge of the page and was",
        "reach over an edge of the page and were",
    );
    (!names.is_empty())
        .then(|| format!("{} {verb} cut there: {}", boxes(names.len()), list(&names)))
}

/// Returns the share of the area of a box that lies on the page.
fn share_inside([x0, y0, x1, y1]: [f64; 4], [width, height]: [f64; 2]) -> f64 {
    let share = |from: f64, to: f64, end: f64| (to.min(end) - from.max(0.0)).max(0.0) / (to - from);
    share(x0, x1, width) * share(y0, y1, height)
}

/// Keeps the first of boxes with the same edges. It gets the name and the text of the others if it has none.
fn without_repeats(placed: Vec<PlacedRegion>, warnings: &mut Vec<String>) -> Vec<PlacedRegion> {
    let mut known: HashMap<[i64; 4], usize> = HashMap::with_capacity(placed.len());
    let mut unique: Vec<PlacedRegion> = Vec::with_capacity(placed.len());
    let mut repeats = Vec::new();
    for other in placed {
        let edges = bounds(&other.corners).map(|edge| (edge / SAME_EDGE).round() as i64);
        match known.entry(edges) {
            Entry::Occupied(first) => {
                let first = &mut unique[*first.get()].region;
                repeats.push(format!("{} as {}", other.region.shown(), first.shown()));
                first.name = first.name.take().or(other.region.name);
                first.text = first.text.take().or(other.region.text);
            }
            Entry::Vacant(free) => {
                free.insert(unique.len());
                unique.push(other);
            }
        }
    }
    if !repeats.is_empty() {
        let verb = for_count(
            repeats.len(),
            "repeats another and was",
            "repeat others and were",
        );
        let (count, names) = (boxes(repeats.len()), list(&repeats));
        warnings.push(format!("{count} {verb} left out: {names}"));
    }
    unique
}

/// Returns the names of the boxes. Refuses names that two boxes have, also if they differ in upper and lower case.
fn names(placed: &[PlacedRegion]) -> Result<Vec<Option<PairName>>, LabelsProblem> {
    let mut known: HashMap<String, usize> = HashMap::new();
    let name = |placed: &PlacedRegion| {
        let region = &placed.region;
        let Some(text) = region.name.as_deref() else {
            return Ok(None);
        };
        let place = || format!("the name of box {}", region.number);
        let name =
            PairName::new(text).map_err(|error| LabelsProblem::at(place(), error.to_string()))?;
        match known.insert(name.folded(), region.number) {
            None => Ok(Some(name)),
            Some(first) => Err(LabelsProblem::SameName {
                name: text.to_owned(),
                first,
                second: region.number,
            }),
        }
    };
    placed.iter().map(name).collect()
}
