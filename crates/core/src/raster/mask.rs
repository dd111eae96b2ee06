//! Binary masks: which pixels are stroke.

use super::Grid;
use crate::domain::cancel::poll;

/// A grid of booleans.
pub type Mask = Grid<bool>;

/// A box of pixels. The last column and the last row belong to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelBox {
    /// First column.
    pub x0: usize,
    /// First row.
    pub y0: usize,
    /// Last column.
    pub x1: usize,
    /// Last row.
    pub y1: usize,
}

impl PixelBox {
    /// Returns the number of columns.
    pub const fn width(&self) -> usize {
        self.x1 - self.x0 + 1
    }

    /// Returns the number of rows.
    pub const fn height(&self) -> usize {
        self.y1 - self.y0 + 1
    }

    /// Returns the larger of width and height.
    pub fn longest_side(&self) -> usize {
        self.width().max(self.height())
    }

    /// Returns the smallest box that contains both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }
}

impl<T: Copy> Grid<T> {
    /// Returns the values inside a box, which must lie within the grid.
    ///
    /// ```
    /// use mocban_core::raster::{Grid, PixelBox};
    ///
    /// let grid = Grid::from_fn(4, 3, |x, y| 10 * y + x);
    /// let part = grid.part(PixelBox { x0: 1, y0: 1, x1: 2, y1: 2 });
    /// assert_eq!(part.data(), [11, 12, 21, 22]);
    /// ```
    #[must_use]
    pub fn part(&self, bounds: PixelBox) -> Self {
        Self::from_fn(bounds.width(), bounds.height(), |x, y| {
            self.at(bounds.x0 + x, bounds.y0 + y)
        })
    }
}

/// Largest count that fits in a `u8`. SIMD adds more `u8` than wider integers at once.
const CHUNK_PIXELS: usize = 255;

/// Counts the set pixels of up to [`CHUNK_PIXELS`].
fn count_set(pixels: impl Iterator<Item = bool>) -> usize {
    usize::from(pixels.map(u8::from).sum::<u8>())
}

/// Overlap of two masks of the same size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaskOverlap {
    /// Intersection over union, 0..=1. It is 0 if both masks are empty.
    pub iou: f64,
    /// Dice coefficient, 0..=1: twice the intersection over the sum of both areas. It is 0 if both masks are empty.
    pub dice: f64,
}

impl Mask {
    /// Returns column and row of the first and the last set pixel of each row that has one. Extents of a mask in any
    /// direction are those of these pixels.
    ///
    /// ```
    /// use mocban_core::raster::Mask;
    ///
    /// let mask = Mask::from_fn(5, 2, |x, y| y == 1 && (1..4).contains(&x));
    /// assert!(mask.row_ends().eq([[1, 1], [3, 1]]));
    /// ```
    pub fn row_ends(&self) -> impl Iterator<Item = [usize; 2]> {
        (0..self.height()).flat_map(|y| {
            let row = self.row(y);
            let ends = [
                row.iter().position(|set| *set),
                row.iter().rposition(|set| *set),
            ];
            ends.into_iter().flatten().map(move |x| [x, y])
        })
    }

    /// Computes the overlap with another mask of the same size.
    ///
    /// ```
    /// use mocban_core::raster::Mask;
    ///
    /// let left = Mask::from_fn(8, 3, |x, _| x < 4);
    /// let middle = Mask::from_fn(8, 3, |x, _| (2..6).contains(&x));
    /// let overlap = left.overlap(&middle);
    /// assert_eq!(overlap.iou, 6.0 / 18.0);
    /// assert_eq!(overlap.dice, 12.0 / 24.0);
    /// ```
    pub fn overlap(&self, other: &Self) -> MaskOverlap {
        let runs = self
            .data()
            .chunks(CHUNK_PIXELS)
            .zip(other.data().chunks(CHUNK_PIXELS));
        let both = runs.map(|(one, other)| count_set(one.iter().zip(other).map(|(a, b)| *a & *b)));
        let both = both.sum::<usize>() as f64;
        let sum = (self.count() + other.count()) as f64;
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        MaskOverlap {
            iou: share(both, sum - both),
            dice: share(2.0 * both, sum),
        }
    }

    /// Returns 1 for set pixels and 0 for others.
    pub fn to_weights(&self) -> Grid<f32> {
        self.map(|set| f32::from(u8::from(*set)))
    }

    /// Counts the set pixels.
    pub fn count(&self) -> usize {
        let runs = self.data().chunks(CHUNK_PIXELS);
        runs.map(|run| count_set(run.iter().copied())).sum()
    }

    /// Returns the share of set pixels, 0..=1; 0 for an empty grid.
    pub fn density(&self) -> f64 {
        if self.data().is_empty() {
            return 0.0;
        }
        self.count() as f64 / self.data().len() as f64
    }

    /// Returns the smallest box that contains every set pixel, or `None` if no pixel is set.
    ///
    /// ```
    /// use mocban_core::raster::Mask;
    ///
    /// let mask = Mask::from_fn(9, 7, |x, y| (2..5).contains(&x) && y == 3);
    /// let bounds = mask.bounding_box().expect("set pixels");
    /// assert_eq!([bounds.x0, bounds.y0, bounds.x1, bounds.y1], [2, 3, 4, 3]);
    /// assert_eq!(mask.centroid(), Some([3.0, 3.0]));
    /// ```
    pub fn bounding_box(&self) -> Option<PixelBox> {
        let mut found: Option<PixelBox> = None;
        for y in 0..self.height() {
            let row = self.row(y);
            // Tests the whole row with SIMD first.
            if !row.iter().fold(false, |any, set| any | *set) {
                continue;
            }
            let (x0, x1) = found.map_or((row.len(), 0), |so_far| (so_far.x0, so_far.x1 + 1));
            let first = row[..x0].iter().position(|set| *set).unwrap_or(x0);
            let last = row[x1..].iter().rposition(|set| *set).map(|k| x1 + k);
            let row = PixelBox {
                x0: first,
                y0: y,
                x1: last.unwrap_or(x1.saturating_sub(1)),
                y1: y,
            };
            found = Some(found.map_or(row, |so_far| so_far.union(row)));
        }
        found
    }

