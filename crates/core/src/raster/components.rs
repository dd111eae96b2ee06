//! Connected components of a mask, labelled by runs with union-find (4-connectivity).

use super::{Grid, Mask, PixelBox};
use crate::domain::cancel::{poll, polled};

/// Components smaller than this share of an image are specks. The value is from the program of the paper's authors.
const SPECK_SHARE: f64 = 1.0 / 1200.0;

/// Components of pixels connected by edges, with their areas.
#[derive(Debug)]
pub struct ConnectedComponents {
    /// Component of each pixel; `u32::MAX` where the mask is not set.
    labels: Grid<u32>,
    sizes: Vec<usize>,
}

impl ConnectedComponents {
    /// Labels the components of a mask in the order of their first pixels.
    pub fn label(mask: &Mask) -> Self {
        let (width, height) = (mask.width(), mask.height());
        let mut runs = Vec::new();
        // Runs of the row above, a range of `runs`.
        let mut above = 0..0;
        for y in 0..height {
            poll();
            let row_start = runs.len();
            for (begin, end) in row_runs(mask.row(y)) {
                let place = runs.len();
                let run = Run {
                    begin: y * width + begin,
                    end: y * width + end,
                    root: place,
                };
                runs.push(run);
                let ends_before = |k: usize| runs[k].end + width <= run.begin;
                above.start += above.clone().take_while(|k| ends_before(*k)).count();
                for k in above.clone() {
                    if runs[k].begin + width >= run.end {
                        break;
                    }
                    union(&mut runs, place, k);
                }
            }
            above = row_start..runs.len();
        }
        let mut labels = Grid::new(width, height, u32::MAX);
        let mut sizes: Vec<usize> = Vec::new();
        let mut numbers = Vec::with_capacity(runs.len());
        for k in polled(0..runs.len()) {
            let root = find_root(&mut runs, k);
            if root == k {
                numbers.push(sizes.len() as u32);
                sizes.push(0);
            } else {
                numbers.push(numbers[root]);
            }
            let Run { begin, end, .. } = runs[k];
            sizes[numbers[k] as usize] += end - begin;
            labels.data_mut()[begin..end].fill(numbers[k]);
        }
        Self { labels, sizes }
    }

    /// Returns the largest component; the first one of several that are equally large. Returns `None` if there is none.
    pub fn largest(&self) -> Option<Mask> {
        let size = *self.sizes.iter().max()?;
        let largest = self.sizes.iter().position(|other| *other == size)? as u32;
        Some(self.labels.map(|label| *label == largest))
    }

    /// Returns the pixels of components of at least this area that share a pixel with a mask.
    pub fn meeting(&self, mask: &Mask, area: usize) -> Mask {
        let mut meets = vec![false; self.sizes.len()];
        for (label, set) in self.labels.data().iter().zip(mask.data()) {
            if *set && *label != u32::MAX {
                meets[*label as usize] = true;
            }
        }
        self.select(|label| meets[label] && self.sizes[label] >= area)
    }

    /// Returns the pixels of components of at least this area, in pixels.
    pub(crate) fn with_area_at_least(&self, size: usize) -> Mask {
        self.select(|label| self.sizes[label] >= size)
    }

    /// Returns the component of a pixel, or `None` if the mask is not set there.
    pub fn label_at(&self, x: usize, y: usize) -> Option<usize> {
        let label = self.labels.at(x, y);
        (label != u32::MAX).then_some(label as usize)
    }

    /// Returns the bounding box and the number of the pixels of `mask` in each component. Every component must contain
    /// such a pixel.
    pub fn parts_of(&self, mask: &Mask) -> Vec<(PixelBox, usize)> {
        let mut parts: Vec<Option<(PixelBox, usize)>> = vec![None; self.sizes.len()];
        for y in 0..mask.height() {
            poll();
            for (x, is_set) in mask.row(y).iter().enumerate() {
                if let Some(label) = is_set.then(|| self.label_at(x, y)).flatten() {
                    let pixel = PixelBox {
                        x0: x,
                        y0: y,
                        x1: x,
                        y1: y,
                    };
                    let part = &mut parts[label];
                    *part = Some(
                        part.map_or((pixel, 1), |(bounds, area)| (bounds.union(pixel), area + 1)),
                    );
                }
            }
        }
        parts.into_iter().flatten().collect()
    }

