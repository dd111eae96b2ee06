//! The report for a terminal of 80 columns.

use super::comparison_tables::{comparison_sentences, comparisons, score_comparisons};
use super::provenance_lines::{LABEL_WIDTH, provenance_lines};
use super::report_tables::{scores, tables, truth};
use super::risk_coverage_tables::short_tables;
use super::table::{ColumnFormat, Table, TableColumn};
use crate::model::{FailureGroup, Report};
use crate::score_comparison::conclusions;
use mocban_core::domain::{one_line, visible};
use mocban_results::number_format::format_count;

/// Columns of the terminal.
pub(super) const WIDTH: usize = 80;
/// Most failed pairs that are listed per class.
const MAX_LISTED: usize = 5;

/// Returns the beginning of the report as aligned text: the headline, the scores and, if there is ground truth, the
/// errors against it.
pub fn summary(report: &Report) -> String {
    let mut blocks = vec![headline(report), with_caption(&scores(report))];
    if report.has_truth() {
        blocks.push(with_caption(&truth(report)));
    }
    visible(&blocks.join("\n")).into_owned()
}

fn headline(report: &Report) -> String {
    let sentences = report.headline.iter();
    sentences.map(|text| wrapped("", text)).collect()
}

/// Returns the report as aligned text.
pub(super) fn render(report: &Report) -> String {
    let mut blocks = vec![headline(report)];
    let tables = tables(report).into_iter().chain(short_tables(report));
    blocks.extend(tables.map(|table| with_caption(&table)));
    blocks.extend(sentences(&comparison_sentences(report)));
    blocks.extend(comparisons(report).iter().map(with_caption));
    if let Some(table) = score_comparisons(report) {
        blocks.extend(sentences(&conclusions(&report.score_comparisons)));
        blocks.push(with_caption(&table));
    }
    if !report.warnings.is_empty() {
        let warnings = report.warnings.iter();
        blocks.push(warnings.map(|warning| wrapped("! ", warning)).collect());
    }
    blocks.extend(report.failures.iter().map(failures));
    let provenance = provenance_lines(report).into_iter();
    blocks.push(
        provenance
            .map(|(what, text)| wrapped(&format!("{what:<LABEL_WIDTH$} "), &text))
            .collect(),
    );
    blocks.join("\n")
}

/// Returns a block with sentences, or `None` without sentences.
fn sentences(texts: &[String]) -> Option<String> {
    (!texts.is_empty()).then(|| texts.iter().map(|text| wrapped("", text)).collect())
}

/// Returns a table with its caption below.
pub(super) fn with_caption(table: &Table) -> String {
    aligned(table) + &wrapped("", &table.caption)
}

/// Returns a table with padded columns. Text is aligned to the left, numbers to the right.
pub(super) fn aligned(table: &Table) -> String {
    let widths: Vec<usize> = (0..table.columns.len())
        .map(|i| {
            let rows = table.rows.iter();
            let cells = rows.map(|row| cell_text(row[i].as_ref()).chars().count());
            cells.fold(table.columns[i].header.chars().count(), usize::max)
        })
        .collect();
    let headers: Vec<&str> = table.columns.iter().map(|column| column.header).collect();
    let mut text = line(&headers, &table.columns, &widths);
    for row in &table.rows {
        let cells: Vec<&str> = row.iter().map(|cell| cell_text(cell.as_ref())).collect();
        text += &line(&cells, &table.columns, &widths);
    }
    text
}

fn cell_text(cell: Option<&String>) -> &str {
    cell.map_or("-", String::as_str)
}

fn line(cells: &[&str], columns: &[TableColumn], widths: &[usize]) -> String {
    let padded: Vec<String> = cells
        .iter()
        .zip(columns)
        .zip(widths)
        .map(|((cell, column), width)| match column.format {
            ColumnFormat::Text | ColumnFormat::Interval => format!("{cell:<width$}"),
            ColumnFormat::Number(_) => format!("{cell:>width$}"),
        })
        .collect();
    format!("{}\n", padded.join("  ").trim_end())
}

fn failures(group: &FailureGroup) -> String {
    let mut lines = vec![format!(
        "Failed: {} {}\n",
        format_count(group.count),
        group.class
    )];
    let listed = group.pairs.iter().take(MAX_LISTED);
    lines.extend(
        listed.map(|pair| format!("  {}  {}: {}\n", pair.id, pair.stage, one_line(&pair.error))),
    );
    let more = group.count.saturating_sub(MAX_LISTED as u64);
    lines.extend((more > 0).then(|| format!("  and {} more\n", format_count(more))));
    lines.concat()
}

/// Breaks a text into lines. The first line begins with `mark`; the others are indented to the same column. A sign of
/// percent stays on the line of its number.
pub(super) fn wrapped(mark: &str, text: &str) -> String {
    let indent = mark.chars().count();
    let mut lines: Vec<String> = Vec::new();
    let text = text.replace(" %", "\u{a0}%");
    let words = text
        .split([' ', '\n', '\t'])
        .filter(|word| !word.is_empty());
    for word in words {
        let width = |line: &String| indent + line.chars().count() + 1 + word.chars().count();
        match lines.last_mut() {
            Some(line) if width(line) <= WIDTH => *line = format!("{line} {word}"),
            Some(_) | None => lines.push(word.to_owned()),
        }
    }
    let break_and_indent = format!("\n{}", " ".repeat(indent));
    format!("{mark}{}\n", lines.join(&break_and_indent)).replace('\u{a0}', " ")
}

#[cfg(test)]
mod tests {
    use super::{render, wrapped};
    use crate::test_fixtures;

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let text = render(&test_fixtures::full_report());
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "{line:?}");
        }
    }

    #[test]
    fn a_percentage_is_not_broken() {
        let text = wrapped("", &"96.6 % ".repeat(30));
        assert!(text.lines().all(|line| line.ends_with('%')), "{text}");
    }

    #[test]
    fn lines_break_between_words_only() {
        let text = wrapped("! ", &"word ".repeat(40));
        assert!(text.lines().count() > 2);
        assert!(text.lines().skip(1).all(|line| line.starts_with("  word")));
        let long = "x".repeat(200);
        assert_eq!(wrapped("", &long), format!("{long}\n"));
    }
}
