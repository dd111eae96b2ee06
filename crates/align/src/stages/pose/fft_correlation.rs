//! Cross-correlation of small squares by FFT.

use std::sync::Arc;

use mocban_fft::{Complex32, Fft};

/// Side of the squares that are correlated, pixels.
pub(super) const FFT_SIZE: usize = 32;

/// Returns the shift with the highest correlation, and that correlation. The shift is in pixels, at most `max_shift_px`
/// along each axis. If `part` is 0, the real part of the surface is used: the correlation of the loaded square. If
/// `part` is 1, the imaginary part is used: the correlation of that square rotated by 180 degrees.
///
/// The surface is stored reversed: the value for shift s is at index -s, modulo the size.
pub(super) fn best_shift(surface: &[Complex32], part: usize, max_shift_px: i64) -> ([f64; 2], f32) {
    // The size is a power of two, so wrapped numbers have the right remainder.
    let place = |shift: i64| shift.wrapping_neg() as usize % FFT_SIZE;
    let value_of = |value: &Complex32| if part == 0 { value.re } else { value.im };
    let mut best = ([0; 2], f32::NEG_INFINITY);
    let count = 2 * max_shift_px + 1;
    let shifts = || (0..count).map(|k| k - max_shift_px);
    for dy in shifts() {
        let row = &surface[place(dy) * FFT_SIZE..][..FFT_SIZE];
        for dx in shifts() {
            let value = value_of(&row[place(dx)]);
            if value > best.1 {
                best = ([dx, dy], value);
            }
        }
    }
    (best.0.map(|shift| shift as f64), best.1)
}

/// Two-dimensional FFTs of a square, with reusable buffers.
///
/// Spectra are stored column by column. This saves a transposition in each direction.
pub(super) struct FftCorrelator {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    scratch: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    product: Vec<Complex32>,
}

impl FftCorrelator {
    pub(super) fn new() -> Self {
        // An FFT is rounded differently on different processors. This can only change the order of nearly equal peaks.
        let (forward, inverse) = (mocban_fft::forward(FFT_SIZE), mocban_fft::inverse(FFT_SIZE));
        let scratch_len = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        let empty = Complex32::new(0.0, 0.0);
        Self {
            forward,
            inverse,
            scratch: vec![empty; scratch_len],
            spectrum: vec![empty; FFT_SIZE * FFT_SIZE],
            product: vec![empty; FFT_SIZE * FFT_SIZE],
        }
    }

    /// Returns the complex conjugate of a real square's spectrum, divided by the number of pixels. The inverse
    /// transform of its product with another spectrum is the correlation of the two squares.
    pub(super) fn target_spectrum(&mut self, values: &[f32]) -> Vec<Complex32> {
        for (out, value) in self.spectrum.iter_mut().zip(values) {
            *out = Complex32::new(*value, 0.0);
        }
        fft_2d(&*self.forward, &mut self.spectrum, &mut self.scratch);
        let scale = 1.0 / (FFT_SIZE * FFT_SIZE) as f32;
        self.spectrum.iter().map(|v| v.conj() * scale).collect()
    }

    /// Loads a real square. Its copy rotated by 180 degrees is loaded as the imaginary part, so that one transform
    /// computes the spectra of both squares.
    pub(super) fn load(&mut self, values: &[f32]) {
        for y in 0..FFT_SIZE {
            let back = (FFT_SIZE - y) % FFT_SIZE * FFT_SIZE;
            for x in 0..FFT_SIZE {
                let opposite = values[back + (FFT_SIZE - x) % FFT_SIZE];
                self.spectrum[y * FFT_SIZE + x] =
                    Complex32::new(values[y * FFT_SIZE + x], opposite);
            }
        }
        fft_2d(&*self.forward, &mut self.spectrum, &mut self.scratch);
    }

    /// Rotates the loaded square by 90 degrees, from x to y, by rotating its spectrum.
    pub(super) fn rotate_quarter(&mut self) {
        // Column-major: column u, row v is at u * FFT_SIZE + v.
        for u in 0..FFT_SIZE {
            for v in 0..FFT_SIZE {
                self.product[u * FFT_SIZE + v] =
                    self.spectrum[v * FFT_SIZE + (FFT_SIZE - u) % FFT_SIZE];
            }
        }
        std::mem::swap(&mut self.spectrum, &mut self.product);
    }

    /// Returns the correlation of the loaded square with a target. If `mirrored` is set, the square is mirrored along
    /// x, by reading its spectrum backwards along x.
    ///
    /// Mirroring leaves the middle of the square, column `FFT_SIZE / 2`, in place. The result is stored reversed: the
    /// value for shift s is at index -s, modulo the size.
    pub(super) fn correlate(&mut self, target: &[Complex32], mirrored: bool) -> &[Complex32] {
        let columns = self.product.chunks_exact_mut(FFT_SIZE);
        for (x, (out, target)) in columns.zip(target.chunks_exact(FFT_SIZE)).enumerate() {
            let from = if mirrored {
                (FFT_SIZE - x) % FFT_SIZE
            } else {
                x
            } * FFT_SIZE;
            let column = &self.spectrum[from..from + FFT_SIZE];
            for ((out, a), b) in out.iter_mut().zip(column).zip(target) {
                *out = a * b;
            }
        }
        fft_2d(&*self.inverse, &mut self.product, &mut self.scratch);
        &self.product
    }
}

/// Transforms along both axes; the result is transposed.
fn fft_2d(fft: &dyn Fft<f32>, data: &mut [Complex32], scratch: &mut [Complex32]) {
    fft.process_with_scratch(data, scratch);
    transpose(data);
    fft.process_with_scratch(data, scratch);
}

fn transpose(data: &mut [Complex32]) {
    for y in 0..FFT_SIZE {
        for x in 0..y {
            data.swap(y * FFT_SIZE + x, x * FFT_SIZE + y);
        }
    }
}
