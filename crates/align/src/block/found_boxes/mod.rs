//! Finds the characters of a page without labels, on relief and ink together.

mod broken_rules;
mod column_profile;
mod columns;
mod direction;
#[cfg(test)]
mod drawing;
mod layout;
mod measured_strokes;
mod page_rules;
#[cfg(test)]
mod page_tests;
mod places;
mod rows;
mod rules;
mod skew;
mod stroke_parts;
mod tall_notes;
#[cfg(test)]
mod tests;
mod text_image;
mod usual_room;

use self::columns::find_columns;
use self::direction::Upright;
use self::layout::CELL_MM;
use self::measured_strokes::measure;
use self::places::{CharacterPlace, Half, Strokes, places};
use self::rows::{RowPitches, find_rows};
use super::align::CarvedFace;
use super::page_ink::PageInk;
use super::page_map::PageMap;
use mocban_core::domain::{BoxName, NotePart, rounded_edge};

/// Least area of a character, mm^2, and least length of its longer side, in pitches.
const MIN_AREA_MM2: f64 = 0.8;
const MIN_SIDE: f64 = 0.25;
/// Width below which a column without rules may be the strip at the fold, in pitches.
const STRIP_WIDTH: f64 = 0.9;
/// Largest thickness of a piece of a rule, and largest length of one along the rows, in pitches.
const THIN: f64 = 0.14;
const LEVEL_STROKE: f64 = 0.6;
/// Least mean relief below the ink of a character.
const MIN_SUPPORT: f64 = 0.08;
/// Largest fraction of a character's strokes where the page does not show the block.
const MAX_UNSEEN: f64 = 0.5;
/// A page that lacks more than this fraction of the characters shows only a part of the text. With a smaller fraction,
/// what it lacks is wood beside the text.
const PART_UNSEEN: f64 = 0.3;

/// A character that was found on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundBox {
    /// Left, top, right and bottom edge of its ink on the page, pixels; (0, 0) is the centre of the first pixel.
    pub page_box: [f64; 4],
    /// Column and row. The strip at the fold is a column; blanks do not count as rows, and wood beside the text counts as
    /// neither.
    pub place: BoxName,
}

impl FoundBox {
    /// Returns the name by column and row, such as `c03-r12` or `c03-r12a`.
    pub fn name(&self) -> String {
        self.place.to_string()
    }
}

/// Finds the characters of a page in reading order: columns from right to left, each from the top.
pub fn find_boxes(face: &CarvedFace, page: &PageInk, map: &PageMap) -> Vec<FoundBox> {
    let mut upright = Upright::of(face, page, map);
    let Some(mut columns) = find_columns(&upright.layout) else {
        return Vec::new();
    };
    let edges: Vec<usize> = columns
        .all
        .iter()
        .flat_map(|column| column.across)
        .collect();
    if upright
        .layout
        .erase_broken_rules(&upright.image, (&edges, columns.pitch))
    {
        columns = find_columns(&upright.layout).unwrap_or(columns);
    }
    for column in &columns.all {
        let is_narrow = (column.across[1] - column.across[0]) as f64 <= STRIP_WIDTH * columns.pitch;
        if column.is_strip || is_narrow {
            upright
                .layout
                .erase_ornaments(column.across, column.is_strip);
        } else {
            upright.layout.erase_solid_parts(column.across);
        }
    }
    let (rows, pitches) = find_rows(&upright.layout, &columns);
    let places = places(&columns, &rows);
    let strokes = measure(&upright.image, &upright.layout, map, &places, columns.pitch);
    let is_upside_down = upright.is_upside_down(&places, &strokes);
    numbered(
        &places,
        &strokes,
        &pitches,
        columns.all.len(),
        is_upside_down,
        page.size(),
    )
}

