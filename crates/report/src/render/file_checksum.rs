//! The checksum in the file of a report, by which changes are found before another report replaces the file.

use std::fmt::Write as _;

use serde::Deserialize;

use super::earlier_report::MARKDOWN_PROGRAM;
use super::{csv, latex};
use mocban_core::domain::ContentHash;

/// Hexadecimal digits of a checksum.
const DIGITS: usize = 32;
/// What stands around the checksum in the last line of text, of HTML and Markdown, and of LaTeX.
const LAST_LINES: [[&str; 2]; 3] = [
    ["Checksum     ", ""],
    ["<!-- checksum ", " -->"],
    ["% checksum ", ""],
];
/// What stands before the checksum in JSON, which is the last field.
const JSON_FIELD: &str = ",\n  \"checksum\": \"";
/// The last column of CSV. Only its first row has a value.
const CSV_COLUMN: &str = ",checksum";

/// The field of a report in JSON.
#[derive(Deserialize)]
struct ChecksumField {
    checksum: Option<String>,
}

/// Returns a report with a checksum of its content, for a file.
pub fn with_checksum(report: &str) -> String {
    let text = report.trim_end();
    if let Some(fields) = text.strip_suffix('}').filter(|_| text.starts_with('{')) {
        let fields = fields.trim_end();
        return format!("{fields}{JSON_FIELD}{}\"\n}}\n", checksum(fields));
    }
    if text.starts_with(csv::HEADER.trim_end()) {
        return csv_with_checksum(text);
    }
    let [before, behind] = if text.starts_with("<!DOCTYPE html>") || text.contains(MARKDOWN_PROGRAM)
    {
        LAST_LINES[1]
    } else if text.starts_with(latex::PREAMBLE) {
        LAST_LINES[2]
    } else {
        LAST_LINES[0]
    };
    format!("{text}\n{before}{}{behind}\n", checksum(text))
}

fn csv_with_checksum(text: &str) -> String {
    let checksum = checksum(text);
    let mut rows = text.lines();
    let mut sealed = String::new();
    if let Some(header) = rows.next() {
        let _ = write!(sealed, "{header}{CSV_COLUMN}\r\n");
    }
    for (nth, row) in rows.enumerate() {
        let cell = if nth == 0 { checksum.as_str() } else { "" };
        let _ = write!(sealed, "{row},{cell}\r\n");
    }
    sealed
}

/// Returns whether the file of a report has another content than the report had. The ends of lines do not count. `None` if
/// there is no checksum, as in files of earlier versions.
pub fn is_changed(file: &[u8]) -> Option<bool> {
    let text = String::from_utf8_lossy(file).replace('\r', "");
    let text = text.trim_start_matches('\u{feff}');
    if text.trim_start().starts_with('{') {
        is_json_changed(text)
    } else if text.starts_with(csv::HEADER.trim_end()) {
        is_csv_changed(text)
    } else {
        let mut lines = LAST_LINES.into_iter();
        lines.find_map(|around| is_text_changed(text, around))
    }
}

fn is_json_changed(text: &str) -> Option<bool> {
    let fields: ChecksumField = serde_json::from_str(text).ok()?;
    let stored = fields.checksum?;
    // Another program may have written the fields anew.
    let end = format!("{JSON_FIELD}{stored}\"\n}}");
    let content = text.trim_end().strip_suffix(&end);
    Some(content.is_none_or(|content| checksum(content) != stored))
}

fn is_csv_changed(text: &str) -> Option<bool> {
    let mut lines = text.trim_end().lines();
    let mut content = vec![lines.next()?.strip_suffix(CSV_COLUMN)?];
    let mut stored = None;
    for line in lines {
        let Some((row, cell)) = line.rsplit_once(',') else {
            return Some(true);
        };
        if stored.is_none() {
            stored = Some(cell);
        } else if !cell.is_empty() {
            return Some(true);
        }
        content.push(row);
    }
    Some(checksum(&content.join("\n")) != stored?)
}

