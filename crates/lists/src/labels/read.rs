//! Recognition of the format of labels, and their reading.

use std::borrow::Cow;

use serde_json::{Map, Value};

use super::error::{LabelsError, LabelsProblem};
use super::formats::{bboxes, coco, labelme, page_xml, via_csv, via_json, yolo};
use super::json_size;
use super::message::{list, quoted};
use super::model::{LabelFormat, Labels, PageFile};
use super::page_fit::fit_to_page;
use super::region::{PageRegions, shown};
use crate::json_numbers::unknown_number;
use mocban_core::domain::{FileKind, SeparatorLines, UniqueKeys, are_zeros, sanitize};

/// Largest file that is read, in bytes.
pub const MAX_BYTES: usize = 64 << 20;
/// Bytes at the beginning of a file that show a pointer of Git LFS.
const HEAD_BYTES: usize = 256;

/// Reads the labels of a page from the content of a file. The format is recognized by the content; `file_name` is only
/// used in messages.
///
/// Of a file about several pages, the page is chosen by its file name (folders, case and Unicode form are ignored), else
/// by its size in bytes, else because only one page has boxes. Boxes are scaled if the file names a size of the same
/// shape within 1 %. Boxes outside the page, boxes smaller than a pixel, points and repeated boxes are left out with a
/// warning. See the documentation of this module for the frame of the outlines.
///
/// # Errors
/// Returns an error if the content is of no known format, damaged or too large, or if the labels do not belong to this
/// page, have no boxes, or have a name twice. Its message begins with `file_name`.
pub fn read(bytes: &[u8], file_name: &str, page: &PageFile<'_>) -> Result<Labels, LabelsError> {
    let result = parse(bytes, page).and_then(|(format, regions)| {
        let (boxes, warnings) = fit_to_page(regions, page)?;
        let file = sanitize(file_name, 4096);
        Ok(Labels {
            format,
            boxes,
            warnings: warnings
                .into_iter()
                .map(|text| format!("{file}: {text}"))
                .collect(),
        })
    });
    result.map_err(|problem| problem.in_file(file_name))
}

/// Recognizes and parses the content.
fn parse(bytes: &[u8], page: &PageFile<'_>) -> Result<(LabelFormat, PageRegions), LabelsProblem> {
    if bytes.is_empty() {
        return Err(LabelsProblem::Empty);
    }
    if bytes.len() > MAX_BYTES {
        return Err(LabelsProblem::TooLarge {
            bytes: bytes.len() as u64,
            limit: MAX_BYTES as u64,
        });
    }
    if are_zeros(bytes) {
        return Err(LabelsProblem::OnlyZeros);
    }
    let text = std::str::from_utf8(bytes).map_err(|_error| {
        let kind = FileKind::of(bytes);
        LabelsProblem::NotText(match kind {
            FileKind::Text => "text in another encoding".to_owned(),
            kind => kind.to_string(),
        })
    })?;
    if FileKind::of(&bytes[..bytes.len().min(HEAD_BYTES)]) == FileKind::LfsPointer {
        return Err(LabelsProblem::Pointer);
    }
    let text = text.trim_start_matches('\u{feff}').trim();
    match text.chars().next() {
        None => Err(LabelsProblem::NoBoxes(None)),
        Some('{' | '[') => parse_json(text, page),
        Some('<') => Ok((LabelFormat::PageXml, page_xml::read(text)?)),
        Some(_) => parse_lines(&with_line_feeds(text), page),
    }
}

/// Recognizes and parses text in lines.
fn parse_lines(
    text: &str,
    page: &PageFile<'_>,
) -> Result<(LabelFormat, PageRegions), LabelsProblem> {
    let first_line = text.lines().next().unwrap_or_default();
    let below = &*without_separator_lines(text);
    let header = below.trim_start().lines().next().unwrap_or_default();
    if via_csv::is_header(header) {
        Ok((LabelFormat::ViaCsv, via_csv::read(below, page)?))
    } else if yolo::is_region(first_line) {
        Ok((LabelFormat::Yolo, yolo::read(text, page)?))
    } else {
        Err(LabelsProblem::UnknownText(first_line.to_owned()))
    }
}

