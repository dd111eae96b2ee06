//! Finds the parts of a print that may be a character, for a print that shows neighbouring characters too.
//!
//! Ink that lies close together belongs to one character. How close depends on the print, so ink is joined over growing
//! gaps. A character is a group of ink that stays the same over many gaps. If characters touch, no gap separates them:
//! windows around the middle of the ink are candidates too.

use std::collections::BTreeMap;

use mocban_core::domain::PrintOutline;
use mocban_core::domain::cancel::poll;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Mask, PixelBox};

/// Number of cells along the longest side of the ink.
const CELLS: usize = 160;
/// Number of gap widths over which ink is joined. At step `k`, counted from 0, ink is grown by `k` cells on all sides,
/// which closes gaps of up to `2 k` cells.
const STEPS: usize = 24;
/// Smallest and largest size of a group, as fractions of the longest side of the ink. A character with a neighbour
/// takes up about half at most.
const SIZES: [f64; 2] = [0.1, 0.58];
/// Smallest width and height of a part in pixels.
const LEAST_PX: f64 = 24.0;
/// Largest number of groups that are tried.
const MOST: usize = 16;
/// Margin around the ink of a group, as a fraction of the longest side of the group.
const MARGIN: f64 = 0.07;
/// Sizes of the windows around the middle of the ink, as fractions of the ink's width and height.
const MIDDLE: [f64; 2] = [0.4, 0.5];

/// A group of ink. `bounds` is its box in cells. `steps` is the number of gap widths at which a group has the same box
/// and area.
#[derive(Debug, Clone, Copy)]
struct Group {
    bounds: PixelBox,
    steps: usize,
    /// Index of the first of these gap widths, and the component's label at this width.
    found: [usize; 2],
}

/// Returns outlines, in pixels, of the parts that may be a character: first the groups of ink, the nearest to the
/// middle first, then the windows around the middle.
pub(super) fn print_parts(ink: &Mask) -> Vec<PrintOutline> {
    let Some(bounds) = ink.bounding_box() else {
        return Vec::new();
    };
    let cell = (bounds.longest_side() as f64 / CELLS as f64).max(1.0);
    let cells = cells(ink, bounds, cell);
    let origin = [bounds.x0 as f64, bounds.y0 as f64];
    let mut joined = Vec::new();
    let mut grown = cells.clone();
    for _ in 0..STEPS {
        joined.push(ConnectedComponents::label(&grown));
        grown = grown.dilate();
    }
    let of_group = |group: &Group| {
        let [step, label] = group.found;
        let mut corners = Vec::new();
        let margin = MARGIN * group.bounds.longest_side() as f64;
        for y in group.bounds.y0..=group.bounds.y1 {
            for x in group.bounds.x0..=group.bounds.x1 {
                if cells.at(x, y) && joined[step].label_at(x, y) == Some(label) {
                    let corner = |dx: f64, dy: f64| {
                        [
                            origin[0] + (x as f64 + dx) * cell,
                            origin[1] + (y as f64 + dy) * cell,
                        ]
                    };
                    let (low, high) = (-margin, 1.0 + margin);
                    corners.extend([
                        corner(low, low),
                        corner(high, low),
                        corner(low, high),
                        corner(high, high),
                    ]);
                }
            }
        }
        PrintOutline::around(&corners)
    };
    let groups = groups(&cells, &joined);
    let mut parts: Vec<PrintOutline> = groups.iter().filter_map(of_group).collect();
    parts.extend(
        MIDDLE
            .map(|share| window(bounds, share))
            .into_iter()
            .flatten(),
    );
    parts.retain(|part| {
        let [low, high] = part.bounds();
        high[0] - low[0] >= LEAST_PX && high[1] - low[1] >= LEAST_PX
    });
    parts
}

/// Returns the cells that contain ink.
fn cells(ink: &Mask, bounds: PixelBox, cell: f64) -> Mask {
    let count = |side: usize| (side as f64 / cell).ceil() as usize;
    let mut cells = Mask::new(count(bounds.width()), count(bounds.height()), false);
    for y in bounds.y0..=bounds.y1 {
        poll();
        for (x, is_ink) in ink.row(y)[bounds.x0..=bounds.x1].iter().enumerate() {
            if *is_ink {
                let at = |k: usize| (k as f64 / cell) as usize;
                cells.set(at(x), at(y - bounds.y0), true);
            }
        }
    }
    cells
}

