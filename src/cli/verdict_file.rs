//! A CSV file of verdicts: read whole or refused by line number. Separators and encoding are told from the file.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use csv::StringRecord;

use super::time_text::parse_utc;
use crate::catalog::{Look, NewVerdict};
use crate::config::hint;
use crate::domain::{ContentHash, PairName, UnixMillis, sanitize};
use crate::manifest::{LineCounter, as_utf8, delimiter};

const COLUMNS: [&str; 7] = [
    "pair", "verdict", "reviewer", "metric", "reason", "note", "at",
];
const NEEDED: usize = 3;

/// One verdict and the line it stands on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct VerdictRow {
    pub(super) line: u64,
    pub(super) verdict: NewVerdict,
    /// The result that it judged, where the file says so.
    pub(super) judged: Option<ContentHash>,
}

/// Why the file is refused.
#[derive(Debug, thiserror::Error)]
#[error("{}line {line}: {reason}; no verdict was recorded", .file.as_ref().map(|file| format!("{}: ", file.display())).unwrap_or_default())]
pub(super) struct VerdictFileError {
    file: Option<PathBuf>,
    line: u64,
    reason: String,
}

impl VerdictFileError {
    pub(super) fn new(line: u64, reason: &str) -> Self {
        Self {
            file: None,
            line,
            reason: sanitize(reason, 300),
        }
    }

    /// The same with the file's name.
    pub(super) fn in_file(mut self, file: &Path) -> Self {
        self.file = Some(file.to_owned());
        self
    }
}

/// Reads all rows.
///
/// # Errors
/// At the first line that is wrong.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<VerdictRow>, VerdictFileError> {
    let text = as_utf8(bytes).map_err(|error| VerdictFileError::new(1, &error.to_string()))?;
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter(&text))
        .trim(csv::Trim::All)
        .from_reader(&*text);
    let refused = |error: &csv::Error| csv_error(error, &text);
    let places = places(reader.headers().map_err(|error| refused(&error))?)?;
    let mut lines = LineCounter::new(&text);
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| refused(&error))?;
        let line = lines.at(record.position()) as u64;
        rows.push(row(&record, line, &places)?);
    }
    Ok(rows)
}

/// Refuses rows on pairs that are not there.
///
/// # Errors
/// At the first such row.
pub(super) fn refuse_unknown(
    rows: &[VerdictRow],
    unknown: &[PairName],
) -> Result<(), VerdictFileError> {
    match rows.iter().find(|row| unknown.contains(&row.verdict.pair)) {
        Some(row) => {
            let reason = format!("there is no pair {}", row.verdict.pair);
            Err(VerdictFileError::new(row.line, &reason))
        }
        None => Ok(()),
    }
}

/// Where each of [`COLUMNS`] stands in the file.
fn places(headers: &StringRecord) -> Result<[Option<usize>; 7], VerdictFileError> {
    if let Some(unknown) = headers.iter().find(|name| !COLUMNS.contains(name)) {
        let reason = format!("there is no column {unknown}{}", hint(unknown, COLUMNS));
        return Err(VerdictFileError::new(1, &reason));
    }
    let places = COLUMNS.map(|name| headers.iter().position(|header| header == name));
    for (name, place) in COLUMNS.iter().zip(places).take(NEEDED) {
        if place.is_none() {
            return Err(VerdictFileError::new(
                1,
                &format!("column {name} is missing"),
            ));
        }
    }
    Ok(places)
}

fn row(
    record: &StringRecord,
    line: u64,
    places: &[Option<usize>; 7],
) -> Result<VerdictRow, VerdictFileError> {
    let cell = |column: usize| {
        places[column]
            .and_then(|place| record.get(place))
            .filter(|text| !text.is_empty())
    };
    let needed = |column: usize| {
        cell(column)
            .ok_or_else(|| VerdictFileError::new(line, &format!("{} is empty", COLUMNS[column])))
    };
    let verdict = NewVerdict {
        pair: word(needed(0)?, line)?,
        verdict: word(needed(1)?, line)?,
        reviewer: needed(2)?.to_owned(),
        metric: cell(3).map(|text| word(text, line)).transpose()?,
        reason: cell(4).map(|text| word(text, line)).transpose()?,
        note: cell(5).map(ToOwned::to_owned),
        look: Look::default(),
        at: cell(6).map(|text| moment(text, line)).transpose()?,
    };
    Ok(VerdictRow {
        line,
        verdict,
        judged: None,
    })
}

fn moment(text: &str, line: u64) -> Result<UnixMillis, VerdictFileError> {
    parse_utc(text).ok_or_else(|| {
        let reason =
            format!("at is {text:?}, not a time such as 2026-11-21 or 2026-11-21 04:10:03");
        VerdictFileError::new(line, &reason)
    })
}

