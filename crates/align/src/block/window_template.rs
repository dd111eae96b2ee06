//! Normalized cross-correlation of one window of the relief with the ink at many shifts.

use super::window_images::{LANES, ShrunkRelief, WarpedInk, Window};
use mocban_core::simd::dispatch;

/// Windows need this fraction of their pixels on the face and on the page.
const MIN_SHARE: f32 = 0.35;
/// Windows need this variance of the relief: about one stroke.
const MIN_VARIANCE: f32 = 0.01;

/// The relief of a window minus its mean; 0 outside the face and the page.
pub(super) struct WindowTemplate {
    values: Vec<f32>,
    norm: f32,
    /// Middle of the pixels that count, mm.
    pub(super) centre: [f64; 2],
    /// Number of pixels that count, and the weights of all pixels unless each one counts.
    all: f32,
    weights: Option<Vec<f32>>,
}

impl WindowTemplate {
    /// Prepares a window; `None` if it has too little face, page or relief.
    pub(super) fn of(relief: &ShrunkRelief, warped: &WarpedInk, window: Window) -> Option<Self> {
        let [columns, rows] = window.size;
        let mut values = Vec::with_capacity(columns * rows);
        let mut weights = Vec::with_capacity(columns * rows);
        let (mut sum, mut squares, mut count) = (0.0_f64, 0.0_f64, 0_usize);
        let mut middle = [0.0_f64; 2];
        for y in window.first[1]..window.first[1] + rows {
            for x in window.first[0]..window.first[0] + columns {
                let border = warped.border;
                let counts = relief.face.at(x, y) && warped.on_page.at(x + border, y + border);
                let value = if counts { relief.soft.at(x, y) } else { 0.0 };
                if counts {
                    sum += f64::from(value);
                    squares += f64::from(value * value);
                    count += 1;
                    middle[0] += x as f64;
                    middle[1] += y as f64;
                }
                values.push(value);
                weights.push(f32::from(u8::from(counts)));
            }
        }
        let all = count as f64;
        if (count as f32) < MIN_SHARE * (columns * rows) as f32 {
            return None;
        }
        let mean = sum / all;
        let variance = squares / all - mean * mean;
        if variance < f64::from(MIN_VARIANCE) {
            return None;
        }
        for (value, weight) in values.iter_mut().zip(&weights) {
            *value = (*value - mean as f32) * weight;
        }
        let position = |k: usize| relief.origin_mm[k] + middle[k] / all * relief.pixel_mm;
        Some(Self {
            values,
            norm: (variance * all).sqrt() as f32,
            centre: [position(0), position(1)],
            all: count as f32,
            weights: (count < columns * rows).then_some(weights),
        })
    }

    /// Returns the normalized cross-correlation at each shift, row by row.
    pub(super) fn scores(&self, warped: &WarpedInk, window: Window, reach: usize) -> Vec<f32> {
        let side = 2 * reach + 1;
        let mut scores = vec![-1.0_f32; side * side];
        let width = warped.ink.width();
        let [left, top] = window.first.map(|first| first + warped.border - reach);
        let ink = &warped.ink.data()[top * width + left..];
        // Without weights, the sums of all shifts come from one table.
        let table = self
            .weights
            .is_none()
            .then(|| SumTable::of(ink, width, window.size, side));
        for dy in 0..side {
            for shift in (0..side).step_by(LANES) {
                let ink = &ink[dy * width + shift..];
                let (products, sums, squares) = match (&self.weights, &table) {
                    (Some(weights), _) => {
                        let [products, sums, squares] = dispatch!(weighted_sums(
                            &self.values,
                            weights,
                            window.size,
                            ink,
                            width
                        ));
                        (products, sums, squares)
                    }
                    (None, table) => {
                        let products =
                            dispatch!(sums_of_products(&self.values, window.size, ink, width));
                        let last = side - 1;
                        let at = |k: usize| {
                            table
                                .as_ref()
                                .map_or([0.0; 2], |t| t.sums((shift + k).min(last), dy))
                        };
                        let sums: [[f32; 2]; LANES] = std::array::from_fn(at);
                        (
                            products,
                            sums.map(|[sum, _]| sum),
                            sums.map(|[_, squares]| squares),
                        )
                    }
                };
                for k in 0..LANES.min(side - shift) {
                    let energy = squares[k] - sums[k] * sums[k] / self.all;
                    if energy > 1e-3 * self.all {
                        scores[dy * side + shift + k] = products[k] / (self.norm * energy.sqrt());
                    }
                }
            }
        }
        scores
    }
}

/// Sums of ink and of its squares over rectangles: a summed-area table of the reach of one window.
struct SumTable {
    width: usize,
    size: [usize; 2],
    /// Sums over all pixels above and to the left.
    sums: Vec<[f64; 2]>,
}

