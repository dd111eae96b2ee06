//! Loops over numbers side by side, on as many at a time as the processor can.
//!
//! The program is built for the oldest processors of its kind. What is called here is built a second time for newer
//! ones, and chosen when it runs. Both compute the same to the bit: nothing is fused or reordered.

/// Runs `work` with the widest instructions that the processor has. Only what is inlined into it gains: mark it, and the
/// functions that it calls, `#[inline(always)]`.
#[inline(always)]
pub(crate) fn dispatch<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// Plain comparisons, which are one instruction for many lanes; `f32::min` minds what is not a number.
#[inline(always)]
pub(crate) fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(crate) fn higher(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Numbers of this size have no bits for parts of one.
const WHOLE: f32 = 12_582_912.0;

/// The whole number at or below one that is small beside [`WHOLE`]. Casts and `floor` are not computed side by side.
#[inline(always)]
pub(crate) fn whole_below(v: f32) -> f32 {
    let nearest = (v + WHOLE) - WHOLE;
    if nearest > v { nearest - 1.0 } else { nearest }
}

/// The whole number at or above one that is small beside [`WHOLE`].
#[inline(always)]
pub(crate) fn whole_above(v: f32) -> f32 {
    let nearest = (v + WHOLE) - WHOLE;
    if nearest < v { nearest + 1.0 } else { nearest }
}

/// A whole number from 0 up that is small beside [`WHOLE`].
#[inline(always)]
pub(crate) fn index(whole: f32) -> u32 {
    (whole + WHOLE).to_bits() - WHOLE.to_bits()
}

#[cfg(test)]
mod tests {
    use super::dispatch;

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
        let wide = dispatch(
            #[inline(always)]
            || sums(&values),
        );
        assert_eq!(wide, sums(&values));
    }

    #[test]
    fn a_panic_comes_through() {
        let none: Vec<f32> = Vec::new();
        let caught = std::panic::catch_unwind(|| dispatch(|| none[3]));
        assert!(caught.is_err());
    }
}