fn word<T>(text: &str, line: u64) -> Result<T, VerdictFileError>
where
    T: FromStr<Err: std::fmt::Display>,
{
    text.parse()
        .map_err(|error: T::Err| VerdictFileError::new(line, &error.to_string()))
}

fn csv_error(error: &csv::Error, text: &[u8]) -> VerdictFileError {
    let line = LineCounter::new(text).at(error.position()) as u64;
    let reason = match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} cells where the header has {expected_len}"),
        csv::ErrorKind::Utf8 { .. } => "the text is not UTF-8; save it as \"CSV UTF-8\"".to_owned(),
        _ => error.to_string(),
    };
    VerdictFileError::new(line, &reason)
}

#[cfg(test)]
mod tests {
    use super::{parse, refuse_unknown};
    use crate::domain::{Reason, ThresholdMetric, Verdict};

    fn error(text: &str) -> String {
        parse(text.as_bytes()).expect_err("refused").to_string()
    }

    #[test]
    fn columns_may_stand_in_any_order_and_be_left_out() {
        let text = "reviewer,pair,verdict,metric,reason,note\n\
                    lan,0001,pass,,,\n\
                    lan,0002,fail,density,strokes_lost,\"thin, broken\"\n";
        let rows = parse(text.as_bytes()).expect("valid");
        assert_eq!(rows[0].verdict.verdict, Verdict::Pass);
        assert_eq!(rows[0].verdict.metric, None);
        assert_eq!(rows[1].line, 3);
        assert_eq!(rows[1].verdict.metric, Some(ThresholdMetric::Density));
        assert_eq!(rows[1].verdict.reason, Some(Reason::StrokesLost));
        assert_eq!(rows[1].verdict.note.as_deref(), Some("thin, broken"));
        assert_eq!(parse(b"pair,verdict,reviewer\n").expect("valid"), []);
    }

    #[test]
    fn a_time_is_kept_and_what_is_none_is_refused() {
        let rows =
            parse(b"pair,verdict,reviewer,at\n1,pass,lan,2026-11-21 04:10:03\n1,pass,lan,\n");
        let rows = rows.expect("valid");
        assert_eq!(rows[0].verdict.at, Some(1_795_234_203_000));
        assert_eq!(rows[1].verdict.at, None);
        let refused = error("pair,verdict,reviewer,at\n1,pass,lan,yesterday\n");
        assert!(
            refused.starts_with("line 2: at is \"yesterday\""),
            "{refused}"
        );
    }

    #[test]
    fn what_spreadsheets_write_is_read() {
        let plain = parse(b"pair,verdict,reviewer,note\n1,pass,lan,\"a, b\"\n").expect("valid");
        let semicolons = "pair;verdict;reviewer;note\r\n1;pass;lan;a, b\r\n";
        let tabs = semicolons.replace(';', "\t");
        let utf16: Vec<u8> = "\u{feff}"
            .chars()
            .chain(tabs.chars())
            .flat_map(|c| (c as u16).to_le_bytes())
            .collect();
        for bytes in [semicolons.as_bytes(), tabs.as_bytes(), &utf16] {
            assert_eq!(parse(bytes).expect("valid"), plain);
        }
        let cut = parse(&utf16[..utf16.len() - 1]).expect_err("cut short");
        assert!(cut.to_string().contains("UTF-16"), "{cut}");
        let latin = parse(b"pair;verdict;reviewer\n1;pass;Nguy\xean\n").expect_err("not UTF-8");
        assert!(latin.to_string().contains("CSV UTF-8"), "{latin}");
    }

    #[test]
    fn wrong_line_is_named_by_its_number() {
        assert_eq!(
            error("pair,verdict,reviewer\n1,pass,lan\n2,maybe,lan\n"),
            "line 3: \"maybe\" is not a verdict (pass, fail, unsure); no verdict was recorded"
        );
        assert!(error("pair,verdict,reviewer\n1,pass,\n").starts_with("line 2: reviewer is empty"));
        let rude = error("pair,ver\u{1b}[2J\n");
        assert!(!rude.contains('\u{1b}'), "{rude}");
        assert!(error("pair,verdict\n").starts_with("line 1: column reviewer is missing"));
        assert!(error("pair,verdict,reveiwer\n").contains("did you mean \"reviewer\"?"));
        assert!(error("pair,verdict,reviewer\n1,pass\n").starts_with("line 2: 2 cells"));
        assert!(error("pair,verdict,reviewer\na/b,pass,lan\n").starts_with("line 2: id"));
    }

    #[test]
    fn pair_that_is_not_there_is_named_by_its_line() {
        let rows = parse(b"pair,verdict,reviewer\n1,pass,lan\n2,pass,lan\n").expect("valid");
        let unknown = ["2".parse().expect("valid id")];
        let error = refuse_unknown(&rows, &unknown).expect_err("refused");
        assert!(
            error.to_string().starts_with("line 3: there is no pair 2"),
            "{error}"
        );
    }
}
