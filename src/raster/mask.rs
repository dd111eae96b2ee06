//! Masks: which pixels are stroke.

use super::Grid;

/// A grid of yes and no.
pub type Mask = Grid<bool>;

/// A box of pixels, bounds included.
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
    /// Columns covered.
    pub const fn width(&self) -> usize {
        self.x1 - self.x0 + 1
    }

    /// Rows covered.
    pub const fn height(&self) -> usize {
        self.y1 - self.y0 + 1
    }
}

/// How far two masks of the same size cover each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Pixels set in both over pixels set in either, 0..=1; 0 where none is set.
    pub iou: f64,
    /// Twice the pixels set in both over the sum of both counts, 0..=1; 0 where none is set.
    pub dice: f64,
}

impl Mask {
    /// How far this mask and another of the same size cover each other.
    pub fn overlap(&self, other: &Self) -> Overlap {
        let pixels = self.data().iter().zip(other.data());
        let both = pixels.filter(|(a, b)| **a && **b).count() as f64;
        let sum = (self.count() + other.count()) as f64;
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        Overlap {
            iou: share(both, sum - both),
            dice: share(2.0 * both, sum),
        }
    }

    /// Number of set pixels.
    pub fn count(&self) -> usize {
        self.data().iter().filter(|set| **set).count()
    }

    /// Share of set pixels, 0..=1; 0 for an empty grid.
    pub fn density(&self) -> f64 {
        if self.data().is_empty() {
            return 0.0;
        }
        self.count() as f64 / self.data().len() as f64
    }

    /// Smallest box that holds every set pixel; `None` when none is set.
    pub fn bounding_box(&self) -> Option<PixelBox> {
        let mut found: Option<PixelBox> = None;
        for y in 0..self.height() {
            let row = self.row(y);
            let (Some(first), Some(last)) = (
                row.iter().position(|set| *set),
                row.iter().rposition(|set| *set),
            ) else {
                continue;
            };
            let grown = found.get_or_insert(PixelBox {
                x0: first,
                y0: y,
                x1: last,
                y1: y,
            });
            grown.x0 = grown.x0.min(first);
            grown.x1 = grown.x1.max(last);
            grown.y1 = y;
        }
        found
    }

    /// Mean position of the set pixels; `None` when none is set.
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
    use super::{Mask, PixelBox};

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
