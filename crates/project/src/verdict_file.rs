//! Parses verdict files in CSV or JSON Lines format. If a line is invalid, the whole file is refused.

use std::str::FromStr;

use csv::StringRecord;
use serde::Deserialize;

use super::files::RefusedLine;
use super::time_text::parse_utc;
use mocban_catalog::{NewVerdict, ReviewContext};
use mocban_core::domain::spelling::hint;
use mocban_core::domain::{ContentHash, PairName, UnixMillis};
use mocban_lists::manifest::{LineCounter, as_utf8, delimiter};

const COLUMNS: [&str; 7] = [
    "pair", "verdict", "reviewer", "metric", "reason", "note", "at",
];
/// The first columns, which every file must have.
const REQUIRED: usize = 3;

/// One verdict and its line number.
#[derive(Debug, Clone, PartialEq)]
pub struct VerdictRow {
    /// Number of the line, from 1.
    pub line: usize,
    /// The verdict.
    pub verdict: NewVerdict,
    /// The judged result, if the file names it.
    pub judged: Option<ContentHash>,
}

/// Parses a CSV file. Detects its separator and encoding.
///
/// # Errors
/// Returns an error for the first invalid line.
pub fn parse_csv(bytes: &[u8]) -> Result<Vec<VerdictRow>, RefusedLine> {
    let text = as_utf8(bytes).map_err(|error| RefusedLine::new(1, &error.to_string()))?;
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter(&text))
        .trim(csv::Trim::All)
        .from_reader(&*text);
    let refused = |error: &csv::Error| csv_error(error, &text);
    let positions = positions(reader.headers().map_err(|error| refused(&error))?)?;
    let mut lines = LineCounter::new(&text);
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| refused(&error))?;
        let line = lines.at(record.position());
        rows.push(row(&record, line, &positions)?);
    }
    Ok(rows)
}

/// Refuses rows with values that no verdict has.
///
/// # Errors
/// At the first such row.
pub fn check_values(rows: &[VerdictRow], now: UnixMillis) -> Result<(), RefusedLine> {
    rows.iter().try_for_each(|row| {
        let checked = row.verdict.check(now);
        checked.map_err(|error| RefusedLine::new(row.line, &error.to_string()))
    })
}

/// Refuses rows of unknown pairs.
///
/// # Errors
/// At the first such row.
pub fn refuse_unknown(rows: &[VerdictRow], unknown: &[PairName]) -> Result<(), RefusedLine> {
    match rows.iter().find(|row| unknown.contains(&row.verdict.pair)) {
        Some(row) => Err(RefusedLine::new(
            row.line,
            &format!("there is no pair {}", row.verdict.pair),
        )),
        None => Ok(()),
    }
}

/// Returns the position of each of [`COLUMNS`] in the file.
fn positions(headers: &StringRecord) -> Result<[Option<usize>; 7], RefusedLine> {
    if let Some(unknown) = headers.iter().find(|name| !COLUMNS.contains(name)) {
        let reason = format!("there is no column {unknown}{}", hint(unknown, COLUMNS));
        return Err(RefusedLine::new(1, &reason));
    }
    let count = |name: &str| headers.iter().filter(|header| *header == name).count();
    if let Some(twice) = COLUMNS.iter().find(|name| count(name) > 1) {
        let reason = format!("column {twice} is there twice");
        return Err(RefusedLine::new(1, &reason));
    }
    let positions = COLUMNS.map(|name| headers.iter().position(|header| header == name));
    match positions[..REQUIRED].iter().position(Option::is_none) {
        Some(at) => Err(RefusedLine::new(
            1,
            &format!("column {} is missing", COLUMNS[at]),
        )),
        None => Ok(positions),
    }
}

fn row(
    record: &StringRecord,
    line: usize,
    positions: &[Option<usize>; 7],
) -> Result<VerdictRow, RefusedLine> {
    let cell = |column: usize| {
        positions[column]
            .and_then(|position| record.get(position))
            .filter(|text| !text.is_empty())
    };
    let required = |column: usize| {
        cell(column).ok_or_else(|| RefusedLine::new(line, &format!("{} is empty", COLUMNS[column])))
    };
    let verdict = NewVerdict {
        pair: value(required(0)?, line)?,
        verdict: value(required(1)?, line)?,
        reviewer: required(2)?.to_owned(),
        metric: cell(3).map(|text| value(text, line)).transpose()?,
        reason: cell(4).map(|text| value(text, line)).transpose()?,
        note: cell(5).map(ToOwned::to_owned),
        look: ReviewContext::default(),
        at: cell(6).map(|text| time(text, line)).transpose()?,
    };
    Ok(VerdictRow {
        line,
        verdict,
        judged: None,
    })
}

fn time(text: &str, line: usize) -> Result<UnixMillis, RefusedLine> {
    parse_utc(text).ok_or_else(|| {
        let reason =
            format!("at is {text:?}, not a time such as 2026-11-21 or 2026-11-21 04:10:03");
        RefusedLine::new(line, &reason)
    })
}

