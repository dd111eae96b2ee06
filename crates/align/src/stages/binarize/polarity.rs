//! Polarity of the print: whether ink is darker or lighter than the background.

use mocban_core::raster::otsu::Split;
use mocban_core::raster::{Grid, Mask};

/// If the sum of the evidence is below minus this value, ink is clearly darker than the background.
const CLEAR: f64 = 0.8;
/// If the sum of the evidence is above this value, ink is clearly lighter than the background, as in rubbings. A print
/// with heavy dark ink and a frame can have a positive sum, but a smaller one.
const CLEAR_LIGHT: f64 = 1.6;
/// Width of the rim that counts as evidence for the background, as a fraction of the image's shorter side.
const RIM: f64 = 0.06;

/// Returns whether ink is probably lighter than the background, and whether the polarity is clear. The polarity is
/// unclear if the evidence is weak, or if the image and `even`, the image divided by its background, disagree.
pub(super) fn polarity(
    even: &Grid<f32>,
    levelled: Option<Split>,
    dark: &Mask,
    known: &Mask,
) -> (bool, bool) {
    let plain = background_darkness(dark, known);
    let levelled = levelled.map_or(plain, |split| {
        background_darkness(&even.map(|g| f64::from(*g) < split.threshold), known)
    });
    let sum = plain + levelled;
    let clear = if sum > 0.0 { CLEAR_LIGHT } else { CLEAR };
    (sum > 0.0, plain * levelled > 0.0 && sum.abs() > clear)
}

/// Returns evidence that is positive if the dark class is the background, and negative if it is ink. The background is
/// assumed to be the larger class (weight 2) and to cover most of the rim (weight 1). Heavy ink breaks the first
/// assumption, and border lines break the second.
pub(super) fn background_darkness(dark: &Mask, known: &Mask) -> f64 {
    let of_known = known.count().max(1) as f64;
    let pairs = dark.data().iter().zip(known.data());
    let share = pairs.filter(|(d, k)| **d && **k).count() as f64 / of_known;
    2.0 * (share - 0.5) + (rim_share(dark, known) - 0.5)
}

/// Returns the fraction of pixels of a mask in the rim of the known area, 0..=1.
pub(crate) fn rim_share(dark: &Mask, known: &Mask) -> f64 {
    let (width, height) = (known.width(), known.height());
    let reach = ((width.min(height) as f64 * RIM).round() as usize).max(1);
    let (mut rim, mut of_it) = (0_usize, 0_usize);
    let mut inner = vec![false; width];
    for y in 0..height {
        let row = known.row(y);
        inner.fill(false);
        if y >= reach && y + reach < height && width > 2 * reach {
            let (above, below) = (known.row(y - reach), known.row(y + reach));
            for x in reach..width - reach {
                inner[x] = row[x - reach] & row[x + reach] & above[x] & below[x];
            }
        }
        let at_rim = row.iter().zip(&inner).map(|(known, inner)| known & !inner);
        for (at_rim, dark) in at_rim.zip(dark.row(y)) {
            rim += usize::from(at_rim);
            of_it += usize::from(at_rim & dark);
        }
    }
    if rim == 0 {
        0.0
    } else {
        of_it as f64 / rim as f64
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{RIM, rim_share};
    use mocban_core::raster::Mask;

    proptest! {
        #[test]
        fn rim_pixels_have_an_unknown_pixel_within_reach(
            [width, height] in [1_usize..60, 1_usize..60],
            cut in 0_usize..50,
            seed in 1_u64..99,
        ) {
            let known = Mask::from_fn(width, height, |x, y| x + y >= cut);
            let dark = Mask::from_fn(width, height, |x, y| (x as u64 * seed + y as u64).is_multiple_of(3));
            let reach = ((width.min(height) as f64 * RIM).round() as i64).max(1);
            let is_rim = |x: usize, y: usize| {
                let near = [(reach, 0), (-reach, 0), (0, reach), (0, -reach)];
                let unknown = |(dx, dy): (i64, i64)| {
                    !known.get(x as i64 + dx, y as i64 + dy).unwrap_or(false)
                };
                known.at(x, y) && near.into_iter().any(unknown)
            };
            let rim = Mask::from_fn(width, height, is_rim);
            let both = Mask::from_fn(width, height, |x, y| is_rim(x, y) && dark.at(x, y));
            let share = both.count() as f64 / rim.count().max(1) as f64;
            prop_assert_eq!(rim_share(&dark, &known), share);
        }
    }
}
