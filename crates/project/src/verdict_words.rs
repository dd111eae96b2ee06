//! Words for verdicts, reasons and metrics, as people type them: the names, and the words of the review page in English and
//! Vietnamese.

use std::str::FromStr;

use mocban_core::domain::spelling::hint;
use mocban_core::domain::{Reason, ThresholdMetric, Verdict};
use mocban_lists::columns::plain_name;

/// Verdicts with their other words, as [`plain_name`] writes them.
const VERDICTS: [(Verdict, &[&str]); 3] = [
    (Verdict::Pass, &["dat"]),
    (Verdict::Fail, &["khong_dat"]),
    (Verdict::Unsure, &["chua_chac", "khong_chac", "chua_ro"]),
];

/// Reasons with their other words, as [`plain_name`] writes them.
const REASONS: [(Reason, &[&str]); 6] = [
    (Reason::Angle, &["wrong_angle", "sai_goc"]),
    (Reason::StrokesLost, &["missing_strokes", "mat_net"]),
    (Reason::BackgroundIn, &["background_included", "lan_nen"]),
    (
        Reason::ShiftOrScale,
        &["wrong_position_or_scale", "sai_vi_tri_hoac_ti_le"],
    ),
    (Reason::Mirrored, &["bi_lat_guong", "lat_guong"]),
    (
        Reason::WrongPair,
        &[
            "wrong_pair_or_bad_input",
            "sai_cap_hoac_du_lieu_hong",
            "sai_cap",
        ],
    ),
];

/// Parses a verdict.
///
/// # Errors
/// Returns a sentence with the names of the verdicts, and a similar one.
pub fn verdict(text: &str) -> Result<Verdict, String> {
    word(text, &VERDICTS, &Verdict::ALL.map(Verdict::name))
}

/// Parses a reason of a failure.
///
/// # Errors
/// Returns a sentence with the names of the reasons, and a similar one.
pub fn reason(text: &str) -> Result<Reason, String> {
    word(text, &REASONS, &Reason::ALL.map(Reason::name))
}

/// Parses a metric.
///
/// # Errors
/// Returns a sentence with the names of the metrics, and a similar one.
pub fn metric(text: &str) -> Result<ThresholdMetric, String> {
    word(text, &[], &ThresholdMetric::ALL.map(ThresholdMetric::name))
}

/// Parses one of these names, in any case and with blanks, or one of some other words.
fn word<T>(text: &str, others: &[(T, &[&str])], names: &[&str]) -> Result<T, String>
where
    T: FromStr<Err: std::fmt::Display> + Copy,
{
    let plain = plain_name(text);
    let found = others.iter().find(|(_, words)| words.contains(&&*plain));
    if let Some((found, _)) = found {
        return Ok(*found);
    }
    let parsed = plain.parse();
    // The error shows the text as written.
    parsed
        .or_else(|_: T::Err| text.parse())
        .map_err(|error: T::Err| format!("{error}{}", hint(&plain, names.iter().copied())))
}

#[cfg(test)]
mod tests {
    use super::{metric, reason, verdict};
    use mocban_core::domain::{Reason, ThresholdMetric, Verdict};

    /// Texts of the review page.
    const PAGE: &str = include_str!("../../../assets/review/messages.json");

    #[test]
    fn the_words_of_the_page_are_understood() {
        let page: serde_json::Value = serde_json::from_str(PAGE).expect("JSON");
        for language in ["en", "vi"] {
            let shown = |name: &str| page[name][language].as_str().expect("a text");
            for expected in Verdict::ALL {
                assert_eq!(verdict(shown(expected.name())), Ok(expected));
                assert_eq!(verdict(expected.name()), Ok(expected));
            }
            for expected in Reason::ALL {
                assert_eq!(reason(shown(expected.name())), Ok(expected));
                assert_eq!(reason(expected.title()), Ok(expected));
            }
        }
        assert_eq!(verdict("Chưa rõ"), Ok(Verdict::Unsure));
        assert_eq!(
            verdict("maybe").expect_err("unknown"),
            "\"maybe\" is not a verdict (pass, fail, unsure)"
        );
    }

    #[test]
    fn metrics_are_named_in_any_case() {
        for expected in ThresholdMetric::ALL {
            let name = expected.name();
            for typed in [name.to_owned(), name.to_uppercase(), name.replace('_', "-")] {
                assert_eq!(metric(&typed), Ok(expected), "{typed}");
            }
        }
        assert_eq!(
            metric("IOU").expect_err("unknown"),
            "\"IOU\" is not a metric (nl_ssim, density, ensemble, relief)"
        );
        assert_eq!(
            metric("Releif").expect_err("misspelt"),
            "\"Releif\" is not a metric (nl_ssim, density, ensemble, relief); did you mean \"relief\"?"
        );
        let refused = reason("Stroke lost").expect_err("misspelt");
        assert!(
            refused.ends_with("; did you mean \"strokes_lost\"?"),
            "{refused}"
        );
    }
}