    /// Returns the pixels of the components for which `wanted` is true.
    fn select(&self, wanted: impl Fn(usize) -> bool) -> Mask {
        self.labels
            .map(|label| *label != u32::MAX && wanted(*label as usize))
    }

    /// Returns the pixels of all components near `other` or the border. A component is near if a step of `distance`
    /// pixels along an axis leads from one of its pixels into `other` or out of the grid.
    pub fn touching(&self, other: &Mask, distance: i64) -> Mask {
        let touches = self.touches(other, distance);
        self.select(|label| touches[label])
    }

    /// Returns the area of the largest component that is not near `other` or the border, as in [`Self::touching`].
    pub fn largest_apart_from(&self, other: &Mask, distance: i64) -> usize {
        let touches = self.touches(other, distance);
        let apart = self.sizes.iter().zip(touches).filter(|(_, near)| !near);
        apart.map(|(size, _)| *size).max().unwrap_or(0)
    }

    /// Returns the pixels and the number of the components of at least `size` pixels that are not near `other` or the
    /// border, as in [`Self::touching`].
    pub fn apart_from(&self, other: &Mask, distance: i64, size: usize) -> (Mask, usize) {
        let touches = self.touches(other, distance);
        let wanted = |label: usize| self.sizes[label] >= size && !touches[label];
        let count = (0..self.sizes.len()).filter(|label| wanted(*label)).count();
        (self.select(wanted), count)
    }

    /// Returns for each component whether it is near `other` or the border.
    fn touches(&self, other: &Mask, distance: i64) -> Vec<bool> {
        let mut touches = vec![false; self.sizes.len()];
        for y in 0..self.labels.height() {
            poll();
            for x in 0..self.labels.width() {
                let label = self.labels.at(x, y);
                if label == u32::MAX || touches[label as usize] {
                    continue;
                }
                let (x, y) = (x as i64, y as i64);
                let around = [(distance, 0), (-distance, 0), (0, distance), (0, -distance)];
                touches[label as usize] = around
                    .iter()
                    .any(|(dx, dy)| other.get(x + dx, y + dy).unwrap_or(true));
            }
        }
        touches
    }

    /// Returns the pixels of components that touch the border of the grid.
    pub fn touching_border(&self) -> Mask {
        let none = Mask::new(self.labels.width(), self.labels.height(), false);
        self.touching(&none, 1)
    }
}

/// A run of set pixels of a row.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// Index of the first pixel, and of the one after the last.
    begin: usize,
    end: usize,
    /// An earlier run of the same component, or itself.
    root: usize,
}

/// Returns begin and end of each run of set pixels of a row.
fn row_runs(row: &[bool]) -> impl Iterator<Item = (usize, usize)> {
    let mut from = 0;
    std::iter::from_fn(move || {
        let begin = from + row[from..].iter().position(|set| *set)?;
        let rest = &row[begin..];
        from = begin + rest.iter().position(|set| !set).unwrap_or(rest.len());
        Some((begin, from))
    })
}

/// Returns the first run of the component of run `k`, with path halving.
fn find_root(runs: &mut [Run], mut k: usize) -> usize {
    while runs[k].root != k {
        runs[k].root = runs[runs[k].root].root;
        k = runs[k].root;
    }
    k
}

/// Merges the components of two runs.
fn union(runs: &mut [Run], one: usize, other: usize) {
    let (one, other) = (find_root(runs, one), find_root(runs, other));
    runs[one.max(other)].root = one.min(other);
}

