//! Connected parts of the strokes: each is assigned to the room that holds most of it.

use super::layout::{CELL, Layout};
use super::text_image::{PIXEL_MM, TextImage};
use mocban_core::raster::Grid;
use mocban_core::raster::components::ConnectedComponents;

/// Parts of which at least this fraction lies in a second place are divided between the places.
const SHARED: f64 = 0.2;
/// Parts below this area are specks, mm^2; parts below the second one if the block does not show them.
const SPECK_MM2: f64 = 0.1;
const LOOSE_SPECK_MM2: f64 = 0.8;
/// Mean relief below the ink of a part that the block shows, of 255.
const SHOWN: f64 = 70.0;

/// Place of a part of the strokes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Speck,
    Of(usize),
    /// Each pixel belongs to the place in which it lies.
    Divided,
}

/// A connected part of the strokes.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedPart {
    pub(super) place: Part,
    /// First column and row of its pixels, and the ones after the last.
    pub(super) bounds: [usize; 4],
    /// Number of pixels.
    pub(super) area: usize,
}

impl PlacedPart {
    /// Returns its left, upper, right and lower edge.
    pub(super) fn edges(&self) -> [f64; 4] {
        self.bounds.map(|edge| edge as f64 - 0.5)
    }

    /// Returns whether its area is at most `thin` pixels for each pixel of its longer side.
    pub(super) fn is_thin(&self, thin: f64) -> bool {
        let [left, top, right, bottom] = self.bounds;
        let longer = (right - left).max(bottom - top);
        self.area as f64 <= thin * longer as f64
    }
}

/// The owner of a cell outside all places.
pub(super) const NO_PLACE: u16 = u16::MAX;

/// Calls `visit` for each run of pixels of one component in one place: component, place, row, first column and the one
/// after the last.
pub(super) fn for_runs(
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
pub(super) fn assign(
    image: &TextImage,
    layout: &Layout,
    components: &ConnectedComponents,
    owners: &Grid<u16>,
) -> Vec<PlacedPart> {
    let mut shares: Vec<PartShares> = Vec::new();
    for_runs(layout, components, owners, |label, owner, y, x0, x1| {
        if shares.len() <= label {
            shares.resize(label + 1, PartShares::default());
        }
        let relief = image.relief.row(y)[x0..x1].iter();
        shares[label].add(
            owner,
            [x0, y, x1, y + 1],
            relief.map(|r| u64::from(*r)).sum(),
        );
    });
    shares.into_iter().map(PartShares::placed).collect()
}

/// Pixels of a part in each place.
#[derive(Clone, Default)]
struct PartShares {
    places: Vec<(u16, usize)>,
    /// Sum of the relief below them.
    relief: u64,
    bounds: [usize; 4],
}

impl PartShares {
    /// Adds a run of pixels with this box.
    fn add(&mut self, owner: u16, run: [usize; 4], relief: u64) {
        let count = run[2] - run[0];
        if self.places.is_empty() {
            self.bounds = run;
        }
        for k in 0..2 {
            self.bounds[k] = self.bounds[k].min(run[k]);
            self.bounds[k + 2] = self.bounds[k + 2].max(run[k + 2]);
        }
        match self.places.iter_mut().find(|(place, _)| *place == owner) {
            Some((_, sum)) => *sum += count,
            None => self.places.push((owner, count)),
        }
        self.relief += relief;
    }

    fn placed(mut self) -> PlacedPart {
        let area: usize = self.places.iter().map(|(_, count)| count).sum();
        let is_shown = self.relief as f64 >= SHOWN * area as f64;
        let least = if is_shown { SPECK_MM2 } else { LOOSE_SPECK_MM2 };
        self.places.retain(|(place, _)| *place != NO_PLACE);
        self.places
            .sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        let place = match self.places[..] {
            _ if area as f64 * PIXEL_MM * PIXEL_MM < least => Part::Speck,
            [] => Part::Speck,
            [_, (_, second), ..] if second as f64 >= SHARED * area as f64 => Part::Divided,
            [(place, _), ..] => Part::Of(usize::from(place)),
        };
        PlacedPart {
            place,
            bounds: self.bounds,
            area,
        }
    }
}
