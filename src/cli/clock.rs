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
    use super::{span, utc};

    #[test]
    fn known_moments_are_written_right() {
        assert_eq!(utc(0), "1970-01-01 00:00:00");
        assert_eq!(utc(951_782_400_000), "2000-02-29 00:00:00");
        assert_eq!(utc(1_795_234_203_999), "2026-11-21 04:10:03");
        assert_eq!(utc(-1000), "1969-12-31 23:59:59");
    }

    #[test]
    fn spans_take_the_unit_that_fits() {
        assert_eq!(span(480), "480 ms");
        assert_eq!(span(12_340), "12.3 s");
        assert_eq!(span(245_000), "4 min 05 s");
        assert_eq!(span(7_380_000), "2 h 03 min");
    }
}
