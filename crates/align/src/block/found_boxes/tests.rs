//! Characters found on small drawn pages.

use super::drawing::{
    COLUMN_MM, Drawing, FRAME_MM, ROW_MM, Rectangle, SCALE, SIZE_MM, cell, upright,
};
use crate::block::found_boxes::FoundBox;
use crate::block::found_boxes::skew::text_angle;
use mocban_core::domain::Affine2;

#[test]
fn characters_are_found_in_reading_order() {
    Drawing::full(|_, _| false).check_upright();
}

#[test]
fn blanks_are_not_counted() {
    // An indented column, a blank in a column, and a column that ends early.
    let blank = |column: u32, row: u32| matches!((column, row), (2, 1) | (3, 4) | (5, 3..));
    Drawing::full(blank).check_upright();
}

#[test]
fn notes_are_found_two_by_two() {
    let mut drawing = Drawing::full(|column, row| column == 2 && row >= 2);
    let after: Vec<_> = drawing.characters.split_off(7);
    drawing.notes(2, 2, 2, 7);
    drawing.characters.extend(after);
    drawing.check_upright();
}

#[test]
fn turned_pages_are_read_in_the_same_order() {
    let drawing = Drawing::full(|column, row| column == 5 && row > 4);
    let [width, height] = SIZE_MM.map(|size| SCALE * size);
    let (tall, wide) = (
        [height as usize, width as usize],
        [width as usize, height as usize],
    );
    let quarter = Affine2([[0.0, -SCALE, height], [SCALE, 0.0, 0.0]]);
    drawing.check(&quarter, tall);
    let half = Affine2([[-SCALE, 0.0, width], [0.0, -SCALE, height]]);
    drawing.check(&half, wide);
    let three_quarters = Affine2([[0.0, SCALE, 0.0], [-SCALE, 0.0, width]]);
    drawing.check(&three_quarters, tall);
}

#[test]
fn specks_and_stains_are_no_characters() {
    let mut drawing = Drawing::full(|column, row| column == 3 && row == 4);
    let [left, top, ..] = cell(3, 4);
    drawing
        .ink
        .push([left + 3.0, top + 3.0, left + 3.6, top + 3.6]);
    drawing
        .relief
        .push([left + 6.0, top + 6.0, left + 6.3, top + 6.3]);
    // A stain on the margin.
    drawing.ink.push([0.2, 20.0, 1.8, 24.0]);
    drawing.check_upright();
}

#[test]
fn characters_beyond_the_page_are_counted_only() {
    let drawing = Drawing::full(|_, _| false);
    let (map, [width, height]) = upright();
    // The page ends at the rule between the third and the fourth column from the left.
    let left = SIZE_MM[0] - FRAME_MM - 2.0 * COLUMN_MM;
    let cut = Affine2([[SCALE, 0.0, 16.0 - (16.0 + SCALE * left)], map.0[1]]);
    let found = drawing.found(&cut, [width - (16.0 + SCALE * left) as usize, height]);
    assert_eq!(found.len(), 12);
    assert_eq!(found[11].name(), "c02-r06");
    // The left half of the page shows columns 4 and 5 of five.
    let right = SIZE_MM[0] - FRAME_MM - 3.0 * COLUMN_MM;
    let found = drawing.found(&map, [(16.0 + SCALE * right) as usize, height]);
    assert_eq!(found.len(), 12);
    assert_eq!(found[0].name(), "c04-r01");
}

#[test]
fn characters_that_the_block_lost_are_counted_only() {
    let mut drawing = Drawing::full(|_, _| false);
    let [left, top, right, bottom] = cell(2, 3);
    drawing.relief.retain(|[u0, v0, u1, v1]| {
        *u1 < left || *u0 > right || *v1 < top || *v0 > bottom || v1 - v0 > 20.0
    });
    let (map, size) = upright();
    let names: Vec<String> = drawing
        .found(&map, size)
        .iter()
        .map(FoundBox::name)
        .collect();
    assert_eq!(names.len(), 29);
    assert!(!names.contains(&"c02-r03".to_owned()));
    assert!(names.contains(&"c02-r06".to_owned()));
}

#[test]
fn relief_that_is_not_printed_before_the_text_is_not_counted() {
    let (map, size) = upright();
    let whole = Drawing::full(|_, _| false).found(&map, size);
    let mut drawing = Drawing::full(|_, _| false);
    let (column, first) = (cell(1, 1), cell(2, 1));
    // The page has neither the first column nor the first character of the second one.
    drawing.ink.retain(|[left, top, right, bottom]| {
        let is_stroke = bottom - top < 20.0 && right - left < 20.0;
        let is_first = *left >= first[0] && *bottom <= first[3];
        !is_stroke || !(*left >= column[0] || is_first)
    });
    let found = drawing.found(&map, size);
    assert_eq!(found.len(), 23);
    assert_eq!(found[0].name(), "c01-r01");
    assert_eq!(found[0].page_box, whole[7].page_box);
    assert_eq!(found[5].name(), "c02-r01");
}

#[test]
fn a_worn_character_keeps_its_box() {
    let (map, size) = upright();
    let whole = Drawing::full(|_, _| false).found(&map, size);
    let mut drawing = Drawing::full(|_, _| false);
    let [left, top, _, bottom] = cell(1, 1);
    // The lower stroke is printed, but the block has lost it.
    let is_lower_stroke =
        |[u0, v0, _, v1]: &Rectangle| *u0 > left && *v0 > top + ROW_MM / 2.0 && *v1 < bottom;
    drawing.relief.retain(|stroke| !is_lower_stroke(stroke));
    assert_eq!(drawing.relief.len() + 1, drawing.ink.len());
    assert_eq!(drawing.found(&map, size)[0], whole[0]);
}

#[test]
fn text_without_rules_is_found() {
    let mut drawing = Drawing::default();
    for column in 1..=5 {
        for row in 1..=6 {
            drawing.character(format!("c{column:02}-r{row:02}"), cell(column, row), 0.0);
        }
    }
    drawing.check_upright();
}

#[test]
fn the_angle_of_the_text_is_found() {
    let drawing = Drawing::full(|column, row| column == row);
    for degrees in [-3.0_f64, 0.0, 2.4] {
        let face = drawing.face(degrees.to_radians());
        let found = text_angle(&face, 0.0).to_degrees();
        // One pixel of the last round over the height of this small page is 0.23 degrees.
        assert!(
            (found - degrees).abs() < 0.3,
            "{degrees} is found as {found}"
        );
    }
}

#[test]
fn an_empty_page_has_no_characters() {
    let (map, size) = upright();
    assert_eq!(Drawing::default().found(&map, size), []);
    assert_eq!(Drawing::ruled().found(&map, size), []);
}
