//! Min-max pyramid: bounds of the values in any box of a grid in constant time.

use super::Grid;
use crate::domain::cancel::poll;

/// Side of the finest cells, in pixels. It doubles at each level.
const FINEST_CELL_PX: usize = 4;

/// Cells of several sizes with the lowest and highest value in each.
pub(super) struct MinMaxPyramid<T> {
    levels: Vec<Grid<[T; 2]>>,
    size: [usize; 2],
}

impl<T: Copy + Ord> MinMaxPyramid<T> {
    pub(super) fn new(values: &Grid<T>) -> Self {
        let size = [values.width(), values.height()];
        let [across, down] = size.map(|side| side.div_ceil(FINEST_CELL_PX));
        let mut cells = Vec::with_capacity(across * down);
        for y in 0..down {
            poll();
            let last = ((y + 1) * FINEST_CELL_PX).min(size[1]);
            let mut lowest = values.row(y * FINEST_CELL_PX).to_vec();
            let mut highest = lowest.clone();
            for row in y * FINEST_CELL_PX + 1..last {
                let pairs = lowest.iter_mut().zip(&mut highest).zip(values.row(row));
                for ((low, high), value) in pairs {
                    *low = (*low).min(*value);
                    *high = (*high).max(*value);
                }
            }
            let (lows, highs) = (
                lowest.chunks(FINEST_CELL_PX),
                highest.chunks(FINEST_CELL_PX),
            );
            cells.extend(lows.zip(highs).map(|(low, high)| {
                let low = low.iter().fold(low[0], |a, b| a.min(*b));
                let high = high.iter().fold(high[0], |a, b| a.max(*b));
                [low, high]
            }));
        }
        let mut levels: Vec<Grid<[T; 2]>> =
            Grid::from_vec(across, down, cells).into_iter().collect();
        while let Some(finer) = levels.last()
            && finer.width().max(finer.height()) > 1
        {
            levels.push(halved(finer));
        }
        Self { levels, size }
    }

    /// Returns bounds of the values in a box of pixels `[[x_first, x_last], [y_first, y_last]]`. The bounds may be too
    /// wide, because cells extend beyond the box. They include `outside` if the box extends beyond the grid.
    pub(super) fn range_in_box(&self, [columns, rows]: [[i64; 2]; 2], outside: T) -> [T; 2] {
        let sides = self.size.map(|side| side as i64);
        let is_cut = [columns, rows]
            .iter()
            .zip(sides)
            .any(|([first, last], side)| *first < 0 || *last >= side);
        let mut found = is_cut.then_some([outside; 2]);
        let [[x0, x1], [y0, y1]] = [0, 1].map(|k: usize| {
            let [first, last] = [columns, rows][k];
            [first.max(0), last.min(sides[k] - 1)]
        });
        if x0 > x1 || y0 > y1 {
            return found.unwrap_or([outside; 2]);
        }
        // Selects the level at which two or three cells cover the longest side.
        let longest = (x1 - x0).max(y1 - y0) as usize / (2 * FINEST_CELL_PX);
        let level = ((usize::BITS - longest.leading_zeros()) as usize).min(self.levels.len() - 1);
        let side = (FINEST_CELL_PX << level) as i64;
        let cells = &self.levels[level];
        for y in y0 / side..=y1 / side {
            for [low, high] in &cells.row(y as usize)[(x0 / side) as usize..=(x1 / side) as usize] {
                let so_far = found.get_or_insert([*low, *high]);
                *so_far = [so_far[0].min(*low), so_far[1].max(*high)];
            }
        }
        found.unwrap_or([outside; 2])
    }
}

/// Merges two by two cells.
fn halved<T: Copy + Ord>(finer: &Grid<[T; 2]>) -> Grid<[T; 2]> {
    let [width, height] = [finer.width(), finer.height()];
    Grid::from_fn(width.div_ceil(2), height.div_ceil(2), |x, y| {
        let [x1, y1] = [(2 * x + 1).min(width - 1), (2 * y + 1).min(height - 1)];
        let four = [(2 * x, 2 * y), (x1, 2 * y), (2 * x, y1), (x1, y1)];
        let [a, b, c, d] = four.map(|(x, y)| finer.at(x, y));
        let low = a[0].min(b[0]).min(c[0]).min(d[0]);
        [low, a[1].max(b[1]).max(c[1]).max(d[1])]
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::MinMaxPyramid;
    use crate::raster::Grid;

    proptest! {
        #[test]
        fn range_contains_all_values_of_the_box(
            [width, height] in [1_usize..70, 1_usize..70],
            seed in any::<u64>(),
            [x0, y0] in [-9_i64..80, -9_i64..80],
            [across, down] in [0_i64..40, 0_i64..40],
        ) {
            let value = |x: usize, y: usize| {
                let mixed = (seed ^ (x * 131 + y) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                1 + (mixed >> 56) as u16
            };
            let grid = Grid::from_fn(width, height, value);
            let [x1, y1] = [x0 + across, y0 + down];
            let [low, high] = MinMaxPyramid::new(&grid).range_in_box([[x0, x1], [y0, y1]], 0);
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let value = grid.get(x, y).unwrap_or(0);
                    prop_assert!((low..=high).contains(&value));
                }
            }
        }

        #[test]
        fn range_is_exact_for_single_cells(x in 0_i64..8, y in 0_i64..8) {
            let grid = Grid::from_fn(32, 32, |x, y| (x * y) as u16);
            let [low, high] = MinMaxPyramid::new(&grid).range_in_box([[4 * x, 4 * x + 3], [4 * y, 4 * y + 3]], 0);
            prop_assert_eq!(i64::from(low), 16 * x * y);
            prop_assert_eq!(i64::from(high), (4 * x + 3) * (4 * y + 3));
        }
    }
}
