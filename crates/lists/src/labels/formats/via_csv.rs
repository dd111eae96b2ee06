//! CSV of the VGG Image Annotator: one region per row, with its shape and attributes as JSON.

use std::collections::HashMap;

use csv::StringRecord;
use serde_json::{Map, Value};

use super::via_shape::region;
use crate::labels::error::LabelsProblem;
use crate::labels::message::line_at;
use crate::labels::model::PageFile;
use crate::labels::page_choice::{PageEntry, choose_page};
use crate::labels::page_fit::check_count;
use crate::labels::region::PageRegions;
use crate::quotes::check_quotes;
use mocban_core::domain::cancel::polled;

/// Column of shapes, by which the format is recognized.
const SHAPE: &str = "region_shape_attributes";

/// Numbers of the columns.
struct ViaColumns {
    file_name: usize,
    bytes: usize,
    shape: usize,
    attributes: usize,
    count: usize,
}

/// Returns whether the first line of a text is the header of such a file.
pub(in crate::labels) fn is_header(line: &str) -> bool {
    line.contains("filename") && line.contains(SHAPE)
}

/// Reads the regions of a page. Columns may also be separated by semicolons or tabs, as spreadsheets write them.
pub(in crate::labels) fn read(
    text: &str,
    page: &PageFile<'_>,
) -> Result<PageRegions, LabelsProblem> {
    let header = text.trim_start().lines().next().unwrap_or_default();
    let delimiter = [b';', b'\t']
        .into_iter()
        .find(|c| header.contains(char::from(*c)));
    let delimiter = delimiter.unwrap_or(b',');
    check_quotes(text.as_bytes(), delimiter)
        .map_err(|error| LabelsProblem::at(format!("line {}", error.line), error.to_string()))?;
    let mut reader = csv::ReaderBuilder::new()
        .flexible(true)
        .delimiter(delimiter)
        .from_reader(text.as_bytes());
    let columns = columns(reader.headers().map_err(|error| damaged(&error))?)?;
    let mut images: Vec<PageEntry> = Vec::new();
    let mut rows: Vec<(usize, StringRecord)> = Vec::new();
    let mut known = HashMap::new();
    for row in polled(reader.records()) {
        let row = row.map_err(|error| damaged(&error))?;
        if row.len() < columns.count {
            let (found, wanted) = (row.len(), columns.count);
            let reason = format!("{found} columns; the first line has {wanted}");
            return Err(LabelsProblem::at(line_of(text, &row), reason));
        }
        let cell = |column: usize| row.get(column).unwrap_or_default().trim();
        let (name, bytes) = (cell(columns.file_name), cell(columns.bytes));
        let image = *known
            .entry((name.to_owned(), bytes.to_owned()))
            .or_insert_with(|| {
                images.push(PageEntry {
                    file_name: Some(name.to_owned()),
                    bytes: bytes.parse().ok(),
                    has_boxes: false,
                });
                images.len() - 1
            });
        // An image without regions has one row with an empty shape.
        if !matches!(cell(columns.shape), "" | "{}") {
            images[image].has_boxes = true;
            rows.push((image, row));
        }
    }
    let chosen = choose_page(&images, page)?;
    let entry = images.swap_remove(chosen);
    let mut regions = Vec::new();
    for (_, row) in polled(&rows).filter(|(image, _)| *image == chosen) {
        check_count(regions.len() + 1)?;
        let cell = |column: usize| {
            let object = cell_object(row, column);
            object.map_err(|reason| LabelsProblem::at(line_of(text, row), reason))
        };
        let (shape, attributes) = (cell(columns.shape)?, cell(columns.attributes)?);
        regions.push(region(regions.len() + 1, &shape, &attributes)?);
    }
    Ok(PageRegions {
        file_name: entry.file_name,
        bytes: entry.bytes,
        regions,
        ..PageRegions::default()
    })
}

fn columns(header: &StringRecord) -> Result<ViaColumns, LabelsProblem> {
    let column = |name: &str| {
        // VIA 1.0 begins the line with a number sign.
        let mut names = header
            .iter()
            .map(|cell| cell.trim().trim_start_matches('#'));
        let missing = || LabelsProblem::at("line 1", format!("the column {name} is missing"));
        names.position(|cell| cell == name).ok_or_else(missing)
    };
    Ok(ViaColumns {
        file_name: column("filename")?,
        bytes: column("file_size")?,
        shape: column(SHAPE)?,
        attributes: column("region_attributes")?,
        count: header.len(),
    })
}

/// Reads the JSON of a cell. An empty cell holds no attributes.
fn cell_object(row: &StringRecord, column: usize) -> Result<Map<String, Value>, String> {
    let text = row.get(column).unwrap_or_default().trim();
    if text.is_empty() {
        return Ok(Map::new());
    }
    serde_json::from_str(text).map_err(|error| {
        let reason = if error.is_eof() {
            "ends early".to_owned()
        } else {
            format!("is damaged: {error}")
        };
        format!("the JSON in column {} {reason}", column + 1)
    })
}

/// Returns the line of a row for a message. The position of a row may be between the two characters of a line break.
fn line_of(text: &str, row: &StringRecord) -> String {
    let start = row.position().map_or(0, csv::Position::byte) as usize;
    let rest = text.as_bytes().get(start..).unwrap_or_default();
    let breaks = rest.iter().take_while(|byte| b"\r\n".contains(byte));
    format!("line {}", line_at(text, start + breaks.count()))
}

fn damaged(error: &csv::Error) -> LabelsProblem {
    LabelsProblem::Damaged {
        format: "CSV",
        reason: error.to_string(),
    }
}
