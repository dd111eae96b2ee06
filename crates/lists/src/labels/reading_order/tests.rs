//! Names of boxes on generated pages.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::reading_order;
use mocban_core::domain::{BoxName, NotePart};

/// Distance of columns and rows of the generated pages in pixels.
const PITCH: [f64; 2] = [120.0, 105.0];

/// What stands in a column, from the top.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cell {
    /// A character of full size.
    Full,
    /// A flat one, such as the numeral one, in its full width.
    Flat,
    /// A place without a box.
    Missing,
    /// Two notes side by side, in half the height.
    Notes,
    /// A right note without a left one.
    RightNote,
    /// The space of half a row.
    HalfRow,
}

/// Distance from the middle of the column, width and height, and part of a box.
type DrawnBox = (f64, [f64; 2], Option<NotePart>);

/// A source of random numbers (`SplitMix64`).
struct SplitMix(u64);

impl SplitMix {
    /// Returns a number in 0..1.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// How a page is turned and bent.
#[derive(Debug, Clone, Copy, Default)]
struct DrawnBend {
    /// Clockwise.
    degrees: f64,
    /// Sideways shift at the corners, in pixels.
    keystone: f64,
    /// Sideways shift at top and bottom, in pixels.
    bow: f64,
}

impl DrawnBend {
    /// Returns the box around a box on a bent page from its place and half its width and height on an even page of ten
    /// columns and 20 rows.
    fn bounds(self, [x, y]: [f64; 2], [w, h]: [f64; 2]) -> [f64; 4] {
        let (across, down) = ((x - 2460.0) / 600.0, (y - 1150.0) / 1050.0);
        let x = x + self.keystone * across * down + self.bow * down * down;
        turned([x, y], [w, h], self.degrees)
    }
}

impl From<f64> for DrawnBend {
    fn from(degrees: f64) -> Self {
        Self {
            degrees,
            ..Self::default()
        }
    }
}

/// A page: its boxes with their expected names.
#[derive(Debug, Default)]
struct Page {
    boxes: Vec<([f64; 4], BoxName)>,
}

impl Page {
    /// Draws columns from the right, each from a height in pixels. Boxes differ from their places at random.
    fn new(
        columns: &[(f64, Vec<Cell>)],
        bend: impl Into<DrawnBend>,
        random: &mut SplitMix,
    ) -> Self {
        let (mut page, bend) = (Self::default(), bend.into());
        for (k, (top, cells)) in columns.iter().enumerate() {
            let middle = 3000.0 - PITCH[0] * k as f64;
            let (mut y, mut row) = (*top, 0);
            let column = k as u32 + 1;
            for cell in cells {
                let (height, sizes): (f64, &[DrawnBox]) = match cell {
                    Cell::Full => (1.0, &[(0.0, [92.0, 90.0], None)]),
                    Cell::Flat => (1.0, &[(0.0, [90.0, 20.0], None)]),
                    Cell::Missing => (1.0, &[]),
                    Cell::HalfRow => (0.5, &[]),
                    Cell::Notes => (
                        0.5,
                        &[
                            (26.0, [46.0, 42.0], Some(NotePart::Right)),
                            (-26.0, [44.0, 42.0], Some(NotePart::Left)),
                        ],
                    ),
                    Cell::RightNote => (0.5, &[(26.0, [46.0, 42.0], Some(NotePart::Right))]),
                };
                row += u32::from(!sizes.is_empty());
                for (aside, [w, h], part) in sizes {
                    let mut near = |range: f64| range * (2.0 * random.unit() - 1.0);
                    let centre = [middle + aside + near(4.0), y + near(4.0)];
                    let half = [w / 2.0 + near(3.0), h / 2.0 + near(3.0)];
                    let name = BoxName {
                        column,
                        row,
                        part: *part,
                    };
                    page.boxes.push((bend.bounds(centre, half), name));
                }
                y += height * PITCH[1];
            }
        }
        page
    }

    /// Checks the names of all boxes, in the order of the page and in another one.
    fn check(&self, what: &str) {
        let mut boxes = self.boxes.clone();
        for _ in 0..2 {
            let bounds: Vec<[f64; 4]> = boxes.iter().map(|(bounds, _)| *bounds).collect();
            let names = reading_order(&bounds);
            let wrong: Vec<String> = names
                .iter()
                .zip(&boxes)
                .filter(|(found, (_, expected))| *found != expected)
                .map(|(found, (_, expected))| format!("{expected} is {found}"))
                .collect();
            assert!(
                wrong.is_empty(),
                "{what}: {} of {}: {wrong:?}",
                wrong.len(),
                names.len()
            );
            boxes.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]));
        }
    }
}

