//! Connected groups of set pixels.

use crate::raster::{Grid, Mask};

/// Groups below this share of a picture are specks; the authors' code has it.
const SPECK_SHARE: f64 = 1.0 / 1200.0;

/// Groups of set pixels that touch along an edge, each with its size.
#[derive(Debug)]
pub(super) struct ConnectedComponents {
    /// Group of each pixel; `u32::MAX` where the mask is not set.
    labels: Grid<u32>,
    sizes: Vec<usize>,
}

impl ConnectedComponents {
    /// Finds the groups of a mask, numbered in the order of their first pixels.
    pub(super) fn label(mask: &Mask) -> Self {
        let (width, height) = (mask.width(), mask.height());
        let mut runs = Vec::new();
        // Where the runs of the row above begin and end among all.
        let mut above = 0..0;
        for y in 0..height {
            let first = runs.len();
            for (begin, end) in runs_of(mask.row(y)) {
                let place = runs.len();
                let run = Run {
                    begin: y * width + begin,
                    end: y * width + end,
                    first: place,
                };
                runs.push(run);
                let ends_before = |k: usize| runs[k].end + width <= run.begin;
                above.start += above.clone().take_while(|k| ends_before(*k)).count();
                for k in above.clone() {
                    if runs[k].begin + width >= run.end {
                        break;
                    }
                    join(&mut runs, place, k);
                }
            }
            above = first..runs.len();
        }
        let mut labels = Grid::new(width, height, u32::MAX);
        let mut sizes: Vec<usize> = Vec::new();
        let mut numbers = Vec::with_capacity(runs.len());
        for k in 0..runs.len() {
            let first = first_of(&mut runs, k);
            if first == k {
                numbers.push(sizes.len() as u32);
                sizes.push(0);
            } else {
                numbers.push(numbers[first]);
            }
            let Run { begin, end, .. } = runs[k];
            sizes[numbers[k] as usize] += end - begin;
            labels.data_mut()[begin..end].fill(numbers[k]);
        }
        Self { labels, sizes }
    }

    /// The pixels whose group has at least this size.
    pub(super) fn with_area_at_least(&self, size: usize) -> Mask {
        self.labels
            .map(|label| *label != u32::MAX && self.sizes[*label as usize] >= size)
    }

    /// The pixels whose group comes within `reach` pixels, along either axis, of one of the other mask.
    pub(super) fn touching(&self, other: &Mask, reach: i64) -> Mask {
        let mut touches = vec![false; self.sizes.len()];
        for y in 0..self.labels.height() {
            for x in 0..self.labels.width() {
                let label = self.labels.at(x, y);
                if label == u32::MAX || touches[label as usize] {
                    continue;
                }
                let (x, y) = (x as i64, y as i64);
                let around = [(reach, 0), (-reach, 0), (0, reach), (0, -reach)];
                touches[label as usize] = around
                    .iter()
                    .any(|(dx, dy)| other.get(x + dx, y + dy).unwrap_or(true));
            }
        }
        self.labels
            .map(|label| *label != u32::MAX && touches[*label as usize])
    }

    /// The pixels whose group reaches the border of the grid.
    pub(super) fn touching_border(&self) -> Mask {
        let (width, height) = (self.labels.width(), self.labels.height());
        let mut reaches = vec![false; self.sizes.len()];
        for y in 0..height {
            for x in 0..width {
                let on_border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
                let label = self.labels.at(x, y);
                if on_border && label != u32::MAX {
                    reaches[label as usize] = true;
                }
            }
        }
        self.labels
            .map(|label| *label != u32::MAX && reaches[*label as usize])
    }
}

/// Set pixels side by side in a row.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// Their first place in the mask, and the one after their last.
    begin: usize,
    end: usize,
    /// An earlier run of the same group, or itself.
    first: usize,
}

/// Begin and end of each run of set pixels of a row.
fn runs_of(row: &[bool]) -> impl Iterator<Item = (usize, usize)> {
    let mut from = 0;
    std::iter::from_fn(move || {
        let begin = from + row[from..].iter().position(|set| *set)?;
        let rest = &row[begin..];
        from = begin + rest.iter().position(|set| !set).unwrap_or(rest.len());
        Some((begin, from))
    })
}

/// The first run of a run's group; the way there is shortened.
fn first_of(runs: &mut [Run], mut k: usize) -> usize {
    while runs[k].first != k {
        runs[k].first = runs[runs[k].first].first;
        k = runs[k].first;
    }
    k
}

/// Makes one group of those of two runs.
fn join(runs: &mut [Run], one: usize, other: usize) {
    let (one, other) = (first_of(runs, one), first_of(runs, other));
    runs[one.max(other)].first = one.min(other);
}

/// The mask without specks for a picture of so many pixels, neither set ones nor holes.
pub(super) fn remove_specks(mask: &Mask, area: usize) -> Mask {
    let size = (area as f64 * SPECK_SHARE).round() as usize;
    let kept = ConnectedComponents::label(mask).with_area_at_least(size);
    let holes = ConnectedComponents::label(&kept.map(|set| !set)).with_area_at_least(size);
    holes.map(|hole| !hole)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{ConnectedComponents, remove_specks};
    use crate::raster::Mask;

    /// The slow obvious twin: the least place that each set pixel can be reached from.
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
        fn groups_are_those_that_flooding_finds(
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
            for (label, first) in found.labels.data().iter().zip(&flooded) {
                let number = first.map_or(u32::MAX, |first| {
                    firsts.binary_search(&first).expect("a first") as u32
                });
                prop_assert_eq!(*label, number);
            }
            for (number, first) in firsts.iter().enumerate() {
                let size = flooded.iter().filter(|other| **other == Some(*first)).count();
                prop_assert_eq!(found.sizes[number], size);
            }
        }
    }

    fn drawn(rows: [&str; 5]) -> Mask {
        Mask::from_fn(6, 5, |x, y| rows[y].as_bytes()[x] == b'#')
    }

    #[test]
    fn specks_and_pinholes_go() {
        let mask = drawn(["#.....", ".####.", ".#.##.", ".####.", ".....#"]);
        let clean = drawn(["......", ".####.", ".####.", ".####.", "......"]);
        assert_eq!(remove_specks(&mask, 2400), clean);
    }

    #[test]
    fn groups_at_the_border_are_told() {
        let mask = drawn(["##....", "#.....", "..##..", "..##..", "......"]);
        assert_eq!(
            ConnectedComponents::label(&mask).touching_border().count(),
            3
        );
    }
}
