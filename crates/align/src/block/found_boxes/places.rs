//! Strokes of each character: connected parts are assigned to the row that holds most of them.

use super::columns::Columns;
use super::layout::{CELL, Layout};
use super::rows::{FoundRow, RowKind};
use super::text_image::{PIXEL_MM, TextImage, Trust, add, correlation};
use crate::block::page_map::PageMap;
use mocban_core::raster::Grid;
use mocban_core::raster::components::ConnectedComponents;

/// Parts of which at least this fraction lies in a second place are divided between the places.
const SHARED: f64 = 0.2;
/// Parts below this area are specks, mm^2; parts below the second one if the block does not show them.
const SPECK_MM2: f64 = 0.1;
const LOOSE_SPECK_MM2: f64 = 0.8;
/// Mean relief below the ink of a part that the block shows, of 255.
const SHOWN: f64 = 70.0;

/// Least fraction of the relief of a character that is printed, or least correlation of relief and ink.
const MIN_PRINTED: f64 = 0.5;
const MIN_LIKENESS: f64 = 0.3;

/// Half of a row of notes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Half {
    Left,
    Right,
}

/// Room for one character.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CharacterPlace {
    /// Index of the column from the left and of the row from the top.
    pub(super) column: usize,
    pub(super) row: usize,
    pub(super) half: Option<Half>,
    /// First column and row of cells, and the ones after the last.
    pub(super) room: [usize; 4],
}

/// The strokes in a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Strokes {
    /// Number of pixels.
    pub(super) area: usize,
    /// Left, top, right and bottom edge in the frame, pixels.
    pub(super) bounds: [f64; 4],
    /// The same on the page, pixels of the page.
    pub(super) page_bounds: [f64; 4],
    /// Sum of the relief below the strokes, 0..=255.
    pub(super) relief: u64,
    /// Number of pixels where only the relief shows the text.
    pub(super) only_relief: usize,
    /// Fraction of the relief in the place that is printed.
    pub(super) printed: f64,
    /// Correlation of relief and ink in the place.
    pub(super) likeness: f64,
}

impl Strokes {
    const EMPTY: Self = Self {
        area: 0,
        bounds: [
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        ],
        page_bounds: [
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        ],
        relief: 0,
        only_relief: 0,
        printed: 0.0,
        likeness: 0.0,
    };

    /// Returns the area in mm^2.
    pub(super) fn area_mm2(&self) -> f64 {
        self.area as f64 * PIXEL_MM * PIXEL_MM
    }

    /// Returns the fraction of the text that only the relief shows, because the page does not show the place.
    pub(super) fn unseen(&self) -> f64 {
        self.only_relief as f64 / self.area.max(1) as f64
    }

    /// Returns whether the page shows the relief of the place. Thin strokes never cover it, because it is a little wider
    /// than they were carved, but lie where it is high.
    pub(super) fn is_printed(&self) -> bool {
        self.printed >= MIN_PRINTED || self.likeness >= MIN_LIKENESS
    }

    /// Returns width and height in mm.
    pub(super) fn size_mm(&self) -> [f64; 2] {
        [0, 1].map(|k: usize| (self.bounds[k + 2] - self.bounds[k]) * PIXEL_MM)
    }

    /// Returns the mean relief below the strokes, 0..=1.
    pub(super) fn support(&self) -> f64 {
        self.relief as f64 / (255 * self.area.max(1)) as f64
    }
}

/// Returns the places of all columns and rows.
pub(super) fn places(columns: &Columns, rows: &[Vec<FoundRow>]) -> Vec<CharacterPlace> {
    let mut places = Vec::new();
    for (column, (across, rows)) in columns.all.iter().zip(rows).enumerate() {
        let [left, right] = across.across;
        for (row, found) in rows.iter().enumerate() {
            let [top, bottom] = found.along;
            let mut add = |half: Option<Half>, left: usize, right: usize| {
                places.push(CharacterPlace {
                    column,
                    row,
                    half,
                    room: [left, top, right, bottom],
                });
            };
            match found.kind {
                RowKind::Character => add(None, left, right),
                RowKind::Notes { middle } => {
                    add(Some(Half::Right), middle, right);
                    add(Some(Half::Left), left, middle);
                }
            }
        }
    }
    places
}

/// An affine map from pixels of the frame to pixels of the page.
struct LocalMap {
    centre: [f64; 2],
    page: [f64; 2],
    along: [[f64; 2]; 2],
}

impl LocalMap {
    fn at(image: &TextImage, map: &PageMap, centre: [f64; 2]) -> Self {
        let page = |x: f64, y: f64| map.page_from_face(image.frame.face_from_pixel([x, y]));
        let reach = 10.0;
        let [x, y] = centre;
        let slope = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|k: usize| (b[k] - a[k]) / (2.0 * reach));
        Self {
            centre,
            page: page(x, y),
            along: [
                slope(page(x - reach, y), page(x + reach, y)),
                slope(page(x, y - reach), page(x, y + reach)),
            ],
        }
    }

    fn page(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        [0, 1].map(|k: usize| self.page[k] + dx * self.along[0][k] + dy * self.along[1][k])
    }
}

/// Place of a part of the strokes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Speck,
    Of(usize),
    /// Each pixel belongs to the place in which it lies.
    Divided,
}

const NO_PLACE: u16 = u16::MAX;

