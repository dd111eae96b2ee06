//! Enlarges colours a whole number of times, and reduces masks of the enlarged size again.

use super::{Grid, Mask};
use crate::domain::Affine2;
use crate::domain::cancel::poll;

/// Enlarges colours `times` times by cubic interpolation (Catmull-Rom). Beyond the border, the colours of the border
/// continue. For the map of the pixels, see [`original_from_enlarged`].
///
/// ```
/// use mocban_core::raster::{Grid, enlarge};
///
/// let step = Grid::from_fn(4, 1, |x, _| [if x < 2 { 10_000 } else { 30_000 }; 3]);
/// let found = enlarge(&step, 2);
/// assert_eq!([found.width(), found.height()], [8, 2]);
/// // Steeper than linear interpolation, which gives 15,000 and 25,000.
/// let row: Vec<u16> = found.row(0).iter().map(|c| c[0]).collect();
/// assert_eq!(row[3..5], [14_063, 25_938]);
/// ```
pub fn enlarge(rgb: &Grid<[u16; 3]>, times: u32) -> Grid<[u16; 3]> {
    if rgb.data().is_empty() {
        return rgb.clone();
    }
    let values = rgb.map(|colour| colour.map(f32::from));
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

/// Returns the map from pixels of an image that was enlarged `times` times to pixels of the original. Pixel centres have
/// whole coordinates.
pub fn original_from_enlarged(times: u32) -> Affine2 {
    let times = f64::from(times);
    Affine2::scale_shift(1.0 / times, [(1.0 - times) / (2.0 * times); 2])
}

/// Returns the map from pixels of an image to pixels of the same image enlarged `times` times.
pub fn enlarged_from_original(times: u32) -> Affine2 {
    let times = f64::from(times);
    Affine2::scale_shift(times, [(times - 1.0) / 2.0; 2])
}

/// Reduces a mask of an image that was enlarged `times` times to the size of the original: pixels are set if at least
/// half of their area is.
pub fn reduce_mask(mask: &Mask, times: u32) -> Mask {
    let side = times.max(1) as usize;
    if side == 1 {
        return mask.clone();
    }
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
    use super::{enlarge, enlarged_from_original, original_from_enlarged, reduce_mask};
    use crate::raster::{Grid, Mask};

    #[test]
    fn enlarged_ramps_are_ramps_in_the_frame_of_the_maps() {
        let ramp = Grid::from_fn(9, 7, |x, y| [1000 * x as u16, 3000 * y as u16, 500]);
        for times in [1, 2, 3, 5] {
            let found = enlarge(&ramp, times);
            assert_eq!(
                [found.width(), found.height()],
                [9, 7].map(|side| side * times as usize)
            );
            let map = original_from_enlarged(times);
            let inner = |side: u32| 2 * times..(side - 2) * times;
            for (x, y) in inner(9).flat_map(|x| inner(7).map(move |y| (x, y))) {
                let place = [x, y].map(f64::from);
                let [u, v] = map.apply(place);
                let back = enlarged_from_original(times).apply([u, v]);
                assert!((back[0] - place[0]).abs() < 1e-9 && (back[1] - place[1]).abs() < 1e-9);
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
        let found = enlarge(&line, 3);
        // Beside the dark line, the interpolation exceeds white.
        for x in [5, 6, 14, 15] {
            assert_eq!(found.at(x, 12)[0], u16::MAX, "{x}");
        }
        assert_eq!(found.at(10, 12)[0], 0);
    }

    #[test]
    fn reduced_masks_have_the_majority_of_each_square() {
        let wide = Mask::from_fn(9, 6, |x, y| x < 4 || (x == 5 && y > 2));
        let reduced = reduce_mask(&wide, 3);
        assert_eq!(
            reduced,
            Mask::from_fn(3, 2, |x, y| x == 0 || (x == 1 && y == 1))
        );
        assert_eq!(reduce_mask(&wide, 1), wide);
    }
}
