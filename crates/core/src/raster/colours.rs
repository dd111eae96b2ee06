//! The colours of a print, in as many bytes a pixel as its file has.

use std::borrow::Cow;

use super::{Grid, PixelBox};

/// Colours of an image, which are read as red, green and blue in 16 bits. Levels of 8 bits are multiplied by 257 when they
/// are read, so that white is always 65535.
#[derive(Debug, Clone)]
pub enum Colours {
    /// Levels of grey in 8 bits.
    Grey8(Grid<u8>),
    /// Red, green and blue in 8 bits.
    Rgb8(Grid<[u8; 3]>),
    /// Red, green and blue in 16 bits.
    Rgb16(Grid<[u16; 3]>),
}

/// Returns 16 bits for 8.
pub(super) const fn widen(level: u8) -> u16 {
    level as u16 * 257
}

/// Returns 8 bits for 16, rounded.
const fn narrow(level: u16) -> u8 {
    ((level as u32 + 128) / 257) as u8
}

impl Colours {
    /// Creates the colours of 8-bit samples, of which a pixel has one (grey) or three (RGB). Returns `None` if there are more
    /// or fewer samples.
    pub(super) fn of_samples(
        [width, height]: [usize; 2],
        channels: usize,
        samples: Vec<u8>,
    ) -> Option<Self> {
        if samples.len() != width * height * channels {
            return None;
        }
        if channels == 1 {
            return Grid::from_vec(width, height, samples).map(Self::Grey8);
        }
        // Without a copy, unless the memory is not a whole number of colours.
        let colours = bytemuck::allocation::try_cast_vec(samples)
            .unwrap_or_else(|(_, samples)| samples.as_chunks::<3>().0.to_vec());
        Grid::from_vec(width, height, colours).map(Self::Rgb8)
    }

    /// Returns the number of columns.
    pub const fn width(&self) -> usize {
        match self {
            Self::Grey8(grid) => grid.width(),
            Self::Rgb8(grid) => grid.width(),
            Self::Rgb16(grid) => grid.width(),
        }
    }

    /// Returns the number of rows.
    pub const fn height(&self) -> usize {
        match self {
            Self::Grey8(grid) => grid.height(),
            Self::Rgb8(grid) => grid.height(),
            Self::Rgb16(grid) => grid.height(),
        }
    }

    /// Returns the memory that the colours take, bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Grey8(grid) => size_of_val(grid.data()),
            Self::Rgb8(grid) => size_of_val(grid.data()),
            Self::Rgb16(grid) => size_of_val(grid.data()),
        }
    }

    /// Returns the colour at column x, row y; panics outside the image.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> [u16; 3] {
        match self {
            Self::Grey8(grid) => [widen(grid.at(x, y)); 3],
            Self::Rgb8(grid) => grid.at(x, y).map(widen),
            Self::Rgb16(grid) => grid.at(x, y),
        }
    }

    /// Applies a function to each colour.
    pub fn map<T: Copy>(&self, value: impl Fn([u16; 3]) -> T) -> Grid<T> {
        match self {
            Self::Grey8(grid) => {
                let of_levels: [T; 256] =
                    std::array::from_fn(|level| value([widen(level as u8); 3]));
                grid.map(|level| of_levels[usize::from(*level)])
            }
            Self::Rgb8(grid) => grid.map(|colour| value(colour.map(widen))),
            Self::Rgb16(grid) => grid.map(|colour| value(*colour)),
        }
    }

    /// Returns the part inside a box, whose edges belong to it; panics outside the image.
    #[must_use]
    pub fn part(&self, bounds: PixelBox) -> Self {
        match self {
            Self::Grey8(grid) => Self::Grey8(grid.part(bounds)),
            Self::Rgb8(grid) => Self::Rgb8(grid.part(bounds)),
            Self::Rgb16(grid) => Self::Rgb16(grid.part(bounds)),
        }
    }

    /// Returns whether no pixel has a colour other than grey.
    pub(super) fn is_grey(&self) -> bool {
        match self {
            Self::Grey8(_) => true,
            Self::Rgb8(grid) => grid.data().iter().all(|[r, g, b]| r == g && g == b),
            Self::Rgb16(grid) => grid.data().iter().all(|[r, g, b]| r == g && g == b),
        }
    }

    /// Returns the colours in 16 bits.
    pub fn to_rgb16(&self) -> Cow<'_, Grid<[u16; 3]>> {
        match self {
            Self::Rgb16(grid) => Cow::Borrowed(grid),
            _ => Cow::Owned(self.map(|colour| colour)),
        }
    }

    /// Returns the colours rounded to 8 bits.
    pub fn to_rgb8(&self) -> Cow<'_, Grid<[u8; 3]>> {
        match self {
            Self::Rgb8(grid) => Cow::Borrowed(grid),
            _ => Cow::Owned(self.map(|colour| colour.map(narrow))),
        }
    }

    /// Returns the colours rounded to 8 bits, without a copy if they have 8.
    pub fn into_rgb8(self) -> Grid<[u8; 3]> {
        match self {
            Self::Rgb8(grid) => grid,
            other => other.to_rgb8().into_owned(),
        }
    }

    /// Widens the colours to 16 bits and changes them.
    pub(super) fn change<T>(&mut self, change: impl FnOnce(&mut Grid<[u16; 3]>) -> T) -> T {
        let nothing = Self::Grey8(Grid::new(0, 0, 0));
        let mut wide = match std::mem::replace(self, nothing) {
            Self::Rgb16(grid) => grid,
            other => other.map(|colour| colour),
        };
        let changed = change(&mut wide);
        *self = Self::Rgb16(wide);
        changed
    }
}

