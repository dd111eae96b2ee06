//! Enlarges or reduces colours a whole number of times, and brings masks of that size back to the size of the print.

use super::colours::widen;
use super::{Colours, Grid, Mask};
use crate::domain::MaskScale;
use crate::domain::cancel::poll;

/// Enlarges colours `times` times by cubic interpolation (Catmull-Rom). Beyond the border, the colours of the border
/// continue. For the map of the pixels, see [`MaskScale`].
///
/// ```
/// use mocban_core::raster::{Grid, enlarge};
///
/// let step = Grid::from_fn(4, 1, |x, _| [if x < 2 { 10_000 } else { 30_000 }; 3]);
/// let found = enlarge(&step.into(), 2);
/// assert_eq!([found.width(), found.height()], [8, 2]);
/// // Steeper than linear interpolation, which gives 15,000 and 25,000.
/// let row: Vec<u16> = found.row(0).iter().map(|c| c[0]).collect();
/// assert_eq!(row[3..5], [14_063, 25_938]);
/// ```
pub fn enlarge(rgb: &Colours, times: u32) -> Grid<[u16; 3]> {
    let values = rgb.map(|colour| colour.map(f32::from));
    if values.data().is_empty() {
        return rgb.to_rgb16().into_owned();
    }
    let [columns, rows] = [values.width(), values.height()].map(|side| Taps::all(side, times));
    let wide = Grid::from_fn(columns.len(), values.height(), |x, y| {
        columns[x].mix(|k| values.at(k, y))
    });
    Grid::from_fn(columns.len(), rows.len(), |x, y| {
        if x == 0 {
            poll();
        }
        let colour = rows[y].mix(|k| wide.at(x, k));
        colour.map(|value| value.round().clamp(0.0, f32::from(u16::MAX)) as u16)
    })
}

/// Reduces colours to the means of squares of `times` by `times` pixels. The last column and row may show fewer pixels.
///
/// ```
/// use mocban_core::raster::{Grid, reduce};
///
/// let ramp = Grid::from_fn(5, 2, |x, _| [100 * x as u16; 3]);
/// let found = reduce(&ramp.into(), 2);
/// assert_eq!([found.width(), found.height()], [3, 1]);
/// assert_eq!(found.data(), [[50; 3], [250; 3], [400; 3]]);
/// ```
pub fn reduce(rgb: &Colours, times: u32) -> Grid<[u16; 3]> {
    match rgb {
        Colours::Grey8(grid) => {
            let means = square_means(grid, times, |level| [widen(level)]);
            means.map(|[level]| [*level; 3])
        }
        Colours::Rgb8(grid) => square_means(grid, times, |colour| colour.map(widen)),
        Colours::Rgb16(grid) => square_means(grid, times, |colour| colour),
    }
}

/// Pixels whose levels are added in 32 bits, which hold the sum of as many of the largest levels.
const PIXELS_PER_SUM: usize = 1 << 16;

/// Returns the means, rounded, of squares of `times` by `times` pixels. `levels` returns the levels of a pixel.
fn square_means<T: Copy, const N: usize>(
    grid: &Grid<T>,
    times: u32,
    levels: impl Fn(T) -> [u16; N],
) -> Grid<[u16; N]> {
    let side = times.max(1) as usize;
    let [columns, rows] = [grid.width(), grid.height()].map(|length| length.div_ceil(side));
    let mut means = Vec::with_capacity(columns * rows);
    let mut sums = vec![[0_u64; N]; columns];
    for top in (0..grid.height()).step_by(side) {
        poll();
        sums.fill([0; N]);
        let rows = top..grid.height().min(top + side);
        for y in rows.clone() {
            for (sum, square) in sums.iter_mut().zip(grid.row(y).chunks(side)) {
                for part in square.chunks(PIXELS_PER_SUM) {
                    let mut row = [0_u32; N];
                    for pixel in part {
                        for (sum, level) in row.iter_mut().zip(levels(*pixel)) {
                            *sum += u32::from(level);
                        }
                    }
                    for (sum, row) in sum.iter_mut().zip(row) {
                        *sum += u64::from(row);
                    }
                }
            }
        }
        means.extend(sums.iter().enumerate().map(|(x, sum)| {
            let width = side.min(grid.width() - x * side);
            let pixels = (width * rows.len()) as u64;
            sum.map(|sum| ((sum + pixels / 2) / pixels) as u16)
        }));
    }
    // A square for each column and row.
    Grid::from_vec(columns, rows, means).expect("one colour for each square")
}

