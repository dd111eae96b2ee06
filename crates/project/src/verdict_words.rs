//! Words for verdicts and reasons, as people type them: the names, and the words of the review page in English and Vietnamese.

use std::str::FromStr;

use mocban_core::domain::{Reason, Verdict};
use mocban_lists::columns::plain_name;

/// Verdicts in other words, as [`plain_name`] writes them.
const VERDICTS: [(&str, Verdict); 5] = [
    ("dat", Verdict::Pass),
    ("khong_dat", Verdict::Fail),
    ("chua_chac", Verdict::Unsure),
    ("khong_chac", Verdict::Unsure),
    ("chua_ro", Verdict::Unsure),
];

/// Reasons in other words, as [`plain_name`] writes them.
const REASONS: [(&str, Reason); 13] = [
    ("wrong_angle", Reason::Angle),
    ("sai_goc", Reason::Angle),
    ("missing_strokes", Reason::StrokesLost),
    ("mat_net", Reason::StrokesLost),
    ("background_included", Reason::BackgroundIn),
    ("lan_nen", Reason::BackgroundIn),
    ("wrong_position_or_scale", Reason::ShiftOrScale),
    ("sai_vi_tri_hoac_ti_le", Reason::ShiftOrScale),
    ("bi_lat_guong", Reason::Mirrored),
    ("lat_guong", Reason::Mirrored),
    ("wrong_pair_or_bad_input", Reason::WrongPair),
    ("sai_cap_hoac_du_lieu_hong", Reason::WrongPair),
    ("sai_cap", Reason::WrongPair),
];

/// Parses a verdict.
///
/// # Errors
/// Returns a sentence with the names of the verdicts.
pub fn verdict(text: &str) -> Result<Verdict, String> {
    word(text, &VERDICTS)
}

/// Parses a reason of a failure.
///
/// # Errors
/// Returns a sentence with the names of the reasons.
pub fn reason(text: &str) -> Result<Reason, String> {
    word(text, &REASONS)
}

/// Parses a name in any case and with blanks, or one of some other words.
pub(crate) fn word<T>(text: &str, other: &[(&str, T)]) -> Result<T, String>
where
    T: FromStr<Err: std::fmt::Display> + Copy,
{
    let plain = plain_name(text);
    let found = other.iter().find(|(word, _)| *word == plain);
    let found = found.map(|(_, found)| *found);
    found.or_else(|| plain.parse().ok()).map_or_else(
        || text.parse().map_err(|error: T::Err| error.to_string()),
        Ok,
    )
}

#[cfg(test)]
mod tests {
    use super::{reason, verdict};
    use mocban_core::domain::{Reason, Verdict};

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
}
