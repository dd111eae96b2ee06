//! Choice of the elements of PAGE-XML that stand for characters, in files whose elements are divided unevenly.

use crate::labels::message::list;
use crate::labels::model::bounds;
use crate::labels::region::LabelRegion;

/// Elements that may stand for characters, the smallest first.
pub(super) const LEVELS: [&str; 4] = ["Glyph", "Word", "TextLine", "TextRegion"];

/// A line or region this many times as large as most characters holds several.
const MAX_RATIO: f64 = 4.0;

/// An element that is not divided into smaller ones.
#[derive(Debug)]
pub(super) struct PageElement {
    /// Its place in [`LEVELS`].
    pub(super) level: usize,
    pub(super) region: LabelRegion,
}

impl PageElement {
    fn area(&self) -> Option<f64> {
        let [x0, y0, x1, y1] = bounds(self.region.corners.as_deref()?);
        Some((x1 - x0) * (y1 - y0))
    }
}

/// Returns the elements that stand for characters, and warnings. Elements of different levels are taken together, such as
/// a word that is divided into glyphs and others that are not. An element is left out if there are smaller ones elsewhere
/// and it is too large for a character, such as a line without words, or a region without lines.
pub(super) fn characters(found: Vec<PageElement>) -> (Vec<LabelRegion>, Vec<String>) {
    let smallest = found.iter().map(|one| one.level).min().unwrap_or_default();
    let mut areas: Vec<f64> = found.iter().filter_map(PageElement::area).collect();
    areas.sort_by(f64::total_cmp);
    let median = areas.get(areas.len().saturating_sub(1) / 2).copied();
    let max_area = MAX_RATIO * median.unwrap_or_default();
    let is_character = |one: &PageElement| {
        one.level == smallest || one.area().is_some_and(|area| area <= max_area)
    };
    let (taken, large): (Vec<_>, Vec<_>) = found.into_iter().partition(is_character);
    let larger = taken.iter().filter(|one| one.level > smallest);
    let warnings = [
        warning(larger, ["taken as a character", "taken as characters"]),
        warning(
            large.iter(),
            [
                "left out, because it holds several characters",
                "left out, because they hold several characters",
            ],
        ),
    ];
    let regions = taken.into_iter().map(|one| one.region).collect();
    (regions, warnings.into_iter().flatten().collect())
}

/// Returns a warning about elements, if there are any; `one` says what became of one of them, `outcome` what became of several.
fn warning<'e>(
    elements: impl Iterator<Item = &'e PageElement>,
    [one, outcome]: [&str; 2],
) -> Option<String> {
    let shown = elements.map(|one| format!("{} {}", LEVELS[one.level], one.region.shown()));
    let shown: Vec<String> = shown.collect();
    let names = list(&shown);
    match shown.len() {
        0 => None,
        1 => Some(format!(
            "1 element is not divided as others are, and {one}: {names}"
        )),
        count => Some(format!(
            "{count} elements are not divided as others are, and {outcome}: {names}"
        )),
    }
}
