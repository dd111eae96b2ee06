//! Characters found on small drawn pages: the same shapes as relief of a face and as ink of a page.

use crate::block::align::CarvedFace;
use crate::block::found_boxes::skew::text_angle;
use crate::block::found_boxes::{FoundBox, find_boxes};
use crate::block::height_map::{HEIGHT_STEP_MM, HeightMap};
use crate::block::orientation::Orientation;
use crate::block::page_ink::PageInk;
use crate::block::page_map::PageMap;
use crate::block::relief::Relief;
use mocban_core::domain::Affine2;
use mocban_core::raster::{Grid, Mask};

/// Size of the face, mm. The frame is 3 mm inside.
const SIZE_MM: [f64; 2] = [82.0, 74.0];
const FRAME_MM: f64 = 3.0;
const COLUMN_MM: f64 = 15.0;
const ROW_MM: f64 = 11.0;
const TOP_MM: f64 = 4.0;
/// Pixels of the page per mm.
const SCALE: f64 = 8.0;

/// A rectangle on the face: left, top, right and bottom, mm.
type Rectangle = [f64; 4];

/// A page that is drawn: what the block shows and what the page shows.
#[derive(Clone, Default)]
struct Drawing {
    relief: Vec<Rectangle>,
    ink: Vec<Rectangle>,
    /// Names and boxes of the characters, mm.
    characters: Vec<(String, Rectangle)>,
}

impl Drawing {
    /// Draws the frame, and rules between five columns.
    fn ruled() -> Self {
        let mut drawing = Self::default();
        let [right, bottom] = SIZE_MM.map(|size| size - FRAME_MM);
        for rule in [
            [FRAME_MM - 0.6, FRAME_MM - 0.6, FRAME_MM, bottom + 0.6],
            [right, FRAME_MM - 0.6, right + 0.6, bottom + 0.6],
            [FRAME_MM, FRAME_MM - 0.6, right, FRAME_MM],
            [FRAME_MM, bottom, right, bottom + 0.6],
        ] {
            drawing.add(rule);
        }
        for column in 1..5 {
            let u = right - f64::from(column) * COLUMN_MM;
            drawing.add([u - 0.2, FRAME_MM, u + 0.2, bottom]);
        }
        drawing
    }

    /// Draws five columns of six characters, apart from those for which `blank` is true.
    fn full(blank: impl Fn(u32, u32) -> bool) -> Self {
        let mut drawing = Self::ruled();
        for column in 1..=5 {
            let mut number = 0;
            for row in 1..=6 {
                if !blank(column, row) {
                    number += 1;
                    let name = format!("c{column:02}-r{number:02}");
                    drawing.character(name, cell(column, row), 0.0);
                }
            }
        }
        drawing
    }

    fn add(&mut self, rectangle: Rectangle) {
        self.relief.push(rectangle);
        self.ink.push(rectangle);
    }

    /// Draws a character like the one for earth, whose lower stroke is longer, within a cell. The height of its middle
    /// stroke varies by `shift` mm.
    fn character(&mut self, name: String, [left, top, right, bottom]: Rectangle, shift: f64) {
        let at = |x: f64, y: f64| [left + x * (right - left), top + y * (bottom - top)];
        let stroke = |x0: f64, y0: f64, x1: f64, y1: f64| {
            let ([u0, v0], [u1, v1]) = (at(x0, y0), at(x1, y1));
            [u0, v0, u1, v1]
        };
        let mut middle = stroke(0.25, 0.35, 0.75, 0.47);
        middle[1] += shift;
        middle[3] += shift;
        self.add(stroke(0.43, 0.05, 0.57, 0.95));
        self.add(middle);
        self.add(stroke(0.05, 0.83, 0.95, 0.95));
        self.characters.push((name, stroke(0.05, 0.05, 0.95, 0.95)));
    }

    /// Draws two columns of notes in a cell of a column, from `line` on.
    fn notes(&mut self, column: u32, first_row: u32, line: u32, lines: u32) {
        let [left, top, right, _] = cell(column, first_row);
        let middle = f64::midpoint(left, right);
        let pitch = 0.55 * ROW_MM;
        for k in 0..lines {
            let v = top + f64::from(k) * pitch;
            for (half, u) in [("a", middle + 0.4), ("b", left - 0.7)] {
                let name = format!("c{column:02}-r{:02}{half}", line + k);
                let room = [u, v, u + (right - left) / 2.0 + 0.3, v + pitch - 0.3];
                self.character(name, room, 0.2 * f64::from(k % 3));
            }
        }
    }

