//! Numbers and dates of a sheet as text.

/// How the numbers of cells with a style are shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum NumberFormat {
    /// As a number.
    #[default]
    Plain,
    /// With at least this many digits before the point, and after it, such as `0000` and `0.00`.
    Digits(usize, usize),
    /// In percent with at least this many digits after the point, such as `0%`.
    Percent(usize),
    /// As a power of ten, such as `1.00E+05`.
    Scientific,
    /// As a date, a time, or both.
    Date,
}

/// Ids of the formats of dates and times that every workbook has.
const DATE_FORMATS: [std::ops::RangeInclusive<u32>; 4] = [14..=22, 27..=36, 45..=47, 50..=58];
/// Most digits that a format adds zeros to.
const MAX_DIGITS: usize = 30;

impl NumberFormat {
    /// Returns the format with an id that every workbook has.
    pub(super) fn built_in(id: u32) -> Self {
        match id {
            2 => Self::Digits(1, 2),
            9 => Self::Percent(0),
            10 => Self::Percent(2),
            11 | 48 => Self::Scientific,
            id if DATE_FORMATS.iter().any(|ids| ids.contains(&id)) => Self::Date,
            _ => Self::Plain,
        }
    }

    /// Returns the format that a code such as `0000` or `dd/mm/yyyy` describes.
    pub(super) fn of_code(code: &str) -> Self {
        let percent = code.strip_suffix('%').map(str::trim_end);
        let shown = percent.unwrap_or(code);
        let (whole, decimals) = shown.split_once('.').unwrap_or((shown, ""));
        let are_zeros = |digits: &str| digits.bytes().all(|byte| byte == b'0');
        if !whole.is_empty()
            && (2..=MAX_DIGITS).contains(&code.len())
            && are_zeros(whole)
            && are_zeros(decimals)
        {
            return match percent {
                Some(_) => Self::Percent(decimals.len()),
                None => Self::Digits(whole.len(), decimals.len()),
            };
        }
        let (mut in_quotes, mut in_brackets, mut is_escaped) = (false, false, false);
        let is_of_date = |c: char| {
            let is_plain = !in_quotes && !in_brackets && !is_escaped;
            is_escaped = c == '\\' && !is_escaped && !in_quotes;
            match c {
                '"' if !in_brackets => in_quotes = !in_quotes,
                '[' if !in_quotes => in_brackets = true,
                ']' if !in_quotes => in_brackets = false,
                _ => {}
            }
            is_plain && matches!(c.to_ascii_lowercase(), 'y' | 'm' | 'd' | 'h' | 's')
        };
        // The first part is that of positive numbers.
        let first = code.split(';').next().unwrap_or(code);
        if first.eq_ignore_ascii_case("general") {
            Self::Plain
        } else if first.chars().any(is_of_date) {
            Self::Date
        } else if first.contains("0E+") || first.contains("0E-") {
            Self::Scientific
        } else {
            Self::Plain
        }
    }

    /// Returns what a spreadsheet program may have made of a text in this format, such as an id, with an example of the text.
    pub(super) const fn conversion(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Date => Some(("a date", "3-4")),
            Self::Scientific => Some(("a power of ten", "1E5")),
            Self::Plain | Self::Digits(..) | Self::Percent(_) => None,
        }
    }

    /// Returns the text of a number. Days of dates are counted from 1904 in workbooks of old versions for the Macintosh.
    pub(super) fn text(self, written: &str, is_1904: bool) -> String {
        let Ok(number) = written.trim().parse::<f64>() else {
            return written.to_owned();
        };
        let number = as_shown(number);
        let is_whole = number.fract() == 0.0 && number.abs() < 1e15;
        match self {
            Self::Percent(decimals) if number.abs() < 1e13 => {
                padded(&as_shown(100.0 * number).to_string(), 1, decimals) + "%"
            }
            Self::Date => date(number, is_1904).unwrap_or_else(|| number.to_string()),
            Self::Digits(whole, decimals) if (0.0..1e15).contains(&number) => {
                padded(&number.to_string(), whole, decimals)
            }
            _ if is_whole => format!("{number:.0}"),
            _ => number.to_string(),
        }
    }
}

/// Rounds a fraction to the 15 digits that spreadsheet programs show: 0.1 + 0.2 is 0.3.
fn as_shown(number: f64) -> f64 {
    if number.fract() == 0.0 {
        return number;
    }
    format!("{number:.14e}").parse().unwrap_or(number)
}

