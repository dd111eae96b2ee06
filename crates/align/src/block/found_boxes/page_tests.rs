//! Characters found on small drawn pages that look like those of libraries.

use super::drawing::{COLUMN_MM, Drawing, FRAME_MM, ROW_MM, Rectangle, SIZE_MM, cell, upright};

/// Draws the frame with rules between the columns in pieces of 6 mm, which lean.
fn with_broken_rules() -> Drawing {
    let mut drawing = Drawing::full(|column, row| column == 3 && row > 4);
    let is_inner_rule = |[left, top, right, bottom]: &Rectangle| {
        right - left < 0.5 && bottom - top > 40.0 && *left > FRAME_MM
    };
    drawing.relief.retain(|rule| !is_inner_rule(rule));
    drawing.ink.retain(|rule| !is_inner_rule(rule));
    for column in 1..5 {
        for piece in 0..7 {
            let top = FRAME_MM + 1.0 + 9.5 * f64::from(piece);
            let u = SIZE_MM[0] - FRAME_MM - f64::from(column) * COLUMN_MM + 0.08 * f64::from(piece)
                - 0.3;
            let rule = [u - 0.2, top, u + 0.2, top + 6.0];
            drawing.relief.push(rule);
            drawing.ink.push(rule);
        }
    }
    drawing
}

/// Draws two notes side by side in a cell, as high as a character.
fn tall_notes(drawing: &mut Drawing, column: u32, row: u32, line: u32) {
    let [left, top, right, bottom] = cell(column, row);
    let middle = f64::midpoint(left, right);
    for (half, from, to) in [
        ("a", middle + 0.4, right + 1.2),
        ("b", left - 1.2, middle - 0.4),
    ] {
        let name = format!("c{column:02}-r{line:02}{half}");
        drawing.character(name, [from, top, to, bottom], 0.0);
    }
}

#[test]
fn notes_as_high_as_characters_are_found_two_by_two() {
    let mut drawing = Drawing::full(|column, row| column == 2 && row >= 3 && row != 5);
    let five = drawing
        .characters
        .iter()
        .position(|(name, _)| name == "c02-r03");
    let mut after = drawing
        .characters
        .split_off(five.expect("the character between the notes"));
    tall_notes(&mut drawing, 2, 3, 3);
    tall_notes(&mut drawing, 2, 4, 4);
    "c02-r05".clone_into(&mut after[0].0);
    drawing.characters.push(after.remove(0));
    tall_notes(&mut drawing, 2, 6, 6);
    drawing.characters.extend(after);
    drawing.check_upright();
}

#[test]
fn rules_in_pieces_belong_to_no_character() {
    with_broken_rules().check_upright();
}

#[test]
fn a_page_with_few_characters_has_the_columns_of_its_rules() {
    let is_blank = |column: u32, row: u32| match column {
        1 => row > 2,
        2 | 4 => row != 5,
        _ => !(2..4).contains(&row),
    };
    Drawing::full(is_blank).check_upright();
}

#[test]
fn characters_without_neighbours_are_whole() {
    let mut drawing = Drawing::ruled();
    for (column, top) in (1..).zip([5.0, 57.0, 20.0, 40.0, 30.0]) {
        let [left, _, right, _] = cell(column, 1);
        let name = format!("c{column:02}-r01");
        drawing.character(name, [left, top, right, top + 13.0], 0.0);
    }
    drawing.check_upright();
}

#[test]
fn a_piece_of_a_rule_beside_a_character_leaves_its_box() {
    let mut drawing = Drawing::full(|_, _| false);
    let [left, top, right, _] = cell(3, 3);
    let middle = f64::midpoint(left, right);
    drawing.add([middle + 6.35, top + 2.0, middle + 6.75, top + 6.0]);
    drawing.check_upright();
}

#[test]
fn a_mark_over_a_character_leaves_its_box() {
    let mut drawing = Drawing::full(|_, _| false);
    let [left, top, right, _] = cell(3, 3);
    let middle = f64::midpoint(left, right);
    drawing
        .ink
        .push([middle - 6.8, top + 6.0, middle + 6.8, top + 6.8]);
    drawing.check_upright();
}

#[test]
fn solid_ornaments_in_a_wide_column_are_no_characters() {
    let mut drawing = Drawing::full(|column, row| column == 3 && row == 3);
    let [left, top, ..] = cell(3, 3);
    drawing.add([left + 1.5, top + 1.0, left + 9.5, top + 9.0]);
    drawing.check_upright();
}

#[test]
fn a_tear_divides_no_character() {
    let mut drawing = Drawing::full(|_, _| false);
    let [left, _, right, _] = cell(3, 1);
    let u = left + 0.3 * (right - left);
    drawing.ink.push([u, 0.0, u + 0.6, SIZE_MM[1]]);
    drawing.check_upright();
}

#[test]
fn characters_printed_thinner_than_carved_are_found() {
    let mut drawing = Drawing::full(|column, row| column == 1 && row == 4);
    for [left, top, right, bottom] in &mut drawing.ink {
        let is_level = *right - *left > *bottom - *top;
        let is_character = (*right - *left).max(*bottom - *top) < 2.0 * ROW_MM;
        if is_character && is_level {
            (*top, *bottom) = (*top + 0.35, *bottom - 0.35);
        } else if is_character {
            (*left, *right) = (*left + 0.45, *right - 0.45);
        }
    }
    let (map, size) = upright();
    let names: Vec<String> = drawing
        .found(&map, size)
        .iter()
        .map(super::FoundBox::name)
        .collect();
    let expected: Vec<&str> = drawing
        .characters
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(names, expected);
}
