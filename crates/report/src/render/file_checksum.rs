//! The checksum in the file of a report, by which changes are found before another report replaces the file.
//!
//! HTML, Markdown and LaTeX have it in a comment, which nobody sees. CSV, JSON and plain text have no comments, and other
//! programs read them, so they stay as they are printed.

use super::earlier_report::MARKDOWN_PROGRAM;
use super::latex;
use mocban_core::domain::{is_text_changed, with_text_checksum};

/// The comment with the checksum in HTML and Markdown: what stands before and behind it.
const MARKUP_COMMENT: [&str; 2] = ["<!-- checksum ", " -->"];
/// The same in LaTeX.
const LATEX_COMMENT: [&str; 2] = ["% checksum ", ""];

/// Returns a report for a file: in HTML, Markdown and LaTeX, with a checksum of its content.
pub fn with_checksum(report: &str) -> String {
    if report.starts_with("<!DOCTYPE html>") || report.contains(MARKDOWN_PROGRAM) {
        with_text_checksum(report, MARKUP_COMMENT)
    } else if report.starts_with(latex::PREAMBLE) {
        with_text_checksum(report, LATEX_COMMENT)
    } else {
        report.to_owned()
    }
}

/// Returns whether the file of a report has another content than the report had. The ends of lines do not count. `None` if
/// there is no checksum, as in files of earlier versions.
pub fn is_changed(file: &[u8]) -> Option<bool> {
    is_text_changed(file, &[MARKUP_COMMENT, LATEX_COMMENT])
}

#[cfg(test)]
mod tests {
    use super::{is_changed, with_checksum};
    use crate::render::{ReportFormat, is_report, render};
    use crate::test_fixtures;

    /// Returns the reports of the fixture that have comments, as files.
    fn files() -> Vec<(ReportFormat, String)> {
        let reports = ReportFormat::ALL.map(|format| {
            let printed = render(&test_fixtures::full_report(), format);
            assert_eq!(is_changed(printed.as_bytes()), None, "{format}");
            let file = with_checksum(&printed);
            assert!(is_report(file.as_bytes()), "{format}: {file}");
            (format, printed, file)
        });
        let changed = reports
            .into_iter()
            .filter(|(_, printed, file)| printed != file);
        changed.map(|(format, _, file)| (format, file)).collect()
    }

    #[test]
    fn formats_with_comments_have_a_checksum_that_survives_other_ends_of_lines() {
        let formats: Vec<ReportFormat> = files().iter().map(|(format, _)| *format).collect();
        for format in [
            ReportFormat::Html,
            ReportFormat::Markdown,
            ReportFormat::Latex,
        ] {
            assert!(formats.contains(&format), "{format}");
        }
        for (format, file) in files() {
            for saved in [
                file.clone(),
                file.replace('\n', "\r\n"),
                format!("\u{feff}{file}"),
                format!("{file}\n"),
            ] {
                assert_eq!(is_changed(saved.as_bytes()), Some(false), "{format}");
            }
        }
    }

    #[test]
    fn a_change_at_any_place_is_found() {
        for (format, file) in files() {
            let digits: Vec<usize> = file
                .match_indices(|c: char| c.is_ascii_digit())
                .map(|(at, _)| at)
                .collect();
            assert!(digits.len() > 32, "{format}: {file}");
            for at in digits.iter().step_by(digits.len() / 30) {
                let mut changed = file.clone().into_bytes();
                changed[*at] = if changed[*at] == b'7' { b'1' } else { b'7' };
                assert_eq!(is_changed(&changed), Some(true), "{format}: byte {at}");
            }
            let mut ends = file.match_indices('\n').map(|(at, _)| at);
            let middle = ends.find(|at| 2 * at > file.len()).expect("a line");
            let (before, after) = file.split_at(middle + 1);
            for changed in [
                format!("{before}my note\n{after}"),
                format!("{file}seen by lan\n"),
            ] {
                assert_eq!(is_changed(changed.as_bytes()), Some(true), "{format}");
            }
        }
    }
}