fn value<T>(text: &str, line: usize) -> Result<T, RefusedLine>
where
    T: FromStr<Err: std::fmt::Display>,
{
    text.parse()
        .map_err(|error: T::Err| RefusedLine::new(line, &error.to_string()))
}

fn csv_error(error: &csv::Error, text: &[u8]) -> RefusedLine {
    let line = LineCounter::new(text).at(error.position());
    let reason = match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} cells where the header has {expected_len}"),
        csv::ErrorKind::Utf8 { .. } => "the text is not UTF-8; save it as \"CSV UTF-8\"".to_owned(),
        _ => error.to_string(),
    };
    RefusedLine::new(line, &reason)
}

/// A line written by `verdict log --json` or an export. Unknown fields are ignored.
#[derive(Debug, Deserialize)]
struct VerdictLine {
    #[serde(flatten)]
    verdict: NewVerdict,
    result_hash: Option<ContentHash>,
    undone_at: Option<UnixMillis>,
}

/// Parses a JSON Lines file. Undone verdicts are ignored.
///
/// # Errors
/// Returns an error for the first invalid line.
pub fn parse_jsonl(bytes: &[u8]) -> Result<Vec<VerdictRow>, RefusedLine> {
    let text = as_utf8(bytes).map_err(|error| RefusedLine::new(1, &error.to_string()))?;
    let lines = (1..).zip(text.split(|byte| *byte == b'\n'));
    let lines = lines.filter(|(_, content)| !content.trim_ascii().is_empty());
    let rows = lines.map(|(line, content)| {
        let mut parsed: VerdictLine = serde_json::from_slice(content)
            .map_err(|error| RefusedLine::new(line, &json_error(&error)))?;
        let reviewer = parsed.verdict.reviewer.trim().to_owned();
        parsed.verdict.reviewer = reviewer;
        if parsed.verdict.reviewer.is_empty() {
            return Err(RefusedLine::new(line, "reviewer is empty"));
        }
        Ok(parsed.undone_at.is_none().then_some(VerdictRow {
            line,
            verdict: parsed.verdict,
            judged: parsed.result_hash,
        }))
    });
    rows.filter_map(Result::transpose).collect()
}

/// Returns the parser's message without its line number, which is always 1 because lines are parsed one by one.
fn json_error(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let reason = message.split(" at line ").next().unwrap_or(&message);
    reason.to_owned()
}

#[cfg(test)]
mod tests {
    use super::{check_values, parse_csv, parse_jsonl, refuse_unknown};
    use mocban_core::domain::{Reason, ThresholdMetric, Verdict};

    fn error(text: &str) -> String {
        parse_csv(text.as_bytes()).expect_err("refused").to_string()
    }

    #[test]
    fn columns_may_be_in_any_order_and_optional_ones_missing() {
        let text = "reviewer,pair,verdict,metric,reason,note\n\
                    lan,0001,pass,,,\n\
                    lan,0002,fail,density,strokes_lost,\"thin, broken\"\n";
        let rows = parse_csv(text.as_bytes()).expect("valid");
        assert_eq!(rows[0].verdict.verdict, Verdict::Pass);
        assert_eq!(rows[0].verdict.metric, None);
        assert_eq!(rows[1].line, 3);
        assert_eq!(rows[1].verdict.metric, Some(ThresholdMetric::Density));
        assert_eq!(rows[1].verdict.reason, Some(Reason::StrokesLost));
        assert_eq!(rows[1].verdict.note.as_deref(), Some("thin, broken"));
        assert_eq!(parse_csv(b"pair,verdict,reviewer\n").expect("valid"), []);
    }

