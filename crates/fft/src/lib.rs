//! Fourier transforms of lengths that are powers of two.
//!
//! `rustfft` is generic, so its code is compiled into each crate that makes a plan, and again into the tests of that
//! crate: a quarter of the LLVM code of the alignment. Here it is compiled once.
//!
//! **Invariant:** nothing here is generic.

use std::sync::Arc;

use rustfft::algorithm::Radix4;
use rustfft::{FftDirection, FftPlannerAvx};

pub use rustfft::Fft;
pub use rustfft::num_complex::Complex32;

/// Returns the transform of the given length, a power of two, with AVX if the processor has it.
///
/// The transform is rounded differently on different processors. `FftPlanner` is not used, because it would compile
/// every algorithm of the library.
#[must_use]
pub fn forward(length: usize) -> Arc<dyn Fft<f32>> {
    plan(length, FftDirection::Forward)
}

/// Returns the inverse of [`forward`], without division by the length.
#[must_use]
pub fn inverse(length: usize) -> Arc<dyn Fft<f32>> {
    plan(length, FftDirection::Inverse)
}

fn plan(length: usize, direction: FftDirection) -> Arc<dyn Fft<f32>> {
    match FftPlannerAvx::new() {
        Ok(mut planner) => planner.plan_fft(length, direction),
        Err(()) => Arc::new(Radix4::new(length, direction)),
    }
}