/// Adds zeros to a number, and takes no digit away.
fn padded(number: &str, min_whole: usize, min_decimals: usize) -> String {
    let (whole, decimals) = number.split_once('.').unwrap_or((number, ""));
    let point = if min_decimals.max(decimals.len()) > 0 {
        "."
    } else {
        ""
    };
    format!("{whole:0>min_whole$}{point}{decimals:0<min_decimals$}")
}

/// Seconds of a day.
const DAY: f64 = 86_400.0;
/// Last day that Excel knows: 9999-12-31.
const LAST_DAY: f64 = 2_958_465.0;

/// Returns a date, a time, or both from a number of days.
fn date(number: f64, is_1904: bool) -> Option<String> {
    let number = if is_1904 { number + 1462.0 } else { number };
    if !(0.0..=LAST_DAY + 1.0).contains(&number) {
        return None;
    }
    let seconds = (number * DAY).round() as i64;
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let time = format!(
        "{:02}:{:02}:{:02}",
        second / 3600,
        second / 60 % 60,
        second % 60
    );
    if days == 0 {
        return Some(time);
    }
    let (year, month, day) = civil(days);
    let date = format!("{year:04}-{month:02}-{day:02}");
    Some(if second == 0 {
        date
    } else {
        format!("{date} {time}")
    })
}

/// Returns year, month and day of a day that Excel counts from 1900. Excel takes 1900 for a leap year.
fn civil(days: i64) -> (i64, i64, i64) {
    if days == 60 {
        return (1900, 2, 29);
    }
    // Days from 0000-03-01, in eras of 400 years: see Hinnant, "chrono-Compatible Low-Level Date Algorithms".
    let from_march = days + i64::from(days < 60) - 25_569 + 719_468;
    let (era, day_of_era) = (
        from_march.div_euclid(146_097),
        from_march.rem_euclid(146_097),
    );
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    (year_of_era + era * 400 + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::NumberFormat;

    #[test]
    fn codes_tell_dates_and_digits_from_numbers() {
        use NumberFormat::{Date, Digits, Plain, Scientific};
        for (code, expected) in [
            ("0000", Digits(4, 0)),
            ("0.00", Digits(1, 2)),
            ("00.0", Digits(2, 1)),
            (".00", Plain),
            ("0", Plain),
            ("General", Plain),
            ("#,##0.00 \"ms\"", Plain),
            ("[Red]0.00", Plain),
            ("0.0\\m", Plain),
            ("0.00E+00;[Red]\"d\"", Scientific),
            ("##0.0E+0", Scientific),
            ("dd/mm/yyyy", Date),
            ("[$-42A]d mmmm yyyy", Date),
            ("hh:mm:ss", Date),
        ] {
            assert_eq!(NumberFormat::of_code(code), expected, "{code}");
        }
        assert_eq!(
            [14, 22, 1, 49, 2, 11].map(NumberFormat::built_in),
            [Date, Date, Plain, Plain, Digits(1, 2), Scientific]
        );
    }

    #[test]
    fn numbers_and_dates_become_text() {
        use NumberFormat::{Date, Digits, Percent, Plain};
        for (format, number, expected) in [
            (Plain, "117", "117"),
            (Plain, "0.1", "0.1"),
            (Plain, "1E5", "100000"),
            (Plain, "123456789012", "123456789012"),
            (Plain, "-2.5", "-2.5"),
            (Plain, "x", "x"),
            (Plain, "1.1000000000000001", "1.1"),
            (Plain, "0.30000000000000004", "0.3"),
            (Percent(0), "0.25", "25%"),
            (Percent(2), "0.07", "7.00%"),
            (Percent(0), "-0.125", "-12.5%"),
            (Digits(4, 0), "117", "0117"),
            (Digits(2, 0), "1234", "1234"),
            (Digits(4, 0), "1.5", "0001.5"),
            (Digits(1, 2), "1.1000000000000001", "1.10"),
            (Digits(1, 2), "3", "3.00"),
            (Digits(1, 2), "1.125", "1.125"),
            (Digits(1, 2), "-1", "-1"),
            (Date, "1", "1900-01-01"),
            (Date, "59", "1900-02-28"),
            (Date, "60", "1900-02-29"),
            (Date, "61", "1900-03-01"),
            (Date, "46347", "2026-11-21"),
            (Date, "46347.173645833333", "2026-11-21 04:10:03"),
            (Date, "0.5", "12:00:00"),
            (Date, "36585", "2000-02-29"),
            (Date, "2958465", "9999-12-31"),
            (Date, "-1", "-1"),
            (
                Date,
                "1e300",
                &"1e300".parse::<f64>().expect("a number").to_string(),
            ),
        ] {
            assert_eq!(format.text(number, false), expected, "{format:?} {number}");
        }
        assert_eq!(Date.text("44885", true), "2026-11-21");
    }
}