    /// Returns the face, turned by an angle in rad.
    fn face(&self, angle: f64) -> CarvedFace {
        let margin = if angle == 0.0 { 0.0 } else { 8.0 };
        let count = |size: f64| ((size + 2.0 * margin) / HEIGHT_STEP_MM) as usize;
        let (width, height) = (count(SIZE_MM[0]), count(SIZE_MM[1]));
        let is_stroke = turned(angle);
        let place = |at: usize| at as f64 * HEIGHT_STEP_MM - margin;
        let soft = Grid::from_fn(width, height, |x, y| {
            255 * u8::from(is_stroke(&self.relief, [place(x), place(y)]))
        });
        let whole = [[0.0, 0.0, SIZE_MM[0], SIZE_MM[1]]];
        let cell = 4.0 * HEIGHT_STEP_MM;
        let face = Mask::from_fn(width.div_ceil(4), height.div_ceil(4), |x, y| {
            is_stroke(&whole, [x as f64 * cell - margin, y as f64 * cell - margin])
        });
        let frame = Orientation {
            mm: 1.0,
            centre: [0.0; 3],
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            half_extent_mm: [50.0, 50.0, 10.0],
            triangles: 1,
        };
        CarvedFace {
            map: HeightMap {
                frame,
                origin_mm: [-margin; 2],
                heights: soft.map(|stroke| f32::from(*stroke) / 255.0),
            },
            relief: Relief {
                soft,
                face,
                surface: Grid::new(4, 4, 1.0),
                angle_rad: 0.0,
            },
        }
    }

    /// Returns the page of `size` pixels that a map prints.
    fn page(&self, page_from_face: &Affine2, size: [usize; 2]) -> PageInk {
        let inverse = page_from_face.inverse().expect("an invertible map");
        let is_ink = turned(0.0);
        PageInk::of_soft(Grid::from_fn(size[0], size[1], |x, y| {
            let face = inverse.apply([x as f64, y as f64]);
            255 * u8::from(is_ink(&self.ink, face))
        }))
    }

    /// Finds the characters on a page that is printed by a map.
    fn found(&self, page_from_face: &Affine2, size: [usize; 2]) -> Vec<FoundBox> {
        let map = PageMap::affine(page_from_face, [0.0; 2], SIZE_MM);
        find_boxes(&self.face(0.0), &self.page(page_from_face, size), &map)
    }

    /// Checks names and boxes of all characters.
    fn check(&self, page_from_face: &Affine2, size: [usize; 2]) {
        let found = self.found(page_from_face, size);
        let names: Vec<String> = found.iter().map(FoundBox::name).collect();
        let expected: Vec<&str> = self
            .characters
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        assert_eq!(names, expected);
        for (found, (name, [left, top, right, bottom])) in found.iter().zip(&self.characters) {
            let corners = [[*left, *top], [*right, *bottom]].map(|c| page_from_face.apply(c));
            for k in 0..2 {
                let ends = [
                    corners[0][k].min(corners[1][k]),
                    corners[0][k].max(corners[1][k]),
                ];
                for (end, at) in [
                    (ends[0], found.page_box[k]),
                    (ends[1], found.page_box[k + 2]),
                ] {
                    assert!((end - at).abs() < 1.5, "{name}: {end} is found at {at}");
                }
            }
        }
    }
}

/// Returns a function that looks whether a point lies in rectangles that are turned about the middle of the face.
fn turned(angle: f64) -> impl Fn(&[Rectangle], [f64; 2]) -> bool {
    let (sin, cos) = angle.sin_cos();
    move |shapes: &[Rectangle], [u, v]: [f64; 2]| {
        let (x, y) = (u - SIZE_MM[0] / 2.0, v - SIZE_MM[1] / 2.0);
        let u = cos * x + sin * y + SIZE_MM[0] / 2.0;
        let v = cos * y - sin * x + SIZE_MM[1] / 2.0;
        let contains = |[left, top, right, bottom]: &Rectangle| {
            u >= *left && u < *right && v >= *top && v < *bottom
        };
        shapes.iter().any(contains)
    }
}

/// Returns the room of a character: columns from the right, rows from the top, both from 1.
fn cell(column: u32, row: u32) -> Rectangle {
    let right = SIZE_MM[0] - FRAME_MM - f64::from(column - 1) * COLUMN_MM - 2.0;
    let top = TOP_MM + f64::from(row - 1) * ROW_MM;
    [right - COLUMN_MM + 4.0, top, right, top + ROW_MM - 0.4]
}

/// Returns the map of an upright page with a margin of 2 mm, and the size of the page.
fn upright() -> (Affine2, [usize; 2]) {
    let map = Affine2([[SCALE, 0.0, 16.0], [0.0, SCALE, 16.0]]);
    (map, SIZE_MM.map(|size| (SCALE * size) as usize + 32))
}

#[test]
fn characters_are_found_in_reading_order() {
    let (map, size) = upright();
    Drawing::full(|_, _| false).check(&map, size);
}

#[test]
fn blanks_are_not_counted() {
    let (map, size) = upright();
    // An indented column, a blank in a column, and a column that ends early.
    let blank = |column: u32, row: u32| matches!((column, row), (2, 1) | (3, 4) | (5, 3..));
    Drawing::full(blank).check(&map, size);
}

#[test]
fn notes_are_found_two_by_two() {
    let mut drawing = Drawing::full(|column, row| column == 2 && row >= 2);
    let after: Vec<_> = drawing.characters.split_off(7);
    drawing.notes(2, 2, 2, 7);
    drawing.characters.extend(after);
    let (map, size) = upright();
    drawing.check(&map, size);
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
    let (map, size) = upright();
    drawing.check(&map, size);
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
    let (map, size) = upright();
    drawing.check(&map, size);
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
