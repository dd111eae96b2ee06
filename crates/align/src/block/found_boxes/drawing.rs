//! Small drawn pages for tests: the same shapes as relief of a face and as ink of a page.

use super::{FoundBox, find_boxes};
use crate::block::align::CarvedFace;
use crate::block::height_map::{HEIGHT_STEP_MM, HeightMap};
use crate::block::orientation::Orientation;
use crate::block::page_ink::PageInk;
use crate::block::page_map::PageMap;
use crate::block::relief::Relief;
use mocban_core::domain::Affine2;
use mocban_core::raster::{Grid, Mask};

/// Size of the face, mm. The frame is 3 mm inside.
pub(super) const SIZE_MM: [f64; 2] = [82.0, 74.0];
pub(super) const FRAME_MM: f64 = 3.0;
pub(super) const COLUMN_MM: f64 = 15.0;
pub(super) const ROW_MM: f64 = 11.0;
pub(super) const TOP_MM: f64 = 4.0;
/// Pixels of the page per mm.
pub(super) const SCALE: f64 = 8.0;

/// A rectangle on the face: left, top, right and bottom, mm.
pub(super) type Rectangle = [f64; 4];

/// A page that is drawn: what the block shows and what the page shows.
#[derive(Clone, Default)]
pub(super) struct Drawing {
    pub(super) relief: Vec<Rectangle>,
    pub(super) ink: Vec<Rectangle>,
    /// Names and boxes of the characters, mm.
    pub(super) characters: Vec<(String, Rectangle)>,
}

impl Drawing {
    /// Draws the frame, and rules between five columns.
    pub(super) fn ruled() -> Self {
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
    pub(super) fn full(blank: impl Fn(u32, u32) -> bool) -> Self {
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

    pub(super) fn add(&mut self, rectangle: Rectangle) {
        self.relief.push(rectangle);
        self.ink.push(rectangle);
    }

    /// Draws a character like the one for earth, whose lower stroke is longer, within a cell. The height of its middle
    /// stroke varies by `shift` mm.
    pub(super) fn character(
        &mut self,
        name: String,
        [left, top, right, bottom]: Rectangle,
        shift: f64,
    ) {
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
    pub(super) fn notes(&mut self, column: u32, first_row: u32, line: u32, lines: u32) {
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
    pub(super) fn face(&self, angle: f64) -> CarvedFace {
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
    pub(super) fn page(&self, page_from_face: &Affine2, size: [usize; 2]) -> PageInk {
        let inverse = page_from_face.inverse().expect("an invertible map");
        let is_ink = turned(0.0);
        PageInk::of_soft(Grid::from_fn(size[0], size[1], |x, y| {
            let face = inverse.apply([x as f64, y as f64]);
            255 * u8::from(is_ink(&self.ink, face))
        }))
    }

    /// Finds the characters on a page that is printed by a map.
    pub(super) fn found(&self, page_from_face: &Affine2, size: [usize; 2]) -> Vec<FoundBox> {
        let map = PageMap::affine(page_from_face, [0.0; 2], SIZE_MM);
        find_boxes(&self.face(0.0), &self.page(page_from_face, size), &map)
    }

    /// Checks names and boxes of all characters on an upright page.
    pub(super) fn check_upright(&self) {
        let (map, size) = upright();
        self.check(&map, size);
    }

    /// Checks names and boxes of all characters.
    pub(super) fn check(&self, page_from_face: &Affine2, size: [usize; 2]) {
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
pub(super) fn cell(column: u32, row: u32) -> Rectangle {
    let right = SIZE_MM[0] - FRAME_MM - f64::from(column - 1) * COLUMN_MM - 2.0;
    let top = TOP_MM + f64::from(row - 1) * ROW_MM;
    [right - COLUMN_MM + 4.0, top, right, top + ROW_MM - 0.4]
}

/// Returns the map of an upright page with a margin of 2 mm, and the size of the page.
pub(super) fn upright() -> (Affine2, [usize; 2]) {
    let map = Affine2([[SCALE, 0.0, 16.0], [0.0, SCALE, 16.0]]);
    (map, SIZE_MM.map(|size| (SCALE * size) as usize + 32))
}