/// Returns the pixels of a print that are set in its mask: of an enlarged mask those of which at least half is set, of a
/// reduced one those where the interpolated mask is at least one half.
pub fn mask_of_print(mask: &Mask, scale: MaskScale) -> Mask {
    match scale {
        MaskScale::Same => mask.clone(),
        MaskScale::Enlarged(times) => majorities(mask, times.get() as usize),
        MaskScale::Reduced(reduction) => {
            let times = reduction.times.get();
            let [columns, rows] = [
                LinearTaps::all(mask.width(), times, reduction.print_px[0]),
                LinearTaps::all(mask.height(), times, reduction.print_px[1]),
            ];
            let weights = mask.to_weights();
            Mask::from_fn(columns.len(), rows.len(), |x, y| {
                if x == 0 {
                    poll();
                }
                rows[y].mix(|k| columns[x].mix(|j| weights.at(j, k))) >= 0.5
            })
        }
    }
}

/// The two source pixels of an output pixel along one axis, and the weight of the second.
#[derive(Debug, Clone, Copy)]
struct LinearTaps {
    pixels: [usize; 2],
    weight: f32,
}

impl LinearTaps {
    /// Computes those of `to` output pixels along an axis of `side` pixels that is enlarged. The border continues.
    fn all(side: usize, times: u32, to: u32) -> Vec<Self> {
        let step = f64::from(times);
        let of = |place: u32| {
            let last = side as f64 - 1.0;
            let at = ((f64::from(place) - (step - 1.0) / 2.0) / step).clamp(0.0, last.max(0.0));
            let before = at as usize;
            Self {
                pixels: [before, (before + 1).min(side.saturating_sub(1))],
                weight: at.fract() as f32,
            }
        };
        (0..to).map(of).collect()
    }

    fn mix(&self, value: impl Fn(usize) -> f32) -> f32 {
        let [first, second] = self.pixels.map(value);
        first + self.weight * (second - first)
    }
}

/// Returns whether at least half is set of each square of a mask.
fn majorities(mask: &Mask, side: usize) -> Mask {
    Mask::from_fn(mask.width() / side, mask.height() / side, |x, y| {
        let rows = (y * side..).take(side);
        let set = rows
            .flat_map(|y| &mask.row(y)[x * side..][..side])
            .filter(|set| **set);
        2 * set.count() >= side * side
    })
}

/// The four source pixels of an output pixel along one axis, and their weights.
#[derive(Debug, Clone, Copy)]
struct Taps {
    pixels: [usize; 4],
    weights: [f32; 4],
}

impl Taps {
    /// Computes those of all output pixels along an axis of `side` source pixels.
    fn all(side: usize, times: u32) -> Vec<Self> {
        let step = f64::from(times);
        let of = |place: usize| {
            let at = (place as f64 - (step - 1.0) / 2.0) / step;
            let before = at.floor();
            let within = |k: i64| (before as i64 + k).clamp(0, side as i64 - 1) as usize;
            Self {
                pixels: [-1, 0, 1, 2].map(within),
                weights: catmull_rom(at - before).map(|weight| weight as f32),
            }
        };
        (0..side * times as usize).map(of).collect()
    }

    fn mix(&self, colour: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for (pixel, weight) in self.pixels.into_iter().zip(self.weights) {
            for (sum, value) in sum.iter_mut().zip(colour(pixel)) {
                *sum += weight * value;
            }
        }
        sum
    }
}

