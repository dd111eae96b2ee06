//! A two-dimensional grid of values, and the pixel convention of the whole project.
//!
//! x runs to the right and y down. **(0, 0) is the centre of the top-left pixel**: pixel x covers x - 0.5..x + 0.5.

use crate::domain::cancel::poll;

/// Values in row-major order, top row first.
///
/// ```
/// use mocban_core::raster::Grid;
///
/// let grid = Grid::from_fn(3, 2, |x, y| 10 * y + x);
/// assert_eq!(grid.row(1), [10, 11, 12]);
/// assert_eq!(grid.get(-1, 0), None);
/// assert_eq!(grid.transposed().row(2), [2, 12]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

/// Values that are computed between two polls for a cancellation.
const VALUES_PER_POLL: usize = 1 << 16;

/// Side of the square tiles that are transposed one after another. The rows of one tile stay in the CPU cache.
const TILE: usize = 8;

/// Transposes the first tile of `from` into `to`. Rows have `from_width` values in `from` and `to_width` in `to`.
fn transpose_tile<T: Copy>(from: &[T], from_width: usize, to: &mut [T], to_width: usize) {
    let rows: [&[T]; TILE] = std::array::from_fn(|y| &from[y * from_width..][..TILE]);
    for x in 0..TILE {
        let column = &mut to[x * to_width..][..TILE];
        for (value, row) in column.iter_mut().zip(rows) {
            *value = row[x];
        }
    }
}

impl<T: Copy> Grid<T> {
    /// Creates a grid from `width * height` values.
    pub(super) const fn of(width: usize, height: usize, data: Vec<T>) -> Self {
        Self {
            width,
            height,
            data,
        }
    }

    /// Creates a grid of one value.
    pub fn new(width: usize, height: usize, fill: T) -> Self {
        Self::of(width, height, vec![fill; width * height])
    }

    /// Creates a grid from values in row-major order. Returns `None` unless there are `width * height` values.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Option<Self> {
        (data.len() == width * height).then_some(Self::of(width, height, data))
    }

    /// Creates a grid from a function of each pixel's x and y.
    pub fn from_fn(width: usize, height: usize, mut value: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(width * height);
        for y in 0..height {
            poll();
            data.extend((0..width).map(|x| value(x, y)));
        }
        Self::of(width, height, data)
    }

    /// Applies a function to each value.
    pub fn map<U: Copy>(&self, mut value: impl FnMut(&T) -> U) -> Grid<U> {
        let mut data = Vec::with_capacity(self.data.len());
        for part in self.data.chunks(VALUES_PER_POLL) {
            poll();
            data.extend(part.iter().map(&mut value));
        }
        Grid::of(self.width, self.height, data)
    }

    /// Combines the values of two grids of the same size, position by position.
    pub fn zip_map<U: Copy, V: Copy>(
        &self,
        other: &Grid<U>,
        mut value: impl FnMut(T, U) -> V,
    ) -> Grid<V> {
        let mut data = Vec::with_capacity(self.data.len());
        let parts = self.data.chunks(VALUES_PER_POLL);
        for (part, other) in parts.zip(other.data.chunks(VALUES_PER_POLL)) {
            poll();
            let pairs = part.iter().zip(other);
            data.extend(pairs.map(|(one, other)| value(*one, *other)));
        }
        Grid::of(self.width, self.height, data)
    }

    /// Returns the transposed grid.
    #[must_use]
    pub fn transposed(&self) -> Self {
        self.transposed_in(self.data.clone())
    }

    /// Returns the transposed grid in memory that holds as many values.
    pub(super) fn transposed_in(&self, memory: Vec<T>) -> Self {
        let (width, height) = (self.width, self.height);
        let mut data = memory;
        for top in (0..height).step_by(TILE) {
            poll();
            let rows = &self.data[top * width..];
            for left in (0..width).step_by(TILE) {
                let columns = &mut data[left * height..];
                if top + TILE <= height && left + TILE <= width {
                    transpose_tile(&rows[left..], width, &mut columns[top..], height);
                    continue;
                }
                for y in 0..TILE.min(height - top) {
                    for x in 0..TILE.min(width - left) {
                        columns[x * height + top + y] = rows[y * width + left + x];
                    }
                }
            }
        }
        Self::of(height, width, data)
    }

    /// Returns the number of columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Returns the value at column x, row y; panics outside the grid.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// Returns the value at column x, row y; `None` outside the grid.
    #[inline]
    pub fn get(&self, x: i64, y: i64) -> Option<T> {
        (x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64)
            .then(|| self.data[y as usize * self.width + x as usize])
    }

    /// Sets the value at column x, row y; panics outside the grid.
    #[inline]
    pub fn set(&mut self, x: usize, y: usize, value: T) {
        self.data[y * self.width + x] = value;
    }

    /// Returns a row.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// Returns all values in row-major order.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// Returns the memory of the values.
    pub(super) fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Returns all values for modification.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }
}

#[cfg(test)]
mod tests {
    use super::Grid;

    #[test]
    fn rows_become_columns() {
        for (width, height) in [(1, 5), (8, 8), (19, 11), (24, 7)] {
            let grid = Grid::from_fn(width, height, |x, y| 100 * x + y);
            let turned = Grid::from_fn(height, width, |x, y| 100 * y + x);
            assert_eq!(grid.transposed(), turned);
        }
    }
}
