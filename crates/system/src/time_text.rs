//! Times and durations as text. A time is in milliseconds since the Unix epoch.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

/// Formats a time in the time zone of the computer, with its offset from UTC: `2026-11-21 11:10:03 +07:00`.
pub fn local(at: i64) -> String {
    in_zone(at, TimeZone::system())
}

/// Formats a time likewise with the day first, as in Vietnamese: `21/11/2026 11:10:03 +07:00`.
pub fn local_day_first(at: i64) -> String {
    day_first_in_zone(at, TimeZone::system())
}

fn in_zone(at: i64, zone: TimeZone) -> String {
    let time = timestamp(at).to_zoned(zone);
    time.strftime("%Y-%m-%d %H:%M:%S %:z").to_string()
}

fn day_first_in_zone(at: i64, zone: TimeZone) -> String {
    let time = timestamp(at).to_zoned(zone);
    time.strftime("%d/%m/%Y %H:%M:%S %:z").to_string()
}

/// Formats a day in UTC: `2026-11-21`.
pub fn day(at: i64) -> String {
    TimeZone::UTC.to_datetime(timestamp(at)).date().to_string()
}

/// Formats a time in UTC as a part of a file name: `2026-11-21 041003`.
pub fn file_time(at: i64) -> String {
    let time = TimeZone::UTC.to_datetime(timestamp(at));
    time.strftime("%Y-%m-%d %H%M%S").to_string()
}

/// Returns a time; the Unix epoch for times outside the years -9999 to 9999.
fn timestamp(at: i64) -> Timestamp {
    Timestamp::from_millisecond(at).unwrap_or(Timestamp::UNIX_EPOCH)
}

/// Parses a time: `2026-11-21`, `2026-11-21 04:10:03` or `2026-11-21T04:10:03Z`. A time without an offset is in UTC.
pub fn parse_utc(text: &str) -> Option<i64> {
    let time = text.parse::<Timestamp>().or_else(|_| {
        let local: DateTime = text.parse()?;
        TimeZone::UTC.to_timestamp(local)
    });
    time.map(Timestamp::as_millisecond).ok()
}

/// Returns whether a time has an offset from UTC, or `Z`, so that it is the same everywhere.
pub fn has_offset(text: &str) -> bool {
    text.parse::<Timestamp>().is_ok()
}

/// Parses a time with the day first, such as `21/11/2026` or `21.11.2026 04:10:03`. `None`
/// for other forms. The time is in UTC.
pub fn parse_day_first(text: &str) -> Option<i64> {
    let (date, time) = text.split_once(' ').unwrap_or((text, "00:00"));
    let parts: Vec<&str> = date.split(['/', '.', '-']).collect();
    let [day, month, year] = parts[..] else {
        return None;
    };
    let is_number = |text: &str, digits: std::ops::RangeInclusive<usize>| {
        digits.contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit())
    };
    let is_date = is_number(day, 1..=2) && is_number(month, 1..=2) && is_number(year, 4..=4);
    let hour = time.trim().split(':').next().unwrap_or_default();
    let time = if hour.len() == 1 {
        format!("0{}", time.trim())
    } else {
        time.trim().to_owned()
    };
    is_date
        .then(|| parse_utc(&format!("{year}-{month:0>2}-{day:0>2} {time}")))
        .flatten()
}

/// Formats a duration in the unit that fits: `480 ms`, `12.3 s`, `4 min 05 s`, `2 h 03 min`.
pub fn duration(ms: u64) -> String {
    let seconds = ms / 1000;
    match seconds {
        0 => format!("{ms} ms"),
        1..60 => format!("{:.1} s", ms as f64 / 1000.0),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        3600.. => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// Formats an estimated duration, without fractions of a second.
pub fn rough_duration(ms: u64) -> String {
    match ms.div_ceil(1000) {
        seconds @ 0..60 => format!("{seconds} s"),
        _ => duration(ms),
    }
}

#[cfg(test)]
mod tests {
    use jiff::tz::{Offset, TimeZone};

    use super::{
        day, day_first_in_zone, duration, file_time, has_offset, in_zone, parse_day_first,
        parse_utc,
    };

    #[test]
    fn known_times_are_formatted_with_their_zone() {
        let utc = |at| in_zone(at, TimeZone::UTC);
        assert_eq!(utc(0), "1970-01-01 00:00:00 +00:00");
        assert_eq!(utc(951_782_400_000), "2000-02-29 00:00:00 +00:00");
        assert_eq!(utc(-1000), "1969-12-31 23:59:59 +00:00");
        let hanoi = TimeZone::fixed(Offset::constant(7));
        assert_eq!(
            in_zone(1_795_234_203_999, hanoi.clone()),
            "2026-11-21 11:10:03 +07:00"
        );
        assert_eq!(
            day_first_in_zone(1_795_234_203_999, hanoi),
            "21/11/2026 11:10:03 +07:00"
        );
        assert_eq!(day(1_795_234_203_999), "2026-11-21");
        assert_eq!(file_time(1_795_234_203_999), "2026-11-21 041003");
    }

    #[test]
    fn dates_of_spreadsheets_have_the_day_first() {
        for text in [
            "21/11/2026 04:10:03",
            "21.11.2026 4:10:03",
            "21-11-2026  04:10:03",
        ] {
            assert_eq!(parse_day_first(text), Some(1_795_234_203_000), "{text}");
        }
        assert_eq!(parse_day_first("29/2/2000"), Some(951_782_400_000));
        for text in [
            "11/21/2026",
            "29/2/2001",
            "2026-11-21",
            "21/11/26",
            "21/11",
            "+1/11/2026",
            "21/11/2026 soon",
            "",
        ] {
            assert_eq!(parse_day_first(text), None, "{text}");
        }
    }

    #[test]
    fn formatted_times_parse_back_and_other_texts_are_refused() {
        for at in [
            0,
            951_782_400_000,
            1_795_234_203_000,
            -1000,
            4_102_444_799_000,
        ] {
            assert_eq!(parse_utc(&super::timestamp(at).to_string()), Some(at));
        }
        assert_eq!(parse_utc("2000-02-29"), Some(951_782_400_000));
        for text in ["2026-11-21T04:10:03Z", "2026-11-21T11:10:03+07:00"] {
            assert_eq!(parse_utc(text), Some(1_795_234_203_000), "{text}");
            assert!(has_offset(text), "{text}");
        }
        for text in ["2026-11-21T04:10:03", "2026-11-21", "21/11/2026 04:10"] {
            assert!(!has_offset(text), "{text}");
        }
        for text in [
            "2026-02-29",
            "2026-13-01",
            "21.11.2026",
            "2026-11-21 24:00:00",
            "1-2",
            "",
        ] {
            assert_eq!(parse_utc(text), None, "{text}");
        }
    }

    #[test]
    fn durations_take_the_unit_that_fits() {
        assert_eq!(duration(480), "480 ms");
        assert_eq!(duration(12_340), "12.3 s");
        assert_eq!(duration(245_000), "4 min 05 s");
        assert_eq!(duration(7_380_000), "2 h 03 min");
    }
}