/// Returns the weights of the values at -1, 0, 1 and 2 for a position 0..1 in cubic interpolation (Catmull-Rom).
pub fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        (-t3 + 2.0 * t2 - t) / 2.0,
        1.5 * t3 - 2.5 * t2 + 1.0,
        (-3.0 * t3 + 4.0 * t2 + t) / 2.0,
        (t3 - t2) / 2.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::{enlarge, mask_of_print, reduce};
    use crate::domain::{MaskReduction, MaskScale};
    use crate::raster::{Colours, Grid, Mask};
    use std::num::NonZeroU32;

    #[test]
    fn all_forms_of_colours_have_the_same_means() {
        for side in [5, 6, 7] {
            let rgb8 = Grid::from_fn(side, 7, |x, y| [(40 * x) as u8, (3 * x * y) as u8, 7]);
            let rgb16 = rgb8.map(|colour| colour.map(|level| u16::from(level) * 257));
            let expected = reduce(&Colours::Rgb16(rgb16), 3);
            assert_eq!(reduce(&Colours::Rgb8(rgb8.clone()), 3), expected);
            let grey = rgb8.map(|colour| colour[1]);
            let means = reduce(&Colours::Grey8(grey), 3);
            assert_eq!(means, expected.map(|[_, green, _]| [*green; 3]));
        }
    }

    #[test]
    fn enlarged_ramps_are_ramps_in_the_frame_of_the_maps() {
        let ramp = Grid::from_fn(9, 7, |x, y| [1000 * x as u16, 3000 * y as u16, 500]);
        for times in [1, 2, 3, 5] {
            let found = enlarge(&ramp.clone().into(), times);
            assert_eq!(
                [found.width(), found.height()],
                [9, 7].map(|side| side * times as usize)
            );
            let map = MaskScale::enlarged(times).print_from_masks();
            let inner = |side: u32| 2 * times..(side - 2) * times;
            for (x, y) in inner(9).flat_map(|x| inner(7).map(move |y| (x, y))) {
                let place = [x, y].map(f64::from);
                let [u, v] = map.apply(place);
                let [red, green, blue] = found.at(x as usize, y as usize);
                assert!((f64::from(red) - 1000.0 * u).abs() <= 1.0, "{red} at {u}");
                assert!(
                    (f64::from(green) - 3000.0 * v).abs() <= 1.0,
                    "{green} at {v}"
                );
                assert_eq!(blue, 500);
            }
        }
    }

    #[test]
    fn overshoot_stays_within_the_range_of_the_values() {
        let line = Grid::from_fn(8, 8, |x, _| [if x == 3 { 0 } else { u16::MAX }; 3]);
        let found = enlarge(&line.into(), 3);
        // Beside the dark line, the interpolation exceeds white.
        for x in [5, 6, 14, 15] {
            assert_eq!(found.at(x, 12)[0], u16::MAX, "{x}");
        }
        assert_eq!(found.at(10, 12)[0], 0);
    }

    #[test]
    fn reduced_masks_have_the_majority_of_each_square() {
        let wide = Mask::from_fn(9, 6, |x, y| x < 4 || (x == 5 && y > 2));
        let reduced = mask_of_print(&wide, MaskScale::enlarged(3));
        assert_eq!(
            reduced,
            Mask::from_fn(3, 2, |x, y| x == 0 || (x == 1 && y == 1))
        );
        assert_eq!(mask_of_print(&wide, MaskScale::Same), wide);
    }

    #[test]
    fn a_mask_of_a_reduced_print_covers_its_strokes() {
        let is_ink = |x: usize, y: usize| (30..85).contains(&x) && x.abs_diff(y) < 14;
        let print = Grid::from_fn(119, 121, |x, y| [u16::from(!is_ink(x, y)) * 60_000; 3]);
        let reduced = reduce(&print.into(), 4);
        assert_eq!([reduced.width(), reduced.height()], [30, 31]);
        let scale = MaskScale::Reduced(MaskReduction {
            times: NonZeroU32::new(4).expect("not zero"),
            print_px: [119, 121],
        });
        let mask = reduced.map(|colour| colour[0] < 30_000);
        let found = mask_of_print(&mask, scale);
        let wanted = Mask::from_fn(119, 121, is_ink);
        let wrong = found.zip_map(&wanted, |found, wanted| found != wanted);
        let (wrong, ink) = (wrong.count(), wanted.count());
        assert!(10 * wrong < ink, "{wrong} of {ink}");
        let full = Mask::new(30, 31, true);
        assert_eq!(mask_of_print(&full, scale), Mask::new(119, 121, true));
    }
}
