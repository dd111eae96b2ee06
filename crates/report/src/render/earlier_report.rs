//! Recognizes a report that was written to a file, so that no other file is replaced by a new one.

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::provenance_lines::{LABEL_WIDTH, LABELS};
use super::text::WIDTH;
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

/// Returns whether a file is a report, in any format. Ends of lines do not count: other programs change them.
pub fn is_report(bytes: &[u8]) -> bool {
    let text = plain_text(&String::from_utf8_lossy(bytes));
    let text = text.trim_start();
    if text.starts_with('{') {
        return serde_json::from_str::<JsonReport>(text).is_ok();
    }
    text.starts_with(csv::HEADER.trim_end())
        || text.starts_with(latex::PREAMBLE)
        || text.starts_with("<!DOCTYPE html>") && text.contains(html::GENERATOR)
        || text.contains(PLAIN_PROGRAM)
        || text.contains(MARKDOWN_PROGRAM)
}

/// Returns a text without a byte order mark and with the ends of lines of Unix.
fn plain_text(text: &str) -> String {
    text.trim_start_matches('\u{feff}').replace('\r', "")
}

/// Returns whether somebody added something before or behind a report without a checksum, or a row to one in CSV: each format
/// begins and ends in its own way. Changes inside text and Markdown are not found.
pub fn is_continued(report: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(report) else {
        return true;
    };
    let text = plain_text(text);
    let text = text.trim();
    // JSON with anything behind it is no report.
    if text.starts_with('{') {
        return false;
    }
    let is_whole = if let Some(rows) = text.strip_prefix(csv::HEADER.trim_end()) {
        csv::are_rows(rows.lines().skip(1))
    } else if text.starts_with(latex::PREAMBLE) {
        let last = text.rsplit("\\begin{table}").next().unwrap_or_default();
        last.contains("\\label{tab:mocban-provenance}") && last.ends_with("\\end{table}")
    } else if text.starts_with("<!DOCTYPE html>") {
        text.ends_with("</html>")
    } else if let Some((_, end)) = text.rsplit_once(MARKDOWN_PROGRAM) {
        begins_like_report(text) && has_markdown_end(end)
    } else if let Some((_, end)) = text.rsplit_once(PLAIN_PROGRAM) {
        begins_like_report(text) && has_plain_end(end)
    } else {
        false
    };
    !is_whole
}

/// Returns whether a text begins with the first sentence of a report, such as `2 of 4 pairs are aligned`.
fn begins_like_report(text: &str) -> bool {
    let start: String = text.chars().take(MAX_START).collect();
    // Counts are written with commas, and text is broken at blanks.
    let is_digit = |c: char| c.is_ascii_digit() || c == ',';
    let words = start.split_whitespace().map(|word| {
        let is_count = word.starts_with(is_digit) && word.chars().all(is_digit);
        if is_count { "N" } else { word }
    });
    let start = words.collect::<Vec<_>>().join(" ");
    FIRST_WORDS.iter().any(|words| start.starts_with(words))
}

/// Longest beginning of a report that is compared, in characters.
const MAX_START: usize = 120;

/// Beginnings of reports, with `N` for counts.
const FIRST_WORDS: [&str; 8] = [
    "The only pair is ",
    "None of the N pairs is ",
    "N of N pairs is aligned",
    "N of N pairs are aligned",
    "Both pairs are aligned",
    "All N pairs are aligned",
    "The project has no pairs yet",
    "There is nothing to report: ",
];

/// Returns whether the last lines of a report in Markdown, from the version on, are as they were written.
fn has_markdown_end(end: &str) -> bool {
    let labels = end.lines().skip(1).map(|line| {
        let item = line.strip_prefix("- ")?;
        label_at(|label| {
            item.strip_prefix(label)
                .is_some_and(|rest| rest.starts_with(": "))
        })
    });
    labels
        .collect::<Option<Vec<usize>>>()
        .is_some_and(|labels| are_in_order(&labels))
}

/// Returns whether the last lines of a report as text, from the version on, are as they were written. A long line goes on
/// below its text.
fn has_plain_end(end: &str) -> bool {
    let mut labels = Vec::new();
    let mut lines = end.lines();
    let mut last = lines.next().unwrap_or_default();
    for line in lines {
        let found = label_at(|label| line.starts_with(&format!("{label:<LABEL_WIDTH$} ")));
        match (found, line.strip_prefix(&" ".repeat(LABEL_WIDTH + 1))) {
            (Some(label), _) => labels.push(label),
            (None, Some(rest)) if is_wrapped(last, rest) => {}
            (None, _) => return false,
        }
        last = line;
    }
    are_in_order(&labels)
}

/// Returns whether the first word of a line had no room in the line before it.
fn is_wrapped(before: &str, line: &str) -> bool {
    // A sign of percent stays on the line of its number.
    let line = line.replace(" %", "\u{a0}%");
    let word = line.split(' ').next().unwrap_or_default();
    !word.is_empty() && before.chars().count() + 1 + word.chars().count() > WIDTH
}

/// Returns the position of the label that a line has.
fn label_at(has: impl Fn(&str) -> bool) -> Option<usize> {
    LABELS.iter().position(|label| has(label))
}

/// Returns whether labels behind that of the program have the order of a report, in which only settings are repeated.
fn are_in_order(labels: &[usize]) -> bool {
    let is_repeated = |label: usize| LABELS[label] == "Settings";
    let mut pairs = labels.windows(2);
    labels.first() != Some(&0)
        && pairs.all(|pair| pair[0] < pair[1] || pair[0] == pair[1] && is_repeated(pair[0]))
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
        // Each count has another first sentence.
        for (done, pending) in [
            (0, 0),
            (1, 0),
            (0, 1),
            (0, 2),
            (2, 0),
            (1, 1),
            (2, 1),
            (3, 0),
        ] {
            let mut report = ReportAccumulator::default();
            let done = (0..done).map(|i| test_fixtures::done(&format!("a{i}"), 0.75, &[]));
            let pending = (0..pending).map(|i| test_fixtures::pending(&format!("b{i}")));
            for pair in done.chain(pending) {
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
                    "              My note\n",
                    "ensemble,comment,1,2,3,4\n",
                    "ensemble,results,1,2,,\n",
                ] {
                    let continued = format!("{text}{note}");
                    assert!(is_continued(continued.as_bytes()), "{format}: {note}");
                }
                let below = format!("My note\n\n{text}");
                let file = below.as_bytes();
                assert!(!is_report(file) || is_continued(file), "{format}: {below}");
                let unix = text.replace('\r', "");
                for saved in [
                    unix.clone(),
                    unix.replace('\n', "\r\n"),
                    unix.replace('\n', "\r\r\n"),
                    format!("\u{feff}{text}"),
                ] {
                    assert!(is_report(saved.as_bytes()), "{format}: {saved:?}");
                    assert!(!is_continued(saved.as_bytes()), "{format}: {saved:?}");
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
