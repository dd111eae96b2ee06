//! YOLO text: one region per line, in fractions of the page.

use crate::labels::error::LabelsProblem;
use crate::labels::message::quoted;
use crate::labels::model::PageFile;
use crate::labels::page_fit::{MAX_CORNERS, check_count};
use crate::labels::region::{Corners, LabelRegion, PageRegions, box_between, polygon};
use mocban_core::domain::cancel::polled;

/// Fractions beyond this are taken for pixels.
const MAX_FRACTION: f64 = 2.0;

/// Words of a line with the longest outline: a class, the corners and a confidence.
const MAX_WORDS: usize = 2 * MAX_CORNERS + 2;

/// Returns whether a line has at least a class and four numbers.
pub(in crate::labels) fn is_region(line: &str) -> bool {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    line.split_ascii_whitespace().all(is_number) && line.split_ascii_whitespace().count() >= 5
}

/// Reads the regions of a page. A line has a class, which is ignored, and the centre, width and height of a box, or x
/// and y of the points of a polygon. A confidence may follow.
pub(in crate::labels) fn read(
    text: &str,
    page: &PageFile<'_>,
) -> Result<PageRegions, LabelsProblem> {
    let mut regions = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let words: Vec<&str> = polled(line.split_ascii_whitespace())
            .take(MAX_WORDS + 1)
            .collect();
        if words.is_empty() {
            continue;
        }
        check_count(regions.len() + 1)?;
        if words.len() > MAX_WORDS {
            let (place, limit) = (format!("line {}", k + 1), MAX_CORNERS);
            return Err(LabelsProblem::TooManyCorners { place, limit });
        }
        let corners = corners(&words, page);
        regions.push(LabelRegion {
            number: regions.len() + 1,
            name: None,
            text: None,
            corners: corners
                .map_err(|reason| LabelsProblem::at(format!("line {}", k + 1), reason))?,
        });
    }
    Ok(PageRegions {
        regions,
        ..PageRegions::default()
    })
}

fn corners(words: &[&str], page: &PageFile<'_>) -> Result<Option<Corners>, String> {
    if words.len() < 5 {
        let count = words.len();
        return Err(format!(
            "{count} numbers; a line has a class and at least 4 more"
        ));
    }
    // A confidence makes the count even.
    let count = words.len() - usize::from(words.len().is_multiple_of(2));
    let fraction = |word: &&str| {
        let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
        let number = number.ok_or_else(|| format!("{} is not a number", quoted(word)))?;
        if number.abs() > MAX_FRACTION {
            return Err(format!(
                "{number} is not a fraction of the page from 0 to 1"
            ));
        }
        Ok(number)
    };
    let values: Vec<f64> = words[1..count]
        .iter()
        .map(fraction)
        .collect::<Result<_, String>>()?;
    let size = [f64::from(page.width), f64::from(page.height)];
    if let [cx, cy, width, height] = *values.as_slice() {
        let edge = |sign: f64| {
            [
                (cx + sign * width / 2.0) * size[0],
                (cy + sign * height / 2.0) * size[1],
            ]
        };
        return Ok(Some(box_between(edge(-1.0), edge(1.0))));
    }
    let point = |pair: &[f64]| [pair[0] * size[0], pair[1] * size[1]];
    Ok(polygon(values.chunks_exact(2).map(point).collect()))
}
