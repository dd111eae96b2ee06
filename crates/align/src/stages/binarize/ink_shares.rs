//! Divides the pixels of a small print into ink and background.
//!
//! A pixel of a small print is about as wide as a stroke, and its grey is the mean of the area that it covers. A threshold
//! of the enlarged print widens dark strokes and loses pale ones. Here, each pixel keeps its share of ink.

use super::ink::InkMask;
use mocban_core::raster::components::remove_specks;
use mocban_core::raster::{Grid, Mask};

/// Quantile of the dark pixels that counts as full ink; few pixels are covered fully.
const FULL_INK: f64 = 0.05;
/// Part of the pixels above the threshold that are darker than the background: those at the edges of strokes.
const BACKGROUND: f64 = 0.6;
/// Part of the pixels above the threshold that are darker than the lightest background.
const LIGHTEST: f64 = 0.95;
/// Smaller shares are noise of the background.
const LEAST_SHARE: f64 = 0.1;

/// Replaces the ink of an enlarged print: in each square of `times` by `times` pixels, which shows one pixel of the print,
/// as many pixels are ink as the mean grey of the square demands, the darkest ones. Leaves the ink unchanged if the grey of
/// the whole print is not known.
pub(crate) fn keep_shares(ink: &mut InkMask, times: usize) {
    let Some(even) = ink.even.take() else { return };
    let known = &ink.soft.known;
    let squares = Squares {
        even: &even,
        known,
        times,
    };
    let means = squares.means();
    let sorted = |is_dark: bool| {
        let values = means.data().iter().flatten().copied();
        let mut values: Vec<f64> = values
            .filter(|mean| (*mean < ink.threshold) == is_dark)
            .collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let [dark, light] = [true, false].map(sorted);
    let (Some(full), Some(background), Some(lightest)) = (
        at(&dark, FULL_INK),
        at(&light, BACKGROUND),
        at(&light, LIGHTEST),
    ) else {
        return;
    };
    let span = (background - full).max(1e-6);
    let least = LEAST_SHARE.max((lightest - background) / span);
    let mut raw = Mask::new(even.width(), even.height(), false);
    for (square, mean) in means.data().iter().enumerate() {
        let share = mean.map_or(0.0, |mean| ((background - mean) / span).clamp(0.0, 1.0));
        if share >= least {
            let at = [square % means.width(), square / means.width()];
            squares.fill(&mut raw, at, share);
        }
    }
    let kept = remove_specks(&raw, known.count());
    if kept.count() == 0 {
        return;
    }
    ink.specks = raw.zip_map(&kept, |raw, ink| raw && !ink);
    ink.soft.amount =
        even.map(|even| ((background - f64::from(*even)) / span).clamp(0.0, 1.0) as f32);
    ink.mask = kept;
}

/// Returns the value below which a part of the sorted values lies.
fn at(sorted: &[f64], part: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((last as f64 * part).round() as usize).copied()
}

/// The squares of an enlarged print that show one pixel each.
struct Squares<'a> {
    even: &'a Grid<f32>,
    known: &'a Mask,
    times: usize,
}

impl Squares<'_> {
    /// Returns the mean grey of the known pixels of each square, `None` if half of them or more are unknown.
    fn means(&self) -> Grid<Option<f64>> {
        let [width, height] = [self.even.width(), self.even.height()].map(|side| side / self.times);
        Grid::from_fn(width, height, |x, y| {
            let pixels = self.pixels([x, y]);
            let known: Vec<f64> = pixels.map(|[x, y]| f64::from(self.even.at(x, y))).collect();
            let is_enough = 2 * known.len() > self.times * self.times;
            is_enough.then(|| known.iter().sum::<f64>() / known.len() as f64)
        })
    }

    /// Sets the darkest pixels of a square, so that they cover a share of it.
    fn fill(&self, mask: &mut Mask, square: [usize; 2], share: f64) {
        let mut pixels: Vec<[usize; 2]> = self.pixels(square).collect();
        let grey = |[x, y]: &[usize; 2]| self.even.at(*x, *y);
        pixels.sort_by(|a, b| grey(a).total_cmp(&grey(b)));
        let count = (share * (self.times * self.times) as f64).round() as usize;
        let width = mask.width();
        for [x, y] in pixels.into_iter().take(count) {
            mask.data_mut()[y * width + x] = true;
        }
    }

    /// Returns the known pixels of a square.
    fn pixels(&self, [x, y]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> + use<'_> {
        let side = self.times;
        let all = (0..side * side).map(move |k| [x * side + k % side, y * side + k / side]);
        all.filter(|[x, y]| self.known.at(*x, *y))
    }
}
