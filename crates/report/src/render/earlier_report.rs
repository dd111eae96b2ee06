//! Recognizes a report that was written to a file, so that no other file is replaced by a new one.

use serde::Deserialize;
use serde::de::IgnoredAny;

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
    text.starts_with(csv::HEADER.as_bytes())
        || text.starts_with(latex::PREAMBLE.as_bytes())
        || text.starts_with(b"<!DOCTYPE html>") && has(html::GENERATOR)
        || has(PLAIN_PROGRAM)
        || has(MARKDOWN_PROGRAM)
}

/// The line of a report as text that names the program.
const PLAIN_PROGRAM: &str = "\nProgram      mocban ";
/// The same in Markdown, with its title.
const MARKDOWN_PROGRAM: &str = "\n**Provenance**\n\n- Program: mocban ";

#[cfg(test)]
mod tests {
    use super::is_report;
    use crate::{ReportAccumulator, ReportFormat, render, test_fixtures};
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
}
