//! YOLO text: one region per line, in fractions of the page. What the columns mean is decided for the whole file.

use super::yolo_columns::{FileColumns, MAX_COLUMNS, MIN_COLUMNS, YoloRow};
use crate::labels::error::LabelsProblem;
use crate::labels::model::PageFile;
use crate::labels::page_fit::{MAX_BOXES, MAX_CORNERS, check_count};
use crate::labels::region::{Corners, LabelRegion, PageRegions, box_between, polygon};
use mocban_core::domain::cancel::polled;

/// Fractions beyond this are taken for pixels.
const MAX_FRACTION: f64 = 2.0;
/// Most numbers of a file. All are in memory until the meaning of the columns is decided.
const MAX_NUMBERS: usize = 64 * MAX_BOXES;

/// Returns whether a line has at least a class and four numbers.
pub(in crate::labels) fn is_region(line: &str) -> bool {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let words = || line.split_ascii_whitespace();
    words().all(is_number) && words().count() >= MIN_COLUMNS
}

/// Reads the regions of a page. A line has a class, which is ignored, and the centre, width and height of a box, or x
/// and y of the points of a polygon. A confidence and the id of a track may follow.
pub(in crate::labels) fn read(
    text: &str,
    page: &PageFile<'_>,
) -> Result<PageRegions, LabelsProblem> {
    let mut columns = FileColumns::default();
    let (mut rows, mut numbers) = (Vec::new(), 0);
    for row in parsed_rows(text) {
        check_count(rows.len() + 1)?;
        let row = row?;
        numbers += row.numbers.len();
        if numbers > MAX_NUMBERS {
            let reason = format!(
                "the file has more than {MAX_NUMBERS} numbers up to here; simplify its outlines or draw boxes"
            );
            return Err(malformed(row.line, reason));
        }
        columns
            .add(&row)
            .map_err(|reason| malformed(row.line, reason))?;
        rows.push(row);
    }
    let columns = columns
        .decide()
        .map_err(|(line, reason)| malformed(line, reason))?;
    let regions = (1..).zip(&rows).map(|(number, row)| {
        let fractions = columns.coordinates(row);
        if fractions.len() > 2 * MAX_CORNERS {
            return Err(too_many_corners(row.line));
        }
        let corners = corners(fractions, page);
        Ok(LabelRegion {
            number,
            name: None,
            text: None,
            corners: corners.map_err(|reason| malformed(row.line, reason))?,
        })
    });
    Ok(PageRegions {
        regions: regions.collect::<Result<_, LabelsProblem>>()?,
        ..PageRegions::default()
    })
}

fn malformed(line: usize, reason: String) -> LabelsProblem {
    LabelsProblem::at(format!("line {line}"), reason)
}

fn too_many_corners(line: usize) -> LabelsProblem {
    let (place, limit) = (format!("line {line}"), MAX_CORNERS);
    LabelsProblem::TooManyCorners { place, limit }
}

/// Returns the rows of a file. Blank lines are left out.
fn parsed_rows(text: &str) -> impl Iterator<Item = Result<YoloRow, LabelsProblem>> {
    let lines = (1..).zip(text.lines());
    let filled = lines.filter(|(_, line)| !line.trim_ascii().is_empty());
    filled.map(|(line, content)| {
        let words = polled(content.split_ascii_whitespace()).take(MAX_COLUMNS + 1);
        let row = YoloRow::new(line, words).map_err(|reason| malformed(line, reason))?;
        if row.numbers.len() > MAX_COLUMNS {
            return Err(too_many_corners(line));
        }
        Ok(row)
    })
}

/// Returns the corners of a box or polygon from its coordinates, which are fractions of the page.
fn corners(fractions: &[f64], page: &PageFile<'_>) -> Result<Option<Corners>, String> {
    let is_pixels = |number: &&f64| number.abs() > MAX_FRACTION;
    if let Some(number) = fractions.iter().find(is_pixels) {
        return Err(format!(
            "{number} is not a fraction of the page from 0 to 1"
        ));
    }
    let size = [f64::from(page.width), f64::from(page.height)];
    if let [cx, cy, width, height] = *fractions {
        let edge = |sign: f64| {
            [
                (cx + sign * width / 2.0) * size[0],
                (cy + sign * height / 2.0) * size[1],
            ]
        };
        return Ok(Some(box_between(edge(-1.0), edge(1.0))));
    }
    let point = |pair: &[f64]| [pair[0] * size[0], pair[1] * size[1]];
    Ok(polygon(fractions.chunks_exact(2).map(point).collect()))
}