    #[test]
    fn times_are_parsed_and_other_texts_refused() {
        let rows =
            parse_csv(b"pair,verdict,reviewer,at\n1,pass,lan,2026-11-21 04:10:03\n1,pass,lan,\n");
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
    fn files_of_spreadsheets_are_read() {
        let plain = parse_csv(b"pair,verdict,reviewer,note\n1,pass,lan,\"a, b\"\n").expect("valid");
        let semicolons = "pair;verdict;reviewer;note\r\n1;pass;lan;a, b\r\n";
        let tabs = semicolons.replace(';', "\t");
        let utf16: Vec<u8> = "\u{feff}"
            .chars()
            .chain(tabs.chars())
            .flat_map(|c| (c as u16).to_le_bytes())
            .collect();
        for bytes in [semicolons.as_bytes(), tabs.as_bytes(), &utf16] {
            assert_eq!(parse_csv(bytes).expect("valid"), plain);
        }
        let cut = parse_csv(&utf16[..utf16.len() - 1]).expect_err("truncated");
        assert!(cut.to_string().contains("UTF-16"), "{cut}");
        let latin = parse_csv(b"pair;verdict;reviewer\n1;pass;Nguy\xean\n").expect_err("not UTF-8");
        assert!(latin.to_string().contains("CSV UTF-8"), "{latin}");
    }

    #[test]
    fn invalid_line_is_reported_by_number() {
        assert_eq!(
            error("pair,verdict,reviewer\n1,pass,lan\n2,maybe,lan\n"),
            "line 3: \"maybe\" is not a verdict (pass, fail, unsure)"
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
    fn values_that_no_verdict_has_are_refused_by_line() {
        const NOW: i64 = 1_800_000_000_000;
        let refused = |rows: Result<Vec<_>, _>| {
            let rows = rows.expect("a list");
            check_values(&rows, NOW).map_err(|error| error.to_string())
        };
        let good = "1,pass,lan,,,\n";
        for (row, why) in [
            (
                "1,pass,\"lan\nminh\",,,\n",
                "the reviewer's name must be one line",
            ),
            (
                "1,pass,lan\u{1b}[2J,,,\n",
                "the reviewer's name must be one line",
            ),
            ("1,pass,lan,angle,,\n", "only a fail has a reason"),
            ("1,pass,lan,,a\0b,\n", "a note is text of at most 2000"),
            (
                "1,pass,lan,,,2999-01-01\n",
                "the time of a verdict is from 1970",
            ),
            (
                "1,pass,lan,,,1815-01-01\n",
                "the time of a verdict is from 1970",
            ),
        ] {
            let text = format!("pair,verdict,reviewer,reason,note,at\n{good}{row}");
            let error = refused(parse_csv(text.as_bytes())).expect_err(row);
            assert!(error.starts_with(&format!("line 3: {why}")), "{error}");
        }
        let good = r#""pair":"1","verdict":"pass","reviewer":" lan ""#;
        for (field, why) in [
            ("", ""),
            (r#","at":9223372036854775807"#, "the time of a verdict"),
            (r#","angle_read_deg":900"#, "an angle is from"),
            (r#","shown_ms":18446744073709551615"#, "the display time"),
            (r#","event":"a\u0000""#, "an event is 1 to 64"),
        ] {
            let text = format!("{{{good}{field}}}\n");
            let checked = refused(parse_jsonl(text.as_bytes()));
            let error = checked.err().unwrap_or_default();
            assert!(
                error.trim_start_matches("line 1: ").starts_with(why),
                "{error}"
            );
            assert_eq!(error.is_empty(), why.is_empty(), "{field}");
        }
        let twice = error("pair,verdict,reviewer,pair\n1,pass,lan,2\n");
        assert!(
            twice.starts_with("line 1: column pair is there twice"),
            "{twice}"
        );
    }

    #[test]
    fn unknown_pair_is_reported_by_line() {
        let rows = parse_csv(b"pair,verdict,reviewer\n1,pass,lan\n2,pass,lan\n").expect("valid");
        let unknown = ["2".parse().expect("valid id")];
        let error = refuse_unknown(&rows, &unknown).expect_err("refused");
        assert!(
            error.to_string().starts_with("line 3: there is no pair 2"),
            "{error}"
        );
    }

    #[test]
    fn json_lines_are_read_back_without_undone_verdicts() {
        let text = r#"{"id":1,"act":1,"pair":"0001","metric":"density","verdict":"fail","reviewer":"lan","reason":"angle","note":"a, b","at":5,"undone_at":null,"current":true}

{"pair":"0001","verdict":"pass","reviewer":"lan","undone_at":7}
{"pair":"0002","verdict":"pass","reviewer":"lan"}
"#;
        let rows = parse_jsonl(text.as_bytes()).expect("valid");
        assert_eq!(rows.iter().map(|row| row.line).collect::<Vec<_>>(), [1, 4]);
        let first = &rows[0].verdict;
        assert_eq!(first.metric, Some(ThresholdMetric::Density));
        assert_eq!(first.verdict, Verdict::Fail);
        assert_eq!(first.reason, Some(Reason::Angle));
        assert_eq!(first.note.as_deref(), Some("a, b"));
        assert_eq!(rows[1].verdict.metric, None);
    }

    #[test]
    fn invalid_json_line_is_reported_by_number() {
        let good = r#"{"pair":"1","verdict":"pass","reviewer":"lan"}"#;
        for (line, why) in [
            (
                r#"{"pair":"1","verdict":"maybe","reviewer":"lan"}"#,
                "maybe",
            ),
            (
                r#"{"pair":"1","verdict":"pass","reviewer":" "}"#,
                "reviewer is empty",
            ),
            (r#"{"pair":"1","verdict":"pass"}"#, "reviewer"),
            ("pass", "expected"),
        ] {
            let text = format!("{good}\n{line}\n");
            let error = parse_jsonl(text.as_bytes())
                .expect_err("refused")
                .to_string();
            assert!(
                error.starts_with("line 2: ") && error.contains(why),
                "{error}"
            );
        }
    }
}
