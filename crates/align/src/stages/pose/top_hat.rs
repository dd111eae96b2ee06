//! Removes wide plateaus from an image of strokes.

use mocban_core::raster::Grid;

/// Returns the white top-hat of an image: each value minus the opening with a square of `2 radius + 1` pixels. What is
/// narrower than the square in one direction keeps its value, and what is wider becomes 0. Pixels whose `known` is 0 count
/// as part of whatever is beside them, and are 0 in the result.
pub(super) fn top_hat(values: &Grid<f32>, known: &Grid<f32>, radius: usize) -> Grid<f32> {
    let or = |unknown: f32| {
        move |(value, known): (&f32, &f32)| if *known > 0.0 { *value } else { unknown }
    };
    let masked = |values: &Grid<f32>, unknown: f32| {
        let all = values.data().iter().zip(known.data()).map(or(unknown));
        Grid::from_vec(values.width(), values.height(), all.collect()).expect("the same size")
    };
    let eroded = filtered(&masked(values, f32::INFINITY), radius, f32::min);
    let opened = filtered(&masked(&eroded, f32::NEG_INFINITY), radius, f32::max);
    let hat = values.zip_map(&opened, |value, opened| (value - opened).max(0.0));
    masked(&hat, 0.0)
}

/// Returns the minimum or the maximum in the square around each pixel, as far as it lies in the image.
fn filtered(values: &Grid<f32>, radius: usize, choose: fn(f32, f32) -> f32) -> Grid<f32> {
    let rows = along_rows(values, radius, choose).transposed();
    along_rows(&rows, radius, choose).transposed()
}

fn along_rows(values: &Grid<f32>, radius: usize, choose: fn(f32, f32) -> f32) -> Grid<f32> {
    Grid::from_fn(values.width(), values.height(), |x, y| {
        let last = (x + radius).min(values.width() - 1);
        let near = &values.row(y)[x.saturating_sub(radius)..=last];
        near.iter().copied().reduce(choose).unwrap_or(0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::top_hat;
    use mocban_core::raster::Grid;

    #[test]
    fn plateaus_vanish_and_strokes_stay() {
        // A stroke of 4 px and a plateau of 20 px that reaches the end of the known area.
        let value = |x: usize, _| f32::from(u8::from((10..14).contains(&x) || x >= 40));
        let (values, known) = (
            Grid::from_fn(64, 30, value),
            Grid::from_fn(64, 30, |x, _| f32::from(u8::from(x < 60))),
        );
        let hat = top_hat(&values, &known, 5);
        for (x, expected) in [(12, 1.0), (20, 0.0), (45, 0.0), (58, 0.0), (62, 0.0)] {
            assert_eq!(hat.at(x, 15), expected, "{x}");
        }
    }
}
