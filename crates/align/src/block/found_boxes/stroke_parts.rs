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
