//! Values of the known pixels of a print, of which a large print has more than thresholds need.

use mocban_core::domain::cancel::poll;
use mocban_core::raster::{Grid, Mask};

/// Most values that are sorted for a threshold or a median, which more values hardly change.
const MOST_VALUES: usize = 1 << 17;

/// Returns values of the known pixels, from which thresholds are found: all, or about [`MOST_VALUES`] of a large print.
pub(super) fn held(grey: &Grid<f32>, known: &Mask) -> Vec<f32> {
    sampled(grey, known, MOST_VALUES, |value| value)
}

/// Returns values of known pixels of a grid, at most about `most`, at equal distances in both directions.
pub(super) fn sampled<T: Copy, U>(
    grid: &Grid<T>,
    known: &Mask,
    most: usize,
    value: impl Fn(T) -> U,
) -> Vec<U> {
    let step = (known.count().div_ceil(most) as f64).sqrt().ceil().max(1.0) as usize;
    let mut values = Vec::new();
    for y in (step / 2..grid.height()).step_by(step) {
        poll();
        let pixels = grid.row(y).iter().zip(known.row(y)).skip(step / 2);
        let held = pixels.step_by(step).filter(|(_, known)| **known);
        values.extend(held.map(|(pixel, _)| value(*pixel)));
    }
    values
}

#[cfg(test)]
mod tests {
    use super::sampled;
    use mocban_core::raster::{Grid, Mask};

    #[test]
    fn samples_spread_over_a_print_of_any_width() {
        let grid = Grid::from_fn(500, 500, |x, y| (x, y));
        let found = sampled(&grid, &Mask::new(500, 500, true), 2_500, |at| at);
        let distinct = |of: &dyn Fn(&(usize, usize)) -> usize| {
            let places: std::collections::BTreeSet<usize> = found.iter().map(of).collect();
            places.len()
        };
        let (columns, rows) = (distinct(&|at| at.0), distinct(&|at| at.1));
        assert!(columns >= 45 && rows >= 45, "{columns} x {rows}");
        assert!(found.len() <= 2_500, "{}", found.len());
    }
}