/// Returns the box around a box that is turned clockwise with its page.
fn turned([x, y]: [f64; 2], [w, h]: [f64; 2], degrees: f64) -> [f64; 4] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let centre = [x * cos - y * sin, x * sin + y * cos];
    // Glyphs are rounder than boxes, so their boxes grow by about half of what those of boxes would.
    let grown = [w + 0.5 * h * sin.abs(), h + 0.5 * w * sin.abs()];
    [
        centre[0] - grown[0],
        centre[1] - grown[1],
        centre[0] + grown[0],
        centre[1] + grown[1],
    ]
}

/// Returns columns of full characters of which some are flat or missing.
fn plain_columns(count: usize, rows: usize, random: &mut SplitMix) -> Vec<(f64, Vec<Cell>)> {
    let mut cell = |_| match random.unit() {
        chance if chance < 0.05 => Cell::Missing,
        chance if chance < 0.10 => Cell::Flat,
        _ => Cell::Full,
    };
    let mut column = |_| (100.0, (0..rows).map(&mut cell).collect());
    (0..count).map(&mut column).collect()
}

#[test]
fn plain_pages_are_read_up_to_four_degrees() {
    for degrees in -4..=4 {
        let mut random = SplitMix(7);
        let columns = plain_columns(9, 20, &mut random);
        let page = Page::new(&columns, f64::from(degrees), &mut random);
        page.check(&format!("{degrees} degrees"));
    }
}

#[test]
fn ragged_columns_count_their_own_rows() {
    for degrees in [-3.0, 0.0, 2.5] {
        let mut random = SplitMix(8);
        let mut columns = plain_columns(8, 14, &mut random);
        for (k, (top, cells)) in columns.iter_mut().enumerate() {
            *top += 57.0 * (k % 4) as f64;
            cells.truncate(14 - (5 * k) % 9);
        }
        Page::new(&columns, degrees, &mut random).check(&format!("{degrees} degrees"));
    }
}

#[test]
fn notes_share_the_rows_of_their_column() {
    use Cell::{Flat, Full, HalfRow, Missing, Notes, RightNote};
    for degrees in -4..=4 {
        let mut random = SplitMix(9);
        let mut columns = plain_columns(10, 16, &mut random);
        // A run of an odd number of notes ends with a right note.
        columns[2].1 = vec![
            Full, Full, Notes, Notes, Notes, RightNote, Full, Flat, Notes, Notes, Full, Full,
        ];
        // Notes alone, between and beside other columns.
        columns[4].1 = vec![Notes; 30];
        columns[9].1 = vec![Notes; 28];
        columns[6].1 = vec![Full, Notes, HalfRow, Missing, Notes, RightNote, Full, Full];
        let page = Page::new(&columns, f64::from(degrees), &mut random);
        page.check(&format!("{degrees} degrees"));
    }
}

#[test]
fn pages_with_more_notes_than_characters_are_read() {
    use Cell::{Full, Notes};
    let mut random = SplitMix(10);
    let column = |k: usize| {
        let mut cells = vec![Full; 3 + k % 3];
        cells.extend(vec![Notes; 24 - 2 * (k % 3)]);
        (90.0, cells)
    };
    let columns: Vec<_> = (0..9).map(column).collect();
    for degrees in [-2.0, 0.0, 3.0] {
        Page::new(&columns, degrees, &mut random).check(&format!("{degrees} degrees"));
    }
}

#[test]
fn a_page_of_almost_only_notes_keeps_them_together() {
    use Cell::{Full, Notes};
    let mut random = SplitMix(11);
    let column = |k: usize| {
        let first = if k.is_multiple_of(2) {
            vec![Full]
        } else {
            vec![]
        };
        (90.0, [first, vec![Notes; 30]].concat())
    };
    let columns: Vec<_> = (0..10).map(column).collect();
    Page::new(&columns, 1.5, &mut random).check("five characters among 600 notes");
}

#[test]
fn a_title_does_not_make_notes_of_characters() {
    let mut random = SplitMix(12);
    let mut page = Page::new(&plain_columns(8, 16, &mut random), 0.0, &mut random);
    for (_, name) in &mut page.boxes {
        name.column += 1;
    }
    for k in 0..5 {
        let y = 100.0 + 230.0 * f64::from(k);
        let name = BoxName {
            column: 1,
            row: k + 1,
            part: None,
        };
        page.boxes.push(([3100.0, y, 3300.0, y + 200.0], name));
    }
    page.check("a title of twice the size");
}