/// Removes specks and fills pinholes that are smaller than `SPECK_SHARE` of `area`, a number of pixels.
pub fn remove_specks(mask: &Mask, area: usize) -> Mask {
    let size = (area as f64 * SPECK_SHARE).round() as usize;
    let kept = ConnectedComponents::label(mask).with_area_at_least(size);
    let holes = ConnectedComponents::label(&kept.map(|set| !set)).with_area_at_least(size);
    holes.map(|hole| !hole)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{ConnectedComponents, remove_specks};
    use crate::raster::{Mask, PixelBox};

    /// Reference implementation: returns for each set pixel the lowest index of a connected pixel.
    fn flooded(mask: &Mask) -> Vec<Option<usize>> {
        let (width, places) = (mask.width(), 0..mask.data().len());
        let mut least: Vec<Option<usize>> = places
            .clone()
            .map(|k| mask.data()[k].then_some(k))
            .collect();
        loop {
            let before = least.clone();
            for k in places.clone() {
                let beside = [(k % width > 0).then(|| k - 1), k.checked_sub(width)];
                for other in beside.into_iter().flatten() {
                    if let (Some(a), Some(b)) = (least[k], least[other]) {
                        (least[k], least[other]) = (Some(a.min(b)), Some(a.min(b)));
                    }
                }
            }
            if least == before {
                return least;
            }
        }
    }

    proptest! {
        #[test]
        fn components_equal_those_of_flood_fill(
            width in 1_usize..24,
            bits in prop::collection::vec(prop::bool::weighted(0.6), 1..400),
        ) {
            let height = bits.len() / width;
            let mask = Mask::from_fn(width, height, |x, y| bits[y * width + x]);
            let found = ConnectedComponents::label(&mask);
            let flooded = flooded(&mask);
            let mut firsts: Vec<usize> = flooded.iter().copied().flatten().collect();
            firsts.sort_unstable();
            firsts.dedup();
            prop_assert_eq!(found.sizes.len(), firsts.len());
            for (label, root) in found.labels.data().iter().zip(&flooded) {
                let number = root.map_or(u32::MAX, |root| {
                    firsts.binary_search(&root).expect("a root") as u32
                });
                prop_assert_eq!(*label, number);
            }
            for (number, root) in firsts.iter().enumerate() {
                let size = flooded.iter().filter(|other| **other == Some(*root)).count();
                prop_assert_eq!(found.sizes[number], size);
            }
        }
    }

    fn drawn(rows: [&str; 5]) -> Mask {
        Mask::from_fn(6, 5, |x, y| rows[y].as_bytes()[x] == b'#')
    }

    #[test]
    fn parts_of_a_mask_are_measured_in_each_component() {
        let joined = drawn(["####..", "......", "....##", "....##", "......"]);
        let mask = drawn(["#..#..", "......", ".....#", "......", "......"]);
        let found = ConnectedComponents::label(&joined);
        let parts = found.parts_of(&mask);
        let pixel = |x: usize, y: usize| PixelBox {
            x0: x,
            y0: y,
            x1: x,
            y1: y,
        };
        assert_eq!(
            parts,
            [(pixel(0, 0).union(pixel(3, 0)), 2), (pixel(5, 2), 1)]
        );
        assert_eq!(
            [(3, 0), (4, 0), (4, 3)].map(|(x, y)| found.label_at(x, y)),
            [Some(0), None, Some(1)]
        );
    }

    #[test]
    fn specks_and_pinholes_are_removed() {
        let mask = drawn(["#.....", ".####.", ".#.##.", ".####.", ".....#"]);
        let clean = drawn(["......", ".####.", ".####.", ".####.", "......"]);
        assert_eq!(remove_specks(&mask, 2400), clean);
    }

    #[test]
    fn largest_component_apart_from_the_border_is_measured() {
        let mask = drawn(["###...", "......", "..##.#", "......", ".#...."]);
        let none = Mask::new(6, 5, false);
        let found = ConnectedComponents::label(&mask);
        assert_eq!(found.largest_apart_from(&none, 1), 2);
        let beside = drawn(["......", "...#..", "......", "......", "......"]);
        assert_eq!(found.largest_apart_from(&beside, 1), 0);
    }

    #[test]
    fn components_at_the_border_are_found() {
        let mask = drawn(["##....", "#.....", "..##..", "..##..", "......"]);
        assert_eq!(
            ConnectedComponents::label(&mask).touching_border().count(),
            3
        );
    }
}
