//! Two-dimensional transforms of the squares that are correlated.

use std::sync::Arc;

use mocban_fft::{Complex32, Fft};

/// Side of the squares that are correlated, pixels.
pub(super) const SIZE: usize = 256;

/// Returns the index in a spectrum, stored column by column, of frequency (u, v) turned back by quarter turns.
pub(super) const fn quarter_turned(u: usize, v: usize, turns: usize) -> usize {
    let (u_back, v_back) = ((SIZE - u) % SIZE, (SIZE - v) % SIZE);
    match turns {
        0 => u * SIZE + v,
        1 => v * SIZE + u_back,
        2 => u_back * SIZE + v_back,
        _ => v_back * SIZE + u,
    }
}

/// Two-dimensional transforms of squares.
pub(super) struct SquareFft {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
}

impl SquareFft {
    /// Plans the transforms.
    pub(super) fn new() -> Self {
        Self {
            forward: mocban_fft::forward(SIZE),
            inverse: mocban_fft::inverse(SIZE),
        }
    }

    /// Transforms a square in row-major order; the result is stored column by column.
    pub(super) fn forward(&self, square: &mut [Complex32]) {
        transform(&*self.forward, square);
    }

    /// Transforms a spectrum stored column by column back, without division by the number of pixels; the result is in
    /// row-major order.
    pub(super) fn inverse(&self, spectrum: &mut [Complex32]) {
        transform(&*self.inverse, spectrum);
    }
}

fn transform(fft: &dyn Fft<f32>, square: &mut [Complex32]) {
    let mut scratch = vec![Complex32::default(); fft.get_inplace_scratch_len()];
    fft.process_with_scratch(square, &mut scratch);
    transpose(square);
    fft.process_with_scratch(square, &mut scratch);
}

/// Swaps rows and columns of a square, tile by tile, so that both sides of a swap stay in the cache.
fn transpose(square: &mut [Complex32]) {
    const TILE: usize = 16;
    for top in (0..SIZE).step_by(TILE) {
        for left in (0..=top).step_by(TILE) {
            for y in top..top + TILE {
                for x in left..y.min(left + TILE) {
                    square.swap(y * SIZE + x, x * SIZE + y);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Complex32, SIZE, transpose};

    #[test]
    fn every_pixel_is_swapped_once() {
        let at = |x: usize, y: usize| Complex32::new(x as f32, y as f32);
        let places = || (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y)));
        let mut square: Vec<Complex32> = places().map(|(x, y)| at(x, y)).collect();
        transpose(&mut square);
        let expected: Vec<Complex32> = places().map(|(x, y)| at(y, x)).collect();
        assert_eq!(square, expected);
    }
}