impl SumTable {
    fn of(ink: &[f32], ink_width: usize, size: [usize; 2], side: usize) -> Self {
        let width = size[0] + side;
        let height = size[1] + side;
        let mut sums = vec![[0.0; 2]; width * height];
        for y in 1..height {
            let mut along = [0.0_f64; 2];
            for x in 1..width {
                let value = f64::from(ink[(y - 1) * ink_width + x - 1]);
                along = [along[0] + value, along[1] + value * value];
                let above = sums[(y - 1) * width + x];
                sums[y * width + x] = [above[0] + along[0], above[1] + along[1]];
            }
        }
        Self { width, size, sums }
    }

    /// Returns the sums of the window shifted by (x, y).
    fn sums(&self, x: usize, y: usize) -> [f32; 2] {
        let at = |x: usize, y: usize| self.sums[y * self.width + x];
        let (right, bottom) = (x + self.size[0], y + self.size[1]);
        let corners = [at(right, bottom), at(x, y), at(x, bottom), at(right, y)];
        [0, 1]
            .map(|k: usize| (corners[0][k] + corners[1][k] - corners[2][k] - corners[3][k]) as f32)
    }
}

/// Returns the sums of template times ink for [`LANES`] shifts to the right.
#[inline(always)]
fn sums_of_products(
    template: &[f32],
    [columns, _]: [usize; 2],
    ink: &[f32],
    ink_width: usize,
) -> [f32; LANES] {
    let mut products = [0.0; LANES];
    for (y, template) in template.chunks_exact(columns).enumerate() {
        let row = &ink[y * ink_width..][..columns + LANES];
        for (x, value) in template.iter().enumerate() {
            let pixels: &[f32; LANES] = row[x..x + LANES].try_into().expect("a run of pixels");
            for k in 0..LANES {
                products[k] += value * pixels[k];
            }
        }
    }
    products
}

/// Returns the sums of template times ink, of the ink, and of its squares, for [`LANES`] shifts to the right. Only pixels
/// with a weight count.
#[inline(always)]
fn weighted_sums(
    template: &[f32],
    weights: &[f32],
    [columns, _]: [usize; 2],
    ink: &[f32],
    ink_width: usize,
) -> [[f32; LANES]; 3] {
    let (mut products, mut sums, mut squares) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let rows = template
        .chunks_exact(columns)
        .zip(weights.chunks_exact(columns));
    for (y, (template, weights)) in rows.enumerate() {
        let row = &ink[y * ink_width..][..columns + LANES];
        for (x, (value, weight)) in template.iter().zip(weights).enumerate() {
            let pixels: &[f32; LANES] = row[x..x + LANES].try_into().expect("a run of pixels");
            for k in 0..LANES {
                let counted = weight * pixels[k];
                products[k] += value * pixels[k];
                sums[k] += counted;
                squares[k] += counted * pixels[k];
            }
        }
    }
    [products, sums, squares]
}

#[cfg(test)]
mod tests {
    use super::super::test_world::shifted_world;
    use super::super::window_images::{WarpedInk, Window};
    use super::{SumTable, WindowTemplate};

    #[test]
    fn scores_are_those_of_the_definition() {
        let (relief, page, map) = shifted_world(2);
        let reach = 5;
        let warped = WarpedInk::of(&relief, &page, &map, WarpedInk::border_for(reach));
        // The second window hangs over the edge of the face.
        for first in [[100, 80], [0, 0]] {
            let window = Window {
                first,
                size: [41, 37],
            };
            let template = WindowTemplate::of(&relief, &warped, window).unwrap();
            let scores = template.scores(&warped, window, reach);
            for (dx, dy) in [(0, 0), (5, 5), (10, 3), (7, 10)] {
                let mut sums = [0.0_f64; 6];
                for y in 0..37 {
                    for x in 0..41 {
                        let (column, row) = (first[0] + x, first[1] + y);
                        let border = warped.border;
                        if !relief.face.at(column, row)
                            || !warped.on_page.at(column + border, row + border)
                        {
                            continue;
                        }
                        let t = f64::from(relief.soft.at(column, row));
                        let i = f64::from(
                            warped
                                .ink
                                .at(column + border + dx - reach, row + border + dy - reach),
                        );
                        for (sum, value) in sums.iter_mut().zip([1.0, t, i, t * t, i * i, t * i]) {
                            *sum += value;
                        }
                    }
                }
                let [n, t, i, tt, ii, ti] = sums;
                let expected = (ti - t * i / n) / ((tt - t * t / n) * (ii - i * i / n)).sqrt();
                let found = f64::from(scores[dy * 11 + dx]);
                assert!((found - expected).abs() < 1e-3, "{found} {expected}");
            }
        }
    }

    #[test]
    fn sums_of_rectangles_come_from_the_table() {
        let ink: Vec<f32> = (0..400).map(|k| (k % 7) as f32 / 7.0).collect();
        let table = SumTable::of(&ink, 20, [6, 5], 8);
        let mut expected = [0.0; 2];
        for y in 3..8 {
            for x in 2..8 {
                let value = ink[y * 20 + x];
                expected = [expected[0] + value, expected[1] + value * value];
            }
        }
        let found = table.sums(2, 3);
        assert!((found[0] - expected[0]).abs() < 1e-4 && (found[1] - expected[1]).abs() < 1e-4);
    }
}
