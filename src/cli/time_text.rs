//! Times and durations as people read them.

use crate::domain::UnixMillis;

/// `2026-11-21 04:10:03` in UTC.
pub(super) fn utc(at: UnixMillis) -> String {
    let seconds = at.div_euclid(1000);
    let (year, month, day) = civil(seconds.div_euclid(86_400));
    let of_day = seconds.rem_euclid(86_400);
    format!(
        "{year:04}-{month:02}-{day:02} {:02}:{:02}:{:02}",
        of_day / 3600,
        of_day / 60 % 60,
        of_day % 60
    )
}

/// `2026-11-21` in UTC.
pub(super) fn day(at: UnixMillis) -> String {
    utc(at).split(' ').take(1).collect()
}

/// A moment in UTC from `2026-11-21`, `2026-11-21 04:10:03` or `2026-11-21T04:10:03Z`; `None` for all else.
pub(super) fn from_utc(text: &str) -> Option<UnixMillis> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let (date, time) = text.split_once([' ', 'T']).unwrap_or((text, "00:00:00"));
    let [year, month, day] = numbers(date, '-')?;
    let [hour, minute, second] = numbers(time, ':')?;
    // A day that there is comes back the same.
    let days = days_from_civil(year, month, day);
    let is_there = civil(days) == (year, month, day);
    let in_day = hour < 24 && minute < 60 && second < 60;
    (is_there && in_day).then_some(((days * 24 + hour) * 60 + minute) * 60_000 + second * 1000)
}

/// Three numbers without signs.
fn numbers(text: &str, separator: char) -> Option<[i64; 3]> {
    let is_number = |part: &&str| part.len() <= 4 && part.bytes().all(|byte| byte.is_ascii_digit());
    let parts: Vec<&str> = text.split(separator).filter(is_number).collect();
    let numbers: Vec<i64> = parts.iter().filter_map(|part| part.parse().ok()).collect();
    numbers.try_into().ok()
}

/// Days since 1970 of a date, the way back from [`civil`].
const fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let year = year - (month <= 2) as i64;
    let era = year.div_euclid(400);
    let from_march = (month + 9) % 12;
    let of_year = (153 * from_march + 2) / 5 + day - 1;
    let year_of_era = year.rem_euclid(400);
    era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + of_year - 719_468
}

/// `480 ms`, `12.3 s`, `4 min 05 s`, `2 h 03 min`.
pub(super) fn span(ms: u64) -> String {
    let seconds = ms / 1000;
    match seconds {
        0 => format!("{ms} ms"),
        1..60 => format!("{:.1} s", ms as f64 / 1000.0),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        3600.. => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// A time that is only guessed: no fractions of a second.
pub(super) fn rough(ms: u64) -> String {
    match ms.div_ceil(1000) {
        seconds @ 0..60 => format!("{seconds} s"),
        _ => span(ms),
    }
}

/// Year, month and day of a day since 1970 in the Gregorian calendar, by eras of 400 years that begin in March.
const fn civil(day: i64) -> (i64, i64, i64) {
    let shifted = day + 719_468;
    let era = shifted.div_euclid(146_097);
    let of_era = shifted.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * of_year + 2) / 153;
    let month = if from_march < 10 {
        from_march + 3
    } else {
        from_march - 9
    };
    let year = year_of_era + era * 400 + (month <= 2) as i64;
    (year, month, of_year - (153 * from_march + 2) / 5 + 1)
}

#[cfg(test)]
mod tests {
    use super::{from_utc, span, utc};

    #[test]
    fn known_moments_are_written_right() {
        assert_eq!(utc(0), "1970-01-01 00:00:00");
        assert_eq!(utc(951_782_400_000), "2000-02-29 00:00:00");
        assert_eq!(utc(1_795_234_203_999), "2026-11-21 04:10:03");
        assert_eq!(utc(-1000), "1969-12-31 23:59:59");
    }

    #[test]
    fn what_is_written_is_read_back_and_what_is_no_time_is_not() {
        for at in [
            0,
            951_782_400_000,
            1_795_234_203_000,
            -1000,
            4_102_444_799_000,
        ] {
            assert_eq!(from_utc(&utc(at)), Some(at));
        }
        assert_eq!(from_utc("2000-02-29"), Some(951_782_400_000));
        assert_eq!(from_utc("2026-11-21T04:10:03Z"), Some(1_795_234_203_000));
        for text in [
            "2026-02-29",
            "2026-13-01",
            "21.11.2026",
            "2026-11-21 24:00:00",
            "1-2",
            "",
        ] {
            assert_eq!(from_utc(text), None, "{text}");
        }
    }

    #[test]
    fn spans_take_the_unit_that_fits() {
        assert_eq!(span(480), "480 ms");
        assert_eq!(span(12_340), "12.3 s");
        assert_eq!(span(245_000), "4 min 05 s");
        assert_eq!(span(7_380_000), "2 h 03 min");
    }
}
