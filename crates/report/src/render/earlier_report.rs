//! Recognizes a report that was written to a file, so that no other file is replaced by a new one.

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::provenance_lines::{LABEL_WIDTH, LABELS};
use super::{csv, html, latex};

/// Fields of every report in JSON.
#[derive(Deserialize)]
struct JsonReport {
    #[serde(rename = "headline")]
    _headline: IgnoredAny,
    #[serde(rename = "rows")]
    _rows: IgnoredAny,
    #[serde(rename = "provenance")]
    _provenance: IgnoredAny,
}

/// Returns whether a file is a report, in any format.
pub fn is_report(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    if text.starts_with(b"{") {
        return serde_json::from_slice::<JsonReport>(text).is_ok();
    }
    let has = |part: &str| {
        text.windows(part.len())
            .any(|found| found == part.as_bytes())
    };
    text.starts_with(csv::HEADER.trim_end().as_bytes())
        || text.starts_with(latex::PREAMBLE.as_bytes())
        || text.starts_with(b"<!DOCTYPE html>") && has(html::GENERATOR)
        || has(PLAIN_PROGRAM)
        || has(MARKDOWN_PROGRAM)
}

/// Returns whether somebody added something at the end of a report without a checksum: each format ends in its own way, and
/// CSV has nothing but rows of numbers. Changes in other places are not found.
pub fn is_continued(report: &[u8]) -> bool {
    // JSON with anything behind it is no report.
    if report.trim_ascii_start().starts_with(b"{") {
        return false;
    }
    let Ok(text) = std::str::from_utf8(report) else {
        return true;
    };
    let text = text.trim();
    let is_whole = if let Some(rows) = text.strip_prefix(csv::HEADER.trim_end()) {
        rows.lines().skip(1).all(is_csv_row)
    } else if text.starts_with(latex::PREAMBLE) {
        let last = text.rsplit("\\begin{table}").next().unwrap_or_default();
        last.contains("\\label{tab:mocban-provenance}") && last.ends_with("\\end{table}")
    } else if text.starts_with("<!DOCTYPE html>") {
        text.ends_with("</html>")
    } else if let Some((_, end)) = text.rsplit_once(MARKDOWN_PROGRAM) {
        let is_item = |line: &str| {
            let mut labels = LABELS.iter();
            let item = line.strip_prefix("- ").unwrap_or_default();
            labels.any(|label| {
                let rest = item.strip_prefix(label);
                rest.is_some_and(|rest| rest.starts_with(": "))
            })
        };
        end.lines().skip(1).all(is_item)
    } else if let Some((_, end)) = text.rsplit_once(PLAIN_PROGRAM) {
        // A long line goes on below its text.
        let is_wrapped = |line: &str| line.starts_with(&" ".repeat(LABEL_WIDTH + 1));
        let is_item = |line: &str| {
            let mut labels = LABELS.iter();
            labels.any(|label| line.starts_with(&format!("{label:<LABEL_WIDTH$} ")))
        };
        let mut lines = end.lines().skip(1);
        lines.all(|line| is_item(line) || is_wrapped(line))
    } else {
        false
    };
    !is_whole
}

/// Returns whether a line is a row of a report in CSV: two names and four numbers, of which some may be missing.
fn is_csv_row(line: &str) -> bool {
    let cells: Vec<&str> = line.split(',').collect();
    let [metric, quantity, numbers @ ..] = cells.as_slice() else {
        return false;
    };
    let is_name = |name: &str| {
        let mut bytes = name.bytes();
        !name.is_empty() && bytes.all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
    };
    let is_number = |cell: &&str| cell.is_empty() || cell.parse::<f64>().is_ok();
    is_name(metric) && is_name(quantity) && numbers.len() == 4 && numbers.iter().all(is_number)
}

/// The line of a report as text that names the program.
const PLAIN_PROGRAM: &str = "\nProgram      mocban ";
/// The same in Markdown, with its title.
pub(super) const MARKDOWN_PROGRAM: &str = "\n**Provenance**\n\n- Program: mocban ";

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{LABELS, PLAIN_PROGRAM, is_continued, is_report};
    use crate::{ChangedSetting, ReportAccumulator, ReportFormat, render, test_fixtures};
    use mocban_results::TruthEvaluation;

    #[test]
    fn every_format_is_recognized_and_files_of_a_project_are_not() {
        for pairs in [0, 1] {
            let mut report = ReportAccumulator::default();
            for _ in 0..pairs {
                let pair = test_fixtures::done("a", 0.75, &[]);
                report.add(&pair, &TruthEvaluation::default());
            }
            let report = report.finish();
            for format in ReportFormat::ALL {
                let text = render(&report, format);
                assert!(is_report(text.as_bytes()), "{format}: {text}");
                assert!(!is_continued(text.as_bytes()), "{format}: {text}");
                if format == ReportFormat::Json {
                    continue;
                }
                for note in [
                    "My notes: good.\n",
                    "\n- My note\n",
                    "a,b,c\n",
                    "<p>Note</p>\n",
                ] {
                    let continued = format!("{text}{note}");
                    assert!(is_continued(continued.as_bytes()), "{format}: {note}");
                }
            }
        }
        for other in [
            "",
            "id,mesh,print\na,a.stl,a.png\n",
            "{\"id\": \"a\", \"angle_deg\": 3}\n{\"id\": \"b\", \"angle_deg\": 3}\n",
            "{\"shapes\": [], \"imagePath\": \"page.png\"}",
            "<!DOCTYPE html>\n<html><head><title>Report on mocban</title></head></html>\n",
            "My thesis on mocban.\n",
            "\u{89}PNG\r\n",
        ] {
            assert!(!is_report(other.as_bytes()), "{other}");
        }
    }

    #[test]
    fn no_line_of_a_full_report_counts_as_added() {
        let mut report = test_fixtures::full_report();
        let changed = ChangedSetting {
            name: "register.min_confidence".to_owned(),
            value: json!(0.25),
            default: json!(0.5),
        };
        for used in &mut report.provenance.settings {
            used.changed = Some(vec![changed.clone(); 3]);
        }
        for format in ReportFormat::ALL {
            let text = render(&report, format);
            assert!(!is_continued(text.as_bytes()), "{format}: {text}");
        }
        let text = render(&report, ReportFormat::Text);
        let (_, end) = text.rsplit_once(PLAIN_PROGRAM).expect("the program");
        assert!(end.lines().count() > LABELS.len(), "a line wraps: {end}");
    }
}