fn is_text_changed(text: &str, [before, behind]: [&str; 2]) -> Option<bool> {
    let (content, rest) = text.rsplit_once(&format!("\n{before}"))?;
    let (stored, rest) = rest.split_at_checked(DIGITS)?;
    let rest = rest.strip_prefix(behind)?;
    let is_checksum = stored.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_checksum.then(|| !rest.trim().is_empty() || checksum(content) != stored)
}

/// Returns the checksum of a text, whatever ends its lines and whatever white space follows.
fn checksum(text: &str) -> String {
    let text = text.replace('\r', "");
    let mut digits = ContentHash::of(text.trim_end().as_bytes()).to_hex();
    digits.truncate(DIGITS);
    digits
}

#[cfg(test)]
mod tests {
    use super::{is_changed, with_checksum};
    use crate::render::{ReportFormat, is_report, render};
    use crate::test_fixtures;

    /// Returns the report of the fixture in a format, as a file.
    fn file(format: ReportFormat) -> String {
        with_checksum(&render(&test_fixtures::full_report(), format))
    }

    #[test]
    fn a_file_of_every_format_is_a_report_as_it_was_written() {
        for format in ReportFormat::ALL {
            let text = render(&test_fixtures::full_report(), format);
            assert_eq!(is_changed(text.as_bytes()), None, "{format}");
            let file = file(format);
            assert!(is_report(file.as_bytes()), "{format}: {file}");
            assert_eq!(is_changed(file.as_bytes()), Some(false), "{format}: {file}");
            assert_eq!(file, with_checksum(&text), "{format}");
            for saved in [
                file.replace("\r\n", "\n"),
                file.replace("\r\n", "\n").replace('\n', "\r\n"),
                format!("\u{feff}{file}"),
                format!("{file}\n"),
            ] {
                assert_eq!(is_changed(saved.as_bytes()), Some(false), "{format}");
            }
        }
    }

    #[test]
    fn a_change_at_any_place_is_found_in_every_format() {
        for format in ReportFormat::ALL {
            let file = file(format);
            let digits: Vec<usize> = file
                .match_indices(|c: char| c.is_ascii_digit())
                .map(|(at, _)| at)
                .collect();
            assert!(digits.len() > 32, "{format}: {file}");
            for at in digits.iter().step_by(digits.len() / 30) {
                let mut changed = file.clone().into_bytes();
                changed[*at] = if changed[*at] == b'7' { b'1' } else { b'7' };
                assert_ne!(is_changed(&changed), Some(false), "{format}: byte {at}");
            }
            let mut ends = file.match_indices('\n').map(|(at, _)| at);
            let middle = ends.find(|at| 2 * at > file.len()).expect("a line");
            let (before, after) = file.split_at(middle + 1);
            for note in ["my note\n", "my note,\n"] {
                let with_note = format!("{before}{note}{after}");
                assert_ne!(
                    is_changed(with_note.as_bytes()),
                    Some(false),
                    "{format}: {note}"
                );
            }
        }
    }

    #[test]
    fn text_behind_the_checksum_is_a_change() {
        for format in ReportFormat::ALL {
            if format == ReportFormat::Json {
                continue;
            }
            let continued = format!("{}seen by lan\n", file(format));
            assert_eq!(is_changed(continued.as_bytes()), Some(true), "{format}");
        }
    }

    #[test]
    fn a_csv_keeps_its_columns_and_has_one_checksum() {
        let file = file(ReportFormat::Csv);
        let mut lines = file.split_terminator("\r\n");
        let header = lines.next().expect("a header");
        assert_eq!(header, "metric,quantity,n,value,low,high,checksum");
        let cells = lines.map(|line| line.rsplit_once(',').expect("a cell").1);
        assert_eq!(cells.filter(|cell| !cell.is_empty()).count(), 1);
    }
}
