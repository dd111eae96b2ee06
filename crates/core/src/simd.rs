//! Runtime SIMD dispatch, and scalar operations that vectorise.
//!
//! The program is compiled for the baseline of its architecture. Dispatched code is compiled for newer instruction sets
//! too, and the variant for the processor is selected at run time. All variants compute the same bits, because no
//! operations are fused or reordered.

/// Evaluates an expression with the widest instruction set of the processor. Only inlined code benefits, so mark the
/// functions that the expression calls `#[inline(always)]`.
#[macro_export]
macro_rules! dispatch {
    ($work:expr) => {
        $crate::simd::run_widest(
            #[inline(always)]
            || $work,
        )
    };
}
pub use dispatch;

/// Runs a closure for [`dispatch`]. Because of the bound, the compiler treats the closure as a plain `FnOnce`. Other
/// closures are called through a function that is not inlined, and so is not compiled for the wide instructions.
#[inline(always)]
pub fn run_widest<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// Returns the smaller number by one SIMD comparison. `f32::min` takes more instructions, because it handles NaN.
#[inline(always)]
pub fn min_f32(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Like [`min_f32`], in double precision.
#[inline(always)]
pub fn min_f64(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Like [`min_f32`], for the larger number.
#[inline(always)]
pub fn max_f32(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Floats of this magnitude (1.5 x 2^23) have no fraction bits.
const INTEGER_BIAS: f32 = 12_582_912.0;

/// Rounds down a number that is small compared with `INTEGER_BIAS`. Casts and `floor` would not vectorise.
#[inline(always)]
pub fn floor_f32(v: f32) -> f32 {
    let nearest = (v + INTEGER_BIAS) - INTEGER_BIAS;
    if nearest > v { nearest - 1.0 } else { nearest }
}

/// Rounds up a number that is small compared with `INTEGER_BIAS`.
#[inline(always)]
pub fn ceil_f32(v: f32) -> f32 {
    let nearest = (v + INTEGER_BIAS) - INTEGER_BIAS;
    if nearest < v { nearest + 1.0 } else { nearest }
}

/// Converts a whole number in 0..2^22 to an integer.
#[inline(always)]
pub fn index_from_f32(whole: f32) -> u32 {
    (whole + INTEGER_BIAS).to_bits() - INTEGER_BIAS.to_bits()
}

#[cfg(test)]
mod tests {

    #[inline(always)]
    fn sums(values: &[f32]) -> [u32; 8] {
        let mut sums = [0.1_f32; 8];
        for run in values.as_chunks::<8>().0 {
            for k in 0..8 {
                sums[k] += run[k] * run[k] * 1.1 + run[7 - k] / 3.0;
            }
        }
        sums.map(f32::to_bits)
    }

    #[test]
    fn wide_and_narrow_give_the_same_bits() {
        let values: Vec<f32> = (0..4096).map(|k| (k as f32 * 0.7).sin()).collect();
        let wide = dispatch!(sums(&values));
        assert_eq!(wide, sums(&values));
    }

    #[test]
    fn a_panic_comes_through() {
        let none: Vec<f32> = Vec::new();
        let caught = std::panic::catch_unwind(|| dispatch!(none[3]));
        assert!(caught.is_err());
    }
}