/// Compares the colours in 16 bits, so that equal colours in different forms are equal.
impl PartialEq for Colours {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Grey8(one), Self::Grey8(other)) => one == other,
            (Self::Rgb8(one), Self::Rgb8(other)) => one == other,
            _ => self.to_rgb16() == other.to_rgb16(),
        }
    }
}

impl From<Grid<[u16; 3]>> for Colours {
    fn from(grid: Grid<[u16; 3]>) -> Self {
        Self::Rgb16(grid)
    }
}

#[cfg(test)]
mod tests {
    use super::Colours;
    use crate::raster::{Grid, PixelBox};

    /// Returns the same greys in all forms.
    fn forms() -> [Colours; 3] {
        let grey = Grid::from_fn(5, 4, |x, y| (50 * x + 3 * y) as u8);
        let rgb8 = grey.map(|level| [*level; 3]);
        let rgb16 = grey.map(|level| [u16::from(*level) * 257; 3]);
        [
            Colours::Grey8(grey),
            Colours::Rgb8(rgb8),
            Colours::Rgb16(rgb16),
        ]
    }

    #[test]
    fn all_forms_give_the_same_colours() {
        let bounds = PixelBox {
            x0: 1,
            y0: 2,
            x1: 3,
            y1: 3,
        };
        let forms = forms();
        assert_eq!(forms.each_ref().map(Colours::bytes), [20, 60, 120]);
        for one in &forms {
            assert!(one.is_grey());
            assert_eq!([one.width(), one.height()], [5, 4]);
            assert_eq!(one.at(4, 3), [209 * 257; 3]);
            let sums = one.map(|[r, g, b]| u32::from(r) + u32::from(g) + u32::from(b));
            assert_eq!(sums.at(4, 3), 3 * 209 * 257);
            assert_eq!(one.to_rgb8().at(4, 3), [209; 3]);
            let mut wide = one.clone();
            assert_eq!(wide.change(|wide| wide.at(4, 3)), [209 * 257; 3]);
            assert_eq!(wide, *one);
            for other in &forms {
                assert_eq!(one, other);
                assert_eq!(one.part(bounds), other.part(bounds));
            }
            wide.change(|wide| wide.set(2, 1, [0, 1, 0]));
            assert!(wide != *one && !wide.is_grey());
        }
    }

    #[test]
    fn samples_become_colours_only_if_all_are_there() {
        let of = |channels, samples: &[u8]| {
            // The capacity is not a whole number of colours.
            let mut held = Vec::with_capacity(samples.len() + 1);
            held.extend_from_slice(samples);
            Colours::of_samples([2, 1], channels, held)
        };
        let colours = of(3, &[1, 2, 3, 4, 5, 6]).expect("two colours");
        assert_eq!(colours.at(1, 0), [4 * 257, 5 * 257, 6 * 257]);
        assert_eq!(of(1, &[7, 9]).expect("two greys").at(1, 0), [9 * 257; 3]);
        for (channels, count) in [(1, 3), (3, 5), (3, 7), (3, 9)] {
            assert!(of(channels, &vec![0; count]).is_none());
        }
    }
}
