//! Values of the known pixels of a print, of which a large print has more than thresholds need.

use mocban_core::domain::cancel::poll;
use mocban_core::raster::{Grid, Mask};

/// Most values that are sorted for a threshold or a median, which more values hardly change.
const MOST_VALUES: usize = 1 << 17;

/// Returns values of the known pixels, from which thresholds are found: all, or about [`MOST_VALUES`] of a large print.
pub(super) fn held(grey: &Grid<f32>, known: &Mask) -> Vec<f32> {
    sampled(known, MOST_VALUES, |x, y| grey.at(x, y))
}

/// Returns values of known pixels, at most about `most`, at equal distances in both directions. `value` returns the value of
/// column x, row y.
pub(super) fn sampled<T>(known: &Mask, most: usize, value: impl Fn(usize, usize) -> T) -> Vec<T> {
    let step = (known.count().div_ceil(most) as f64).sqrt().ceil().max(1.0) as usize;
    let mut values = Vec::new();
    for y in (step / 2..known.height()).step_by(step) {
        poll();
        let pixels = known.row(y).iter().enumerate().skip(step / 2).step_by(step);
        values.extend(
            pixels
                .filter(|(_, known)| **known)
                .map(|(x, _)| value(x, y)),
        );
    }
    values
}

#[cfg(test)]
mod tests {
    use super::sampled;
    use mocban_core::raster::Mask;

    #[test]
    fn samples_spread_over_a_print_of_any_width() {
        let found = sampled(&Mask::new(500, 500, true), 2_500, |x, y| (x, y));
        let distinct = |of: &dyn Fn(&(usize, usize)) -> usize| {
            let places: std::collections::BTreeSet<usize> = found.iter().map(of).collect();
            places.len()
        };
        let (columns, rows) = (distinct(&|at| at.0), distinct(&|at| at.1));
        assert!(columns >= 45 && rows >= 45, "{columns} x {rows}");
        assert!(found.len() <= 2_500, "{}", found.len());
    }
}