#[test]
fn leaning_and_bent_columns_are_straightened() {
    for (k, (keystone, bow)) in [(50.0, 0.0), (-50.0, 0.0), (0.0, 45.0), (40.0, -35.0)]
        .into_iter()
        .enumerate()
    {
        for degrees in [-3.0, 0.0, 2.0] {
            let mut random = SplitMix(13 + k as u64);
            let columns = plain_columns(10, 20, &mut random);
            let bend = DrawnBend {
                degrees,
                keystone,
                bow,
            };
            Page::new(&columns, bend, &mut random).check(&format!("{bend:?}"));
        }
    }
}

#[test]
fn bent_pages_with_notes_are_straightened() {
    use Cell::{Full, Notes};
    for seed in 0..12 {
        let mut random = SplitMix(40 + seed);
        let mut columns = plain_columns(10, 20, &mut random);
        for (_, cells) in &mut columns {
            let first = 12.0 * random.unit();
            let notes = [vec![Full; first as usize], vec![Notes; 8], vec![Full; 4]].concat();
            if random.unit() < 0.6 {
                *cells = notes;
            }
        }
        let bend = DrawnBend {
            degrees: -3.0,
            keystone: 45.0,
            bow: 45.0,
        };
        Page::new(&columns, bend, &mut random).check(&format!("seed {seed}"));
    }
}

#[test]
fn many_boxes_far_apart_are_named() {
    let mut random = SplitMix(20);
    let mut edge = || 1e9 * random.unit();
    let boxes: Vec<[f64; 4]> = (0..30_000)
        .map(|k| {
            let ([x, y], size) = ([edge(), edge()], if k % 2 == 0 { 10.0 } else { 4.0 });
            [x, y, x + size, y + size]
        })
        .collect();
    let names: BTreeSet<BoxName> = reading_order(&boxes).into_iter().collect();
    assert_eq!(names.len(), boxes.len());
}

#[test]
fn a_small_character_alone_has_no_letter() {
    let column = |x: f64| [0.0, 100.0, 200.0, 300.0].map(|y| [x, y, x + 90.0, y + 90.0]);
    let mut boxes = [column(0.0), column(120.0)].concat();
    boxes[1] = [50.0, 110.0, 88.0, 145.0];
    let names: Vec<String> = reading_order(&boxes)
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(names[..4], ["c02-r01", "c02-r02", "c02-r03", "c02-r04"]);
}

#[test]
fn few_boxes_are_not_turned() {
    let names = reading_order(&[[0.0, 0.0, 10.0, 10.0], [7.0, 100.0, 17.0, 110.0]]);
    let shown: Vec<String> = names.iter().map(ToString::to_string).collect();
    assert_eq!(shown, ["c02-r01", "c01-r01"]);
    assert_eq!(reading_order(&[]), []);
}

proptest! {
    #[test]
    fn names_of_any_boxes_differ(
        near in proptest::collection::vec([0.0..50.0, 0.0..50.0, 0.0..50.0, 0.0..50.0_f64], 0..60),
        wild in proptest::collection::vec(proptest::array::uniform4(proptest::num::f64::ANY), 0..9),
    ) {
        let boxes = [near, wild].concat();
        let names = reading_order(&boxes);
        prop_assert_eq!(names.len(), boxes.len());
        let shown: BTreeSet<String> = names.iter().map(ToString::to_string).collect();
        prop_assert_eq!(shown.len(), boxes.len());
        let columns: BTreeSet<u32> = names.iter().map(|name| name.column).collect();
        prop_assert!(columns.iter().copied().eq(1..=columns.len() as u32));
    }

    #[test]
    fn the_unit_does_not_matter(seed in 0..1000_u64, scale in 1e-3..1e3_f64) {
        let mut random = SplitMix(seed);
        let columns = plain_columns(6, 9, &mut random);
        let page = Page::new(&columns, 0.0, &mut random);
        let bounds: Vec<[f64; 4]> = page.boxes.iter().map(|(bounds, _)| *bounds).collect();
        let scaled: Vec<[f64; 4]> = bounds.iter().map(|edges| edges.map(|e| e * scale)).collect();
        prop_assert_eq!(reading_order(&bounds), reading_order(&scaled));
    }
}
