//! Connected groups of set pixels.

use crate::raster::{Grid, Mask};

/// Groups below this share of a picture are specks; the authors' code has it.
const SPECK_SHARE: f64 = 1.0 / 1200.0;

/// Groups of set pixels that touch along an edge, each with its size.
#[derive(Debug)]
pub(super) struct Components {
    /// Group of each pixel; `u32::MAX` where the mask is not set.
    labels: Grid<u32>,
    sizes: Vec<usize>,
}

impl Components {
    /// Finds the groups of a mask.
    pub(super) fn of(mask: &Mask) -> Self {
        let (width, height) = (mask.width(), mask.height());
        let mut labels = Grid::new(width, height, u32::MAX);
        let mut sizes = Vec::new();
        let mut front = Vec::new();
        for start in 0..width * height {
            if !mask.data()[start] || labels.data()[start] != u32::MAX {
                continue;
            }
            let label = sizes.len() as u32;
            let mut size = 0;
            labels.data_mut()[start] = label;
            front.push(start);
            while let Some(i) = front.pop() {
                size += 1;
                let (x, y) = (i % width, i / width);
                let neighbours = [
                    (x > 0).then(|| i - 1),
                    (x + 1 < width).then(|| i + 1),
                    (y > 0).then(|| i - width),
                    (y + 1 < height).then(|| i + width),
                ];
                for j in neighbours.into_iter().flatten() {
                    if mask.data()[j] && labels.data()[j] == u32::MAX {
                        labels.data_mut()[j] = label;
                        front.push(j);
                    }
                }
            }
            sizes.push(size);
        }
        Self { labels, sizes }
    }

    /// The pixels whose group has at least this size.
    pub(super) fn at_least(&self, size: usize) -> Mask {
        self.labels
            .map(|label| *label != u32::MAX && self.sizes[*label as usize] >= size)
    }

    /// The pixels whose group comes within `reach` pixels, along either axis, of one of the other mask.
    pub(super) fn near(&self, other: &Mask, reach: i64) -> Mask {
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
    pub(super) fn at_border(&self) -> Mask {
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

/// The mask without specks for a picture of so many pixels, neither set ones nor holes.
pub(super) fn without_specks(mask: &Mask, area: usize) -> Mask {
    let size = (area as f64 * SPECK_SHARE).round() as usize;
    let kept = Components::of(mask).at_least(size);
    let holes = Components::of(&kept.map(|set| !set)).at_least(size);
    holes.map(|hole| !hole)
}

#[cfg(test)]
mod tests {
    use super::{Components, without_specks};
    use crate::raster::Mask;

    fn drawn(rows: [&str; 5]) -> Mask {
        Mask::from_fn(6, 5, |x, y| rows[y].as_bytes()[x] == b'#')
    }

    #[test]
    fn specks_and_pinholes_go() {
        let mask = drawn(["#.....", ".####.", ".#.##.", ".####.", ".....#"]);
        let clean = drawn(["......", ".####.", ".####.", ".####.", "......"]);
        assert_eq!(without_specks(&mask, 2400), clean);
    }

    #[test]
    fn groups_at_the_border_are_told() {
        let mask = drawn(["##....", "#.....", "..##..", "..##..", "......"]);
        assert_eq!(Components::of(&mask).at_border().count(), 3);
    }
}
