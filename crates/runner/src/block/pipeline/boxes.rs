//! The stage `boxes`: reads or finds the boxes of the characters, and places them on the face.

use super::context::StageContext;
use super::failure::output;
use super::stage_cache::{HeldInputs, HeldPage};
use crate::block_stages::{BlockFile, BlockStageError, BlockStageOutput};
use mocban_align::block::{
    AlignOutcome, BoxesOutcome, CarvedFace, CharacterBox, FaceOutcome, PageMap, StoredPageMap,
    check_label_fit, find_boxes, place_characters,
};
use mocban_align::scan_size::doubtful_characters;
use mocban_catalog::Catalog;
use mocban_core::domain::{BlockStage, FailureClass};
use mocban_lists::labels::{self, PageFile, reading_order};

/// Boxes on a page, and where they come from.
struct PageBoxes {
    /// Format of the labels; `None` if the boxes were found.
    labels: Option<String>,
    warnings: Vec<String>,
    boxes: Vec<CharacterBox>,
}

/// Places the characters on the face.
pub(crate) fn boxes(
    context: &StageContext<'_>,
    held: &HeldInputs,
) -> Result<BlockStageOutput, BlockStageError> {
    let page = held.page(context)?;
    let faces = held.faces(context)?;
    let aligned: AlignOutcome = context.outcome(BlockStage::Align)?;
    let rerun = || BlockStageError::RerunFrom(BlockStage::Align);
    let face = faces.iter().find(|(side, _)| *side == aligned.side);
    let (_, face) = face.ok_or_else(rerun)?;
    let map = PageMap::try_from(aligned.page_from_face)
        .ok()
        .ok_or_else(rerun)?;
    let mut read = match &context.inputs.labels {
        Some(file) => read_labels(context, file, &page)?,
        None => found_on_page(context, face, &page, &map)?,
    };
    let scan: FaceOutcome = context.outcome(BlockStage::Face)?;
    let side_mm = median_side(&read.boxes) / aligned.px_per_mm;
    read.warnings
        .extend(doubtful_characters(side_mm, scan.unit));
    let placed = place_characters(face, &page.ink, (&map, &aligned.support), &read.boxes);
    let sure = placed
        .characters
        .iter()
        .filter(|c| c.confidence >= Catalog::LOW_CHARACTER_CONFIDENCE)
        .count();
    output(&BoxesOutcome {
        labels: read.labels,
        warnings: read.warnings,
        count: placed.characters.len(),
        sure,
        page_from_face: StoredPageMap::from(&placed.map),
        characters: placed.characters,
    })
}

/// Returns the median of the longer sides of the boxes, in pixels of the page; NaN without boxes.
fn median_side(boxes: &[CharacterBox]) -> f64 {
    let longer = |[left, top, right, bottom]: [f64; 4]| (right - left).max(bottom - top);
    let mut sides: Vec<f64> = boxes.iter().map(|one| longer(one.page_box)).collect();
    sides.sort_unstable_by(f64::total_cmp);
    sides.get(sides.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Finds the boxes of the characters on face and page.
fn found_on_page(
    context: &StageContext<'_>,
    face: &CarvedFace,
    page: &HeldPage,
    map: &PageMap,
) -> Result<PageBoxes, BlockStageError> {
    let boxes: Vec<CharacterBox> = find_boxes(face, &page.ink, map)
        .into_iter()
        .map(|found| CharacterBox {
            name: found.name(),
            text: None,
            page_box: found.page_box,
        })
        .collect();
    if boxes.is_empty() {
        let text = "no columns of characters were found; draw boxes around the characters, for \
            example in the VGG Image Annotator, and give the file as labels";
        return Err(context.inputs.page.failed(FailureClass::NoSolution, text));
    }
    Ok(PageBoxes {
        labels: None,
        warnings: Vec::new(),
        boxes,
    })
}

/// Reads the labels of a page and gives boxes without a name the one of their place in the reading order.
fn read_labels(
    context: &StageContext<'_>,
    file: &BlockFile,
    page: &HeldPage,
) -> Result<PageBoxes, BlockStageError> {
    let bytes = file.read(labels::MAX_BYTES as u64, context.stop)?;
    let size = page.ink.size();
    let page_file = PageFile {
        name: context.inputs.page.name(),
        bytes: context.inputs.page.size(),
        width: size[0] as u32,
        height: size[1] as u32,
    };
    let read = labels::read(&bytes, file.name(), &page_file)
        .map_err(|error| BlockStageError::failed(FailureClass::BadInput, error.to_string()))?;
    let bounds: Vec<[f64; 4]> = read.boxes.iter().map(labels::LabelBox::bounds).collect();
    let order = reading_order(&bounds);
    let names = labels::box_names(&read.boxes, &order);
    let mut boxes: Vec<(usize, CharacterBox)> = (read.boxes.iter().zip(&bounds).zip(names))
        .enumerate()
        .map(|(place, ((label, bounds), name))| {
            let text = label.text.clone();
            (
                place,
                CharacterBox {
                    name,
                    text,
                    page_box: *bounds,
                },
            )
        })
        .collect();
    boxes.sort_by(|a, b| order[a.0].cmp(&order[b.0]));
    let boxes: Vec<CharacterBox> = boxes.into_iter().map(|(_, label)| label).collect();
    check_label_fit(&page.ink, &boxes)
        .map_err(|error| file.failed(FailureClass::NoSolution, error))?;
    Ok(PageBoxes {
        labels: Some(read.format.to_string()),
        warnings: read.warnings,
        boxes,
    })
}