/// Returns whether a place holds a character.
fn is_character(place: &CharacterPlace, strokes: &Strokes, pitches: &RowPitches) -> bool {
    let pitch = if place.half.is_some() {
        pitches.note
    } else {
        pitches.row
    };
    let pitch_mm = pitch * CELL_MM;
    let [width, height] = strokes.size_mm();
    // The character for one is a level stroke, but a long one, and no character is a thin upright stroke.
    let is_piece_of_rule =
        width <= THIN * pitch_mm || (height <= THIN * pitch_mm && width <= LEVEL_STROKE * pitch_mm);
    strokes.area_mm2() >= MIN_AREA_MM2
        && width.max(height) >= MIN_SIDE * pitch_mm
        && !is_piece_of_rule
}

/// Returns whether a box lies on the page, with a tolerance of one pixel.
fn is_on_page(strokes: &Strokes, [width, height]: [usize; 2]) -> bool {
    let [left, top, right, bottom] = strokes.page_bounds;
    left >= -1.5 && top >= -1.5 && right <= width as f64 + 0.5 && bottom <= height as f64 + 0.5
}

/// Returns the box of a character, cut at the edges of the page and rounded, as labels are.
fn on_page(strokes: &Strokes, [width, height]: [usize; 2]) -> [f64; 4] {
    let [left, top, right, bottom] = strokes.page_bounds;
    let edge = |at: f64, side: usize| rounded_edge(at.clamp(-0.5, side as f64 - 0.5));
    [
        edge(left, width),
        edge(top, height),
        edge(right, width),
        edge(bottom, height),
    ]
}

/// Numbers the characters in reading order and leaves out what the block or the page does not show.
fn numbered(
    places: &[CharacterPlace],
    strokes: &[Strokes],
    pitches: &RowPitches,
    columns: usize,
    is_upside_down: bool,
    page_size: [usize; 2],
) -> Vec<FoundBox> {
    let mut characters: Vec<(u32, i64, Option<NotePart>, &Strokes)> = places
        .iter()
        .zip(strokes)
        .filter(|(place, strokes)| is_character(place, strokes, pitches))
        .map(|(place, strokes)| {
            let half = place.half.map(|half| match (half, is_upside_down) {
                (Half::Right, false) | (Half::Left, true) => NotePart::Right,
                (Half::Left, false) | (Half::Right, true) => NotePart::Left,
            });
            if is_upside_down {
                (place.column as u32 + 1, -(place.row as i64), half, strokes)
            } else {
                (
                    (columns - place.column) as u32,
                    place.row as i64,
                    half,
                    strokes,
                )
            }
        })
        .collect();
    let is_seen =
        |strokes: &Strokes| is_on_page(strokes, page_size) && strokes.unseen() <= MAX_UNSEEN;
    let unseen = characters.iter().filter(|(.., strokes)| !is_seen(strokes));
    let is_part = unseen.count() as f64 > PART_UNSEEN * characters.len() as f64;
    characters.sort_by_key(|(column, row, half, _)| (*column, *row, *half));
    let mut boxes = Vec::new();
    let (mut number, mut before) = (0, None);
    let mut first_column = None;
    for (column, row, half, strokes) in characters {
        if before.is_none_or(|(last, _)| last != column) {
            (number, before) = (0, None);
        }
        let (is_seen, is_printed) = (is_seen(strokes), strokes.is_printed());
        // Relief without ink before all characters is wood beside the text, unless the page shows only a part of it.
        if number == 0 && !is_printed && (is_seen || !is_part) {
            continue;
        }
        if before != Some((column, row)) {
            number += 1;
        }
        before = Some((column, row));
        let first_column = *first_column.get_or_insert(column);
        if !is_seen || !is_printed || strokes.support() < MIN_SUPPORT {
            continue;
        }
        boxes.push(FoundBox {
            page_box: on_page(strokes, page_size),
            place: BoxName {
                column: column + 1 - first_column,
                row: number,
                part: half,
            },
        });
    }
    boxes
}
