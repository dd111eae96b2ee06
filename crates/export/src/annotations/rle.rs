//! Run-length encoding of masks as `pycocotools` reads it.

use mocban_core::raster::Mask;

/// Returns the lengths of the alternating runs of a mask, column by column: first pixels that are not set, then set
/// ones, and so on.
pub(super) fn run_lengths(mask: &Mask) -> Vec<u32> {
    let mut runs = vec![0];
    let mut is_set = false;
    for column in mask.transposed().data().chunks(mask.height().max(1)) {
        for pixel in column {
            if *pixel != is_set {
                is_set = *pixel;
                runs.push(0);
            }
            if let Some(run) = runs.last_mut() {
                *run += 1;
            }
        }
    }
    runs
}

/// Compresses run lengths to the text that COCO files hold: from the fourth run on, the difference to the run two
/// before, in groups of five bits with a continuation bit, as characters from `0`.
pub(super) fn compressed(runs: &[u32]) -> String {
    let mut text = String::new();
    for (k, run) in runs.iter().enumerate() {
        let mut rest = i64::from(*run);
        if k > 2 {
            rest -= i64::from(runs[k - 2]);
        }
        loop {
            let bits = (rest & 0x1f) as u8;
            rest >>= 5;
            // The sign is the fifth bit of the last group.
            let is_last = rest == if bits & 0x10 == 0 { 0 } else { -1 };
            text.push(char::from(b'0' + bits + if is_last { 0 } else { 0x20 }));
            if is_last {
                break;
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{compressed, run_lengths};
    use mocban_core::raster::Mask;

    /// Reads the text back, as `rleFrString` of the COCO API does.
    fn expanded(text: &str) -> Vec<u32> {
        let mut runs: Vec<i64> = Vec::new();
        let (mut value, mut shift) = (0_i64, 0);
        for byte in text.bytes() {
            let bits = i64::from(byte - b'0');
            value |= (bits & 0x1f) << shift;
            shift += 5;
            if bits & 0x20 == 0 {
                if bits & 0x10 != 0 {
                    value |= -1 << shift;
                }
                if runs.len() > 2 {
                    value += runs[runs.len() - 2];
                }
                runs.push(value);
                (value, shift) = (0, 0);
            }
        }
        runs.into_iter().map(|run| run as u32).collect()
    }

    #[test]
    fn columns_are_counted_from_the_top_and_start_with_background() {
        let rows = ["#..", "#.#"];
        let mask = Mask::from_fn(3, 2, |x, y| rows[y].as_bytes()[x] == b'#');
        assert_eq!(run_lengths(&mask), [0, 2, 3, 1]);
        assert_eq!(run_lengths(&Mask::new(2, 2, false)), [4]);
    }

    #[test]
    fn text_equals_that_of_the_coco_api() {
        // `pycocotools.mask.encode` of a 100 x 100 mask with rows 10..40 of columns 20..60 set.
        let mask = Mask::from_fn(100, 100, |x, y| {
            (20..60).contains(&x) && (10..40).contains(&y)
        });
        let text = compressed(&run_lengths(&mask));
        assert_eq!(text, format!("jn1n0V2{}fl3", "0".repeat(77)));
    }

    proptest! {
        #[test]
        fn text_holds_the_runs(runs in prop::collection::vec(0_u32..5_000_000, 0..60)) {
            prop_assert_eq!(expanded(&compressed(&runs)), runs);
        }

        #[test]
        fn runs_cover_the_mask(width in 1_usize..9, bits in prop::collection::vec(any::<bool>(), 1..90)) {
            let height = bits.len().div_ceil(width);
            let mask = Mask::from_fn(width, height, |x, y| bits.get(y * width + x) == Some(&true));
            let mut set = Vec::new();
            for (k, run) in run_lengths(&mask).into_iter().enumerate() {
                set.extend(std::iter::repeat_n(k % 2 == 1, run as usize));
            }
            let columns = mask.transposed();
            prop_assert_eq!(set, columns.data());
        }
    }
}