/// Measures the strokes of each place.
pub(super) fn measure(
    image: &TextImage,
    layout: &Layout,
    map: &PageMap,
    places: &[CharacterPlace],
) -> Vec<Strokes> {
    let (width, height) = (layout.cells.width(), layout.cells.height());
    let mut owners = Grid::new(width + 1, height + 1, NO_PLACE);
    for (number, place) in places.iter().enumerate() {
        let [left, top, right, bottom] = place.room;
        for y in top..bottom {
            let row = y * (width + 1);
            owners.data_mut()[row + left..row + right].fill(number as u16);
        }
    }
    let components = ConnectedComponents::label(&layout.rules.text);
    let parts = assign(image, layout, &components, &owners);
    let local: Vec<LocalMap> = places
        .iter()
        .map(|place| {
            let middle =
                |k: usize| (place.room[k] + place.room[k + 2]) as f64 / 2.0 * CELL as f64 - 0.5;
            LocalMap::at(image, map, [middle(0), middle(1)])
        })
        .collect();
    let mut strokes = vec![Strokes::EMPTY; places.len()];
    for_runs(layout, &components, &owners, |label, owner, y, x0, x1| {
        let number = match parts[label] {
            Part::Speck => return,
            Part::Of(number) => number,
            Part::Divided if owner == NO_PLACE => return,
            Part::Divided => usize::from(owner),
        };
        let found = &mut strokes[number];
        found.area += x1 - x0;
        let relief = &image.relief.row(y)[x0..x1];
        found.relief += relief.iter().map(|r| u64::from(*r)).sum::<u64>();
        if image.trust_at(x0, y) == Trust::Relief {
            found.only_relief += x1 - x0;
        }
        let edges = [
            x0 as f64 - 0.5,
            y as f64 - 0.5,
            x1 as f64 - 0.5,
            y as f64 + 0.5,
        ];
        extend(&mut found.bounds, [edges[0], edges[1]]);
        extend(&mut found.bounds, [edges[2], edges[3]]);
        for corner in [[0, 1], [2, 1], [2, 3], [0, 3]] {
            extend(
                &mut found.page_bounds,
                local[number].page(corner.map(|k| edges[k])),
            );
        }
    });
    for (found, place) in strokes.iter_mut().zip(places) {
        (found.printed, found.likeness) = printed(image, layout, place);
    }
    strokes
}

/// Returns the fraction of the relief in a place that is printed, 1 if there is none, and the correlation of both.
fn printed(image: &TextImage, layout: &Layout, place: &CharacterPlace) -> (f64, f64) {
    let [left, top, right, bottom] = place.room;
    let (mut all, mut printed) = (1.0, 1.0);
    let mut sums = [0.0; 6];
    for y in top * CELL..bottom * CELL {
        for x in left..right {
            let pixels = x * CELL..(x + 1) * CELL;
            let relief = &image.relief.row(y)[pixels.clone()];
            let ink = &image.ink.row(y)[pixels];
            add(&mut sums, relief, ink);
            // Rules are no part of the character.
            if layout.cells.at(x, y / CELL) > 0.0 {
                for (relief, ink) in relief.iter().zip(ink) {
                    all += f64::from(*relief);
                    printed += f64::from(*relief) * f64::from(*ink) / 255.0;
                }
            }
        }
    }
    (printed / all, correlation(&sums))
}

fn extend(bounds: &mut [f64; 4], [x, y]: [f64; 2]) {
    bounds[0] = bounds[0].min(x);
    bounds[1] = bounds[1].min(y);
    bounds[2] = bounds[2].max(x);
    bounds[3] = bounds[3].max(y);
}

/// Calls `visit` for each run of pixels of one component in one place: component, place, row, first column and the one
/// after the last.
fn for_runs(
    layout: &Layout,
    components: &ConnectedComponents,
    owners: &Grid<u16>,
    mut visit: impl FnMut(usize, u16, usize, usize, usize),
) {
    for y in 0..layout.rules.text.height() {
        let row = layout.rules.text.row(y);
        let owners = owners.row(y / CELL);
        let mut x = 0;
        while let Some(gap) = row[x..].iter().position(|set| *set) {
            let begin = x + gap;
            let owner = owners[begin / CELL];
            let mut end = begin + 1;
            while end < row.len() && row[end] && owners[end / CELL] == owner {
                end += 1;
            }
            if let Some(label) = components.label_at(begin, y) {
                visit(label, owner, y, begin, end);
            }
            x = end;
        }
    }
}

/// Assigns each part to the place that holds most of it.
fn assign(
    image: &TextImage,
    layout: &Layout,
    components: &ConnectedComponents,
    owners: &Grid<u16>,
) -> Vec<Part> {
    // Pixels of each part in each place, and the sum of the relief below them.
    let mut shares: Vec<(Vec<(u16, usize)>, u64)> = Vec::new();
    for_runs(layout, components, owners, |label, owner, y, x0, x1| {
        if shares.len() <= label {
            shares.resize(label + 1, (Vec::new(), 0));
        }
        let (places, relief) = &mut shares[label];
        match places.iter_mut().find(|(place, _)| *place == owner) {
            Some((_, count)) => *count += x1 - x0,
            None => places.push((owner, x1 - x0)),
        }
        *relief += image.relief.row(y)[x0..x1]
            .iter()
            .map(|r| u64::from(*r))
            .sum::<u64>();
    });
    let pixel = PIXEL_MM * PIXEL_MM;
    shares
        .into_iter()
        .map(|(mut places, relief)| {
            let area: usize = places.iter().map(|(_, count)| count).sum();
            let is_shown = relief as f64 >= SHOWN * area as f64;
            let least = if is_shown { SPECK_MM2 } else { LOOSE_SPECK_MM2 };
            if (area as f64) * pixel < least {
                return Part::Speck;
            }
            places.retain(|(place, _)| *place != NO_PLACE);
            places.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            match places[..] {
                [] => Part::Speck,
                [_, (_, second), ..] if second as f64 >= SHARED * area as f64 => Part::Divided,
                [(place, _), ..] => Part::Of(usize::from(place)),
            }
        })
        .collect()
}
