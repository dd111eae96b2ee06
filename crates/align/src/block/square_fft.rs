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
    for y in 0..SIZE {
        for x in 0..y {
            square.swap(y * SIZE + x, x * SIZE + y);
        }
    }
    fft.process_with_scratch(square, &mut scratch);
}
