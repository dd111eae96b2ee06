//! Numbers, sizes, times and durations as text, as they are written in the language of a page.

pub(super) use crate::digit_groups::grouped;
use crate::review::Language;
use mocban_core::domain::{UnixMillis, fixed};
use mocban_system::time_text;

/// Returns the English form of a word for a number: the first one for one thing.
pub(super) const fn english_form(number: u64, [one, many]: [&str; 2]) -> &str {
    if number == 1 { one } else { many }
}

/// Returns a number with the English form of its word, such as `1 pair` and `2 pairs`.
pub(super) fn english_count(number: u64, forms: [&str; 2]) -> String {
    format!("{} {}", grouped(number), english_form(number, forms))
}

/// Returns a text with numbers, such as `0.95 (0.90 to 0.98)`, with the decimal sign of a language.
pub(super) fn with_decimal_sign(language: Language, text: String) -> String {
    match language {
        Language::English => text,
        Language::Vietnamese => text.replace('.', ","),
    }
}

/// Returns a number with some digits behind the decimal sign. Zero has no sign.
pub(super) fn decimal(language: Language, value: f64, digits: usize) -> String {
    with_decimal_sign(language, fixed(value, digits).replace('-', "−"))
}

/// Returns a number of bytes in the unit that fits.
pub(super) fn file_size(language: Language, bytes: u64) -> String {
    match bytes {
        0..=9_999 => format!("{bytes} B"),
        10_000..=999_999 => format!("{} kB", bytes / 1000),
        1_000_000..=999_999_999 => format!("{} MB", decimal(language, bytes as f64 / 1e6, 1)),
        _ => format!("{} GB", decimal(language, bytes as f64 / 1e9, 1)),
    }
}

/// Returns a time in the time zone of the computer: `2026-11-21 11:10:03 +07:00`, or in Vietnamese
/// `21/11/2026 11:10:03 +07:00`.
pub(super) fn date_and_time(language: Language, at: UnixMillis) -> String {
    match language {
        Language::English => time_text::local(at),
        Language::Vietnamese => time_text::local_day_first(at),
    }
}

/// Returns a duration in milliseconds in the unit that fits: `12.3 s`, or in Vietnamese `12,3 giây`.
pub(super) fn duration(language: Language, ms: u64) -> String {
    let text = time_text::duration(ms);
    match language {
        Language::English => text,
        Language::Vietnamese => {
            let words = text.split(' ').map(|word| match word {
                "s" => "giây",
                "min" => "phút",
                "h" => "giờ",
                other => other,
            });
            let words: Vec<&str> = words.collect();
            with_decimal_sign(language, words.join(" "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{date_and_time, decimal, duration, english_count, file_size, grouped};
    use crate::review::Language::{English, Vietnamese};

    #[test]
    fn numbers_are_written_as_in_the_language_of_the_page() {
        assert_eq!(grouped(7), "7");
        let count = |number| english_count(number, ["pair", "pairs"]);
        assert_eq!([0, 1, 2].map(count), ["0 pairs", "1 pair", "2 pairs"]);
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(decimal(English, 0.98765, 3), "0.988");
        assert_eq!(decimal(Vietnamese, -0.98765, 3), "−0,988");
        assert_eq!(decimal(English, -0.0004, 3), "0.000");
        for (bytes, english, vietnamese) in [
            (7, "7 B", "7 B"),
            (12_345, "12 kB", "12 kB"),
            (2_500_000, "2.5 MB", "2,5 MB"),
            (1 << 30, "1.1 GB", "1,1 GB"),
        ] {
            assert_eq!(file_size(English, bytes), english);
            assert_eq!(file_size(Vietnamese, bytes), vietnamese);
        }
    }

    #[test]
    fn times_are_written_as_in_the_language_of_the_page() {
        // Noon, so that the day is the same in most time zones.
        let at = 1_795_262_400_000;
        let [english, vietnamese] = [English, Vietnamese].map(|one| date_and_time(one, at));
        assert!(english.starts_with("2026-11-2"), "{english}");
        let day_first = vietnamese.get(2..11);
        assert_eq!(day_first, Some("/11/2026 "), "{vietnamese}");
        assert_eq!(duration(English, 245_000), "4 min 05 s");
        assert_eq!(duration(Vietnamese, 245_000), "4 phút 05 giây");
        assert_eq!(duration(Vietnamese, 12_340), "12,3 giây");
        assert_eq!(duration(Vietnamese, 480), "480 ms");
    }
}