    /// Dilates the mask by a 3 x 3 square.
    ///
    /// ```
    /// use mocban_core::raster::Mask;
    ///
    /// let dot = Mask::from_fn(5, 5, |x, y| (x, y) == (2, 2));
    /// assert_eq!(dot.dilate().count(), 9);
    /// ```
    #[must_use]
    pub fn dilate(&self) -> Self {
        let (width, height) = (self.width(), self.height());
        let mut across = self.clone();
        for (y, row) in across.data_mut().chunks_exact_mut(width.max(1)).enumerate() {
            poll();
            let from = self.row(y);
            for (grown, left) in row[1..].iter_mut().zip(from) {
                *grown |= *left;
            }
            for (grown, right) in row.iter_mut().zip(&from[1..]) {
                *grown |= *right;
            }
        }
        let mut grown = across.clone();
        for (y, row) in grown.data_mut().chunks_exact_mut(width.max(1)).enumerate() {
            poll();
            for near in [y.saturating_sub(1), (y + 1).min(height - 1)] {
                for (grown, near) in row.iter_mut().zip(across.row(near)) {
                    *grown |= *near;
                }
            }
        }
        grown
    }

    /// Returns the mean position of the set pixels, in pixels, or `None` if no pixel is set.
    pub fn centroid(&self) -> Option<[f64; 2]> {
        let (mut n, mut sum_x, mut sum_y) = (0_u64, 0_u64, 0_u64);
        for y in 0..self.height() {
            for (x, set) in self.row(y).iter().enumerate() {
                if *set {
                    n += 1;
                    sum_x += x as u64;
                    sum_y += y as u64;
                }
            }
        }
        (n > 0).then(|| [sum_x as f64 / n as f64, sum_y as f64 / n as f64])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Mask, PixelBox};

    proptest! {
        #[test]
        fn counts_and_boxes_equal_those_of_single_pixels(bits in prop::collection::vec(any::<[bool; 2]>(), 1..900)) {
            let mask = |k: usize| {
                let set = bits.iter().map(|pair| pair[k]).collect();
                Mask::from_vec(bits.len(), 1, set).expect("a row")
            };
            let count = |of: &dyn Fn(&[bool; 2]) -> bool| bits.iter().filter(|pair| of(pair)).count();
            let (one, two) = (mask(0), mask(1));
            prop_assert_eq!(one.count(), count(&|pair| pair[0]));
            let [both, either] = [count(&|p| p[0] && p[1]), count(&|p| p[0] || p[1])];
            let found = one.overlap(&two);
            let share = if either == 0 { 0.0 } else { both as f64 / either as f64 };
            prop_assert_eq!(found.iou, share);
            let wide = Mask::from_fn(30, bits.len() / 30 + 1, |x, y| {
                bits.get(y * 30 + x).is_some_and(|pair| pair[0] && pair[1])
            });
            let set = |x: usize, y: usize| wide.at(x, y).then_some(PixelBox { x0: x, y0: y, x1: x, y1: y });
            let places = (0..wide.height()).flat_map(|y| (0..30).map(move |x| (x, y)));
            let around = places.filter_map(|(x, y)| set(x, y)).reduce(PixelBox::union);
            prop_assert_eq!(wide.bounding_box(), around);
            prop_assert!((found.dice - 2.0 * share / (1.0 + share)).abs() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn dilation_adds_neighbours(
            width in 1_usize..20,
            bits in prop::collection::vec(prop::bool::weighted(0.1), 1..200),
        ) {
            let height = bits.len() / width;
            let mask = Mask::from_fn(width, height, |x, y| bits[y * width + x]);
            let touches = |x: usize, y: usize| {
                let near = |dx: i64, dy: i64| mask.get(x as i64 + dx, y as i64 + dy) == Some(true);
                (-1..=1).any(|dy| (-1..=1).any(|dx| near(dx, dy)))
            };
            prop_assert_eq!(mask.dilate(), Mask::from_fn(width, height, touches));
        }
    }

    #[test]
    fn overlap_of_halves_and_of_nothing() {
        let [left, middle] =
            [0..4, 2..6].map(|columns| Mask::from_fn(8, 3, |x, _| columns.contains(&x)));
        let found = left.overlap(&middle);
        assert_eq!((found.iou, found.dice), (1.0 / 3.0, 0.5));
        assert_eq!(left.overlap(&left).iou, 1.0);
        let none = Mask::new(8, 3, false);
        assert_eq!(
            (none.overlap(&none).iou, none.overlap(&none).dice),
            (0.0, 0.0)
        );
    }

    #[test]
    fn box_and_centroid_of_two_pixels() {
        let mask = Mask::from_fn(9, 7, |x, y| (x, y) == (2, 1) || (x, y) == (6, 5));
        assert_eq!(
            mask.bounding_box(),
            Some(PixelBox {
                x0: 2,
                y0: 1,
                x1: 6,
                y1: 5
            })
        );
        assert_eq!(mask.centroid(), Some([4.0, 3.0]));
        assert_eq!(Mask::new(3, 3, false).bounding_box(), None);
    }
}