/// Returns a text without the content of first lines that name the separator for Excel, such as `sep=;`. No line moves.
fn without_separator_lines(text: &str) -> Cow<'_, str> {
    match SeparatorLines::find(text.as_bytes()) {
        None => Cow::Borrowed(text),
        Some(SeparatorLines { breaks, end, .. }) if breaks.is_empty() => {
            Cow::Borrowed(&text[end..])
        }
        Some(SeparatorLines { breaks, end, .. }) => {
            Cow::Owned(String::from_utf8_lossy(&breaks).into_owned() + &text[end..])
        }
    }
}

/// Returns a text in which each line ends with a line feed. Old programs for the Macintosh end lines with a carriage return
/// alone.
fn with_line_feeds(text: &str) -> Cow<'_, str> {
    let is_alone = |(at, _): (usize, &str)| text.as_bytes().get(at + 1) != Some(&b'\n');
    if !text.match_indices('\r').any(is_alone) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n"))
}

fn parse_json(
    text: &str,
    page: &PageFile<'_>,
) -> Result<(LabelFormat, PageRegions), LabelsProblem> {
    json_size::check(text)?;
    let UniqueKeys(value) =
        serde_json::from_str(text).map_err(|error| broken_json(text, &error))?;
    match &value {
        Value::Array(all) if all.is_empty() => Err(LabelsProblem::NoBoxes(None)),
        Value::Array(all) if bboxes::is_list(all) => Ok((LabelFormat::Bboxes, bboxes::read(all)?)),
        Value::Object(file) => parse_object(file, page),
        other => Err(LabelsProblem::UnknownJson(shown(other))),
    }
}

fn parse_object(
    file: &Map<String, Value>,
    page: &PageFile<'_>,
) -> Result<(LabelFormat, PageRegions), LabelsProblem> {
    let list_of = |key: &str| file.get(key).and_then(Value::as_array);
    if let Some(Value::Object(images)) = file.get(via_json::PROJECT_IMAGES) {
        return via_json::read(images, page);
    }
    if let Some(boxes) = list_of("bboxes") {
        return Ok((LabelFormat::Bboxes, bboxes::read(boxes)?));
    }
    if coco::is_coco(file) {
        return Ok((LabelFormat::Coco, coco::read(file, page)?));
    }
    if let Some(shapes) = list_of("shapes") {
        return Ok((LabelFormat::Labelme, labelme::read(file, shapes)?));
    }
    if via_json::is_annotations(file) {
        return via_json::read(file, page);
    }
    if file.is_empty() {
        return Err(LabelsProblem::NoBoxes(None));
    }
    if ["project", "file", "metadata", "view"]
        .iter()
        .all(|key| file.contains_key(*key))
    {
        return Err(LabelsProblem::Via3);
    }
    let keys: Vec<String> = file.keys().map(|key| quoted(key)).collect();
    Err(LabelsProblem::UnknownJson(format!(
        "the keys {}",
        list(&keys)
    )))
}

fn broken_json(text: &str, error: &serde_json::Error) -> LabelsProblem {
    if error.is_eof() {
        return LabelsProblem::Truncated {
            format: "JSON",
            line: error.line(),
        };
    }
    let line = text
        .lines()
        .nth(error.line().saturating_sub(1))
        .unwrap_or_default();
    // Python writes numbers that JSON does not know.
    let unknown = unknown_number(line, error.column());
    LabelsProblem::Damaged {
        format: "JSON",
        reason: match unknown {
            Some(number) => format!(
                "{number} is not a number at line {} column {}",
                error.line(),
                error.column()
            ),
            None => error.to_string(),
        },
    }
}
