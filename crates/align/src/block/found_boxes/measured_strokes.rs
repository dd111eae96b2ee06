//! Measures the strokes of each character.

use super::layout::{CELL, Layout};
use super::places::{CharacterPlace, Strokes};
use super::stroke_parts::{NO_PLACE, Part, assign, for_runs};
use super::text_image::{PIXEL_MM, TextImage, Trust, add, correlation};
use super::usual_room::{UsualRoom, usual_rooms};
use crate::block::page_map::PageMap;
use mocban_core::raster::Grid;
use mocban_core::raster::components::ConnectedComponents;

/// Least relief of a pixel that the block shows.
const SHOWN_RELIEF: u8 = 64;
/// A mark lies on a character if strokes of a larger area are beyond its usual room and the block does not show them, mm^2.
const FOREIGN_MM2: f64 = 0.5;

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

/// Measures the strokes of each place. `pitch` is the distance of two columns in cells.
pub(super) fn measure(
    image: &TextImage,
    layout: &Layout,
    map: &PageMap,
    places: &[CharacterPlace],
    pitch: f64,
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
    let collect = |rooms: &[UsualRoom]| {
        let mut strokes = vec![Strokes::EMPTY; places.len()];
        // The strokes that the block shows within the usual room, and pixels beyond it that the block does not show.
        let mut shown = strokes.clone();
        let mut foreign = vec![0; places.len()];
        for_runs(layout, &components, &owners, |label, owner, y, x0, x1| {
            let part = &parts[label];
            let number = match part.place {
                Part::Speck => return,
                Part::Of(number) => number,
                Part::Divided if owner == NO_PLACE => return,
                Part::Divided => usize::from(owner),
            };
            let room = &rooms[number];
            if room.excludes(part) {
                return;
            }
            add_run(&mut strokes[number], image, &local[number], (y, x0, x1));
            let relief = image.relief.row(y);
            let is_inside = |x: &usize| usize::from(owner) == number && room.holds(*x);
            let is_shown = |x: &usize| relief[*x] >= SHOWN_RELIEF;
            let beyond = (x0..x1).filter(|x| !is_inside(x) && !is_shown(x));
            foreign[number] += beyond.count();
            let mut within = (x0..x1).filter(|x| is_inside(x) && is_shown(x));
            if let Some(first) = within.next() {
                let end = within.next_back().unwrap_or(first) + 1;
                add_run(&mut shown[number], image, &local[number], (y, first, end));
            }
        });
        for ((strokes, shown), foreign) in strokes.iter_mut().zip(shown).zip(foreign) {
            if foreign as f64 * PIXEL_MM * PIXEL_MM > FOREIGN_MM2 && shown.area > 0 {
                *strokes = shown;
            }
        }
        strokes
    };
    let all = collect(&vec![UsualRoom::ANY; places.len()]);
    let mut strokes = collect(&usual_rooms(places, &all, &parts, pitch * CELL as f64));
    for (found, place) in strokes.iter_mut().zip(places) {
        (found.printed, found.likeness) = printed(image, layout, place);
    }
    strokes
}

/// Adds a run of pixels of a row: the row, the first column and the one after the last.
fn add_run(
    found: &mut Strokes,
    image: &TextImage,
    local: &LocalMap,
    (y, x0, x1): (usize, usize, usize),
) {
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
        extend(&mut found.page_bounds, local.page(corner.map(|k| edges[k])));
    }
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