/// Returns at most [`MOST`] groups of a suitable size, the nearest to the middle first. Prefers groups that stay the
/// same over many gap widths.
fn groups(cells: &Mask, joined: &[ConnectedComponents]) -> Vec<Group> {
    let mut found: BTreeMap<[usize; 5], Group> = BTreeMap::new();
    for (step, components) in joined.iter().enumerate() {
        for (label, (bounds, area)) in components.parts_of(cells).into_iter().enumerate() {
            let key = [bounds.x0, bounds.y0, bounds.x1, bounds.y1, area];
            let new = Group {
                bounds,
                steps: 0,
                found: [step, label],
            };
            found.entry(key).or_insert(new).steps += 1;
        }
    }
    let longest = cells.width().max(cells.height()) as f64;
    let mut groups: Vec<Group> = found
        .into_values()
        .filter(|group| {
            let share = group.bounds.longest_side() as f64 / longest;
            (SIZES[0]..=SIZES[1]).contains(&share)
        })
        .collect();
    groups.sort_by_key(|group| std::cmp::Reverse(group.steps));
    groups.truncate(MOST);
    // The square of twice the distance from the middle.
    let from_middle = |group: &Group| {
        let PixelBox { x0, y0, x1, y1 } = group.bounds;
        let [x, y] = [x0 + x1, y0 + y1];
        x.abs_diff(cells.width() - 1).pow(2) + y.abs_diff(cells.height() - 1).pow(2)
    };
    groups.sort_by_key(from_middle);
    groups
}

/// Returns the window around the middle of a box. `share` is the window's fraction of the box's width and height.
fn window(bounds: PixelBox, share: f64) -> Option<PrintOutline> {
    let inner = |from: usize, to: usize| {
        let (middle, half) = ((from + to) as f64 / 2.0, (to - from) as f64 * share / 2.0);
        [middle - half, middle + half]
    };
    let [left, right] = inner(bounds.x0, bounds.x1);
    let [top, bottom] = inner(bounds.y0, bounds.y1);
    PrintOutline::around(&[[left, top], [right, top], [right, bottom], [left, bottom]])
}

#[cfg(test)]
mod tests {
    use super::print_parts;
    use crate::stages::binarize::inside;
    use mocban_core::domain::PrintOutline;
    use mocban_core::raster::Mask;

    const SIDE: usize = 360;
    /// Distance between the middles of two characters.
    const PITCH: usize = 120;

    /// Returns nine characters. Each has two strokes, one above the other, with a gap of 9 pixels between them. A
    /// character is about `width` pixels wide and high.
    fn grid(width: usize) -> Mask {
        Mask::from_fn(SIDE, SIDE, |x, y| {
            let [x, y] = [x % PITCH, y % PITCH].map(|at| at.abs_diff(PITCH / 2));
            x <= width / 2 && (5..=width / 2).contains(&y)
        })
    }

    /// Returns the fraction of the middle character's ink inside a part, and the fraction of the part's ink that
    /// belongs to other characters.
    fn shares(part: &PrintOutline, ink: &Mask) -> [f64; 2] {
        let inside = inside(part, [SIDE; 2]).zip_map(ink, |inside, ink| inside && ink);
        let middle = Mask::from_fn(SIDE, SIDE, |x, y| {
            x / PITCH == 1 && y / PITCH == 1 && ink.at(x, y)
        });
        let both = inside.zip_map(&middle, |a, b| a && b).count() as f64;
        let [inside, middle] = [inside, middle].map(|mask| mask.count() as f64);
        [both / middle, 1.0 - both / inside]
    }

    #[test]
    fn first_part_of_a_grid_is_the_middle_character() {
        let ink = grid(80);
        let parts = print_parts(&ink);
        assert_eq!(shares(&parts[0], &ink), [1.0, 0.0]);
        let whole = parts.iter().filter(|part| {
            let [low, high] = part.bounds();
            (80.0..100.0).contains(&(high[0] - low[0]))
                && (80.0..100.0).contains(&(high[1] - low[1]))
        });
        assert_eq!(whole.count(), 9);
    }

    #[test]
    fn middle_of_characters_that_touch_is_a_part() {
        let ink = grid(120);
        let parts = print_parts(&ink);
        let is_middle = |part: &PrintOutline| {
            let [covered, others] = shares(part, &ink);
            covered == 1.0 && others < 0.4
        };
        assert!(parts.iter().any(is_middle));
    }

    #[test]
    fn blank_and_tiny_prints_have_no_parts() {
        assert_eq!(print_parts(&Mask::new(50, 40, false)), []);
        let dot = Mask::from_fn(50, 40, |x, y| {
            (20..30).contains(&x) && (10..20).contains(&y)
        });
        assert_eq!(print_parts(&dot), []);
    }
}
