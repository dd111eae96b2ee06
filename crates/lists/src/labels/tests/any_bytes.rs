//! The reader neither panics nor returns boxes outside the page, whatever the bytes are.

use proptest::prelude::*;
use proptest::sample::Index;

use super::samples::{PAGE, SAMPLES};
use crate::labels::read;

/// Checks what holds for any labels of the page.
fn check(bytes: &[u8]) {
    match read(bytes, "labels.json", &PAGE) {
        Ok(labels) => {
            assert!(!labels.boxes.is_empty());
            for label in &labels.boxes {
                let [x0, y0, x1, y1] = label.bounds();
                assert!(label.outline.len() >= 3);
                assert!(x0 >= -0.5 && y0 >= -0.5 && x0 < x1 && y0 < y1, "{label:?}");
                assert!(x1 <= 1599.5 && y1 <= 999.5, "{label:?}");
            }
        }
        Err(error) => {
            let text = error.to_string();
            assert!(
                text.starts_with("labels.json: ") && !text.contains('\n'),
                "{text}"
            );
        }
    }
}

proptest! {
    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        check(&bytes);
    }

    #[test]
    fn any_text(text in "[-{}\\[\\]<>\",:0-9a-z #\n]{0,80}") {
        check(text.as_bytes());
    }

    #[test]
    fn damaged_files(
        sample in 0..SAMPLES.len(),
        changes in proptest::collection::vec((any::<Index>(), any::<u8>()), 0..6),
        end in proptest::option::of(any::<Index>()),
    ) {
        let mut bytes = SAMPLES[sample].3.as_bytes().to_vec();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(end) = end {
            bytes.truncate(end.index(bytes.len()));
        }
        check(&bytes);
    }

    #[test]
    fn swapped_parts(
        sample in 0..SAMPLES.len(),
        from in any::<Index>(),
        to in any::<Index>(),
        part in prop::sample::select(vec!["1e308", "-1", "null", "\"\"", "[]", "{}", "nan", "0", "1e-9", "\n", "-inf", "&#0;"]),
    ) {
        let text = SAMPLES[sample].3;
        // Replaces a number by something else.
        let digits: Vec<(usize, &str)> = text.match_indices(char::is_numeric).collect();
        let (a, b) = (digits[from.index(digits.len())].0, digits[to.index(digits.len())].0);
        let mut changed = text.to_owned();
        changed.replace_range(a..=a, part);
        check(changed.as_bytes());
        let (a, b) = (a.min(b), a.max(b));
        let mut cut = text.to_owned();
        cut.replace_range(a..b, part);
        check(cut.as_bytes());
    }
}

#[test]
fn deep_nesting_is_refused() {
    for (open, close) in [("[", "]"), ("{\"a\":", "}"), ("<PcGts>", "</PcGts>")] {
        let text = format!("{}{}", open.repeat(100_000), close.repeat(100_000));
        let error = read(text.as_bytes(), "labels", &PAGE).expect_err("too deep");
        assert!(error.to_string().contains("damaged"), "{error}");
    }
}

#[test]
fn a_hundred_thousand_boxes_are_read_and_no_more() {
    let file = |count: usize| {
        let line = |k: usize| {
            format!(
                "0 {} {} 0.002 0.002\n",
                0.01 + (k % 400) as f64 / 410.0,
                0.01 + (k / 400) as f64 / 260.0
            )
        };
        (0..count).map(line).collect::<String>()
    };
    let labels = read(file(100_000).as_bytes(), "labels.txt", &PAGE).expect("valid");
    assert_eq!(labels.boxes.len(), 100_000);
    let error = read(file(100_001).as_bytes(), "labels.txt", &PAGE).expect_err("too many");
    assert!(
        error.to_string().contains("more than 100000 boxes"),
        "{error}"
    );
}
