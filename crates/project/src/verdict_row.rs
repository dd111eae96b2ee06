//! One verdict of a file, and the parser of its time.

use std::ops::RangeInclusive;

use super::files::RefusedLine;
use mocban_catalog::ListedVerdict;
use mocban_core::domain::UnixMillis;
use mocban_core::domain::spelling::quoted;
use mocban_lists::manifest::{cell_error, formula_error};
use mocban_system::time_text::{has_offset, parse_day_first, parse_utc};

pub(crate) const DAY_MS: UnixMillis = 24 * 60 * 60 * 1000;

/// One verdict and its line number.
#[derive(Debug, Clone, PartialEq)]
pub struct VerdictRow {
    /// Number of the line, from 1.
    pub line: usize,
    /// The verdict, and the result that it judges if the file names it.
    pub listed: ListedVerdict,
    /// Fields of an object of JSON that no verdict has.
    pub unread: Vec<String>,
    /// Whether its time is written with the day first.
    pub is_day_first: bool,
    /// Whether its time is in no known time zone, and was read as UTC.
    pub is_zone_unknown: bool,
}

/// The time of a verdict.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct GivenTime {
    /// The time; `None` for the time of the import.
    pub(crate) at: Option<UnixMillis>,
    /// The day, if no more is known.
    pub(crate) day: Option<RangeInclusive<UnixMillis>>,
    /// Whether it is written with the day first.
    pub(crate) is_day_first: bool,
    /// Whether it has no time zone, and was read as UTC.
    pub(crate) is_zone_unknown: bool,
}

impl GivenTime {
    /// Parses a time. A day alone is returned as such, too, and counts as its end, because the reviewer may have given an
    /// earlier verdict in the app on the same day. Until this end, it counts as the time of the import, which is `None`; a
    /// day that has only begun in other time zones counts as its begin.
    pub(crate) fn parse(text: &str, now: UnixMillis) -> Result<Self, String> {
        let day_first = parse_day_first(text);
        let is_day_first = day_first.is_some();
        let at = day_first.or_else(|| parse_utc(text)).ok_or_else(|| {
            let text = quoted(text);
            format!(
                "at is {text}, not a time such as 2026-11-21, 2026-11-21 04:10:03 or 21/11/2026, with the day first"
            )
        })?;
        if text.contains(['T', 't', ' ', ':']) {
            return Ok(Self {
                at: Some(at),
                day: None,
                is_day_first,
                is_zone_unknown: !has_offset(text),
            });
        }
        let day = at..=at + DAY_MS - 1;
        Ok(Self {
            at: (!day.contains(&now)).then_some(if now < at { at } else { *day.end() }),
            day: Some(day),
            is_day_first,
            is_zone_unknown: true,
        })
    }
}

/// Returns why a row with these cells, each with its column, is refused, if some are errors of formulas.
pub(crate) fn cells_reason<'c>(
    cells: impl IntoIterator<Item = (&'c str, &'c str)>,
) -> Option<String> {
    let cells = cells.into_iter();
    let found = cells.filter_map(|(column, cell)| Some((column, formula_error(cell)?)));
    let found: Vec<(&str, &str)> = found.collect();
    match found.as_slice() {
        [] => None,
        [(column, error)] => cell_error(column, error),
        several => {
            let shown = several.iter();
            let shown: Vec<String> = shown
                .map(|(column, error)| format!("{column} ({error})"))
                .collect();
            Some(format!(
                "columns {} have errors of formulas; correct them in the spreadsheet program, or clear the cells",
                shown.join(", ")
            ))
        }
    }
}

/// Names the line of what was not understood.
pub(crate) fn at_line<T>(line: usize, parsed: Result<T, String>) -> Result<T, RefusedLine> {
    parsed.map_err(|reason| RefusedLine::new(line, &reason))
}

#[cfg(test)]
mod tests {
    use super::GivenTime;

    #[test]
    fn a_day_without_a_time_counts_as_its_end_and_today_as_the_time_of_the_import() {
        let begin = 1_795_219_200_000;
        let length = 24 * 60 * 60 * 1000;
        let day = Some(begin..=begin + length - 1);
        for (text, is_day_first) in [("2026-11-21", false), ("21/11/2026", true)] {
            for (now, at) in [
                (begin + length, Some(begin + length - 1)),
                (begin + length - 1, None),
                (begin, None),
                // It has begun in another time zone.
                (begin - 1000, Some(begin)),
                // The import refuses it.
                (begin - 2 * length, Some(begin)),
            ] {
                let expected = GivenTime {
                    at,
                    day: day.clone(),
                    is_day_first,
                    is_zone_unknown: true,
                };
                assert_eq!(GivenTime::parse(text, now), Ok(expected), "{text} {now}");
            }
        }
        for text in [
            "2026-11-21 00:00:00",
            "2026-11-21T00:00:00Z",
            "21.11.2026 00:00",
        ] {
            let given = GivenTime::parse(text, begin + 1000).expect("a time");
            assert_eq!((given.at, given.day), (Some(begin), None), "{text}");
            assert_eq!(given.is_zone_unknown, !text.ends_with('Z'), "{text}");
        }
        let refused = GivenTime::parse("11/21/2026", begin).expect_err("the month is first");
        assert!(
            refused.ends_with("or 21/11/2026, with the day first"),
            "{refused}"
        );
    }
}
