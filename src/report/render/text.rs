//! The report for a terminal of 80 columns.

use super::comparison_tables::{comparison_sentences, score_comparisons};
use super::report_tables::{headline, tables};
use super::risk_coverage_tables::short_tables;
use super::table::{ColumnFormat, Table, TableColumn};
use crate::domain::one_line;
use crate::report::model::{FailureGroup, Report};
use crate::report::number_format::NumberStyle::PValue;
use crate::report::number_format::{format_count, format_number};
use crate::report::score_comparison::conclusions;

/// Columns of the terminal.
const WIDTH: usize = 80;
/// Most failed pairs that are listed per class.
const MAX_LISTED: usize = 5;

/// Returns the report as aligned text.
pub(super) fn render(report: &Report) -> String {
    let mut blocks = vec![format!("{}\n", headline(report))];
    let tables = tables(report).into_iter().chain(short_tables(report));
    blocks.extend(tables.map(|table| with_caption(&table)));
    if !report.has_verdicts() && report.progress.done > 0 {
        let note = "Nobody has judged these results yet, so there is no Acc.";
        blocks.push(wrapped("", note));
    }
    blocks.extend((!report.comparisons.is_empty()).then(|| comparisons(report)));
    if let Some(table) = score_comparisons(report) {
        let sentences = conclusions(&report.score_comparisons);
        blocks.push(sentences.iter().map(|text| wrapped("", text)).collect());
        blocks.push(with_caption(&table));
    }
    if !report.warnings.is_empty() {
        let warnings = report.warnings.iter();
        blocks.push(warnings.map(|warning| wrapped("! ", warning)).collect());
    }
    blocks.extend(report.failures.iter().map(failures));
    blocks.join("\n")
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

fn comparisons(report: &Report) -> String {
    let sentences = comparison_sentences(report);
    let mut lines = Vec::new();
    for (found, sentence) in report.comparisons.iter().zip(sentences) {
        lines.push(wrapped("", &sentence));
        if let Some((p, p_holm)) = found.p.zip(found.p_holm) {
            let [a_only, b_only, n] = [found.a_only, found.b_only, found.n].map(format_count);
            let [p, p_holm] = [p, p_holm].map(|p| format_number(p, PValue));
            lines.push(format!(
                "    only the first is right: {a_only} of {n}, only the second: {b_only}; p {p}, Holm {p_holm}\n"
            ));
        }
    }
    lines.concat()
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

/// Breaks a text into lines. The first line begins with `mark`; the others are indented to the same column.
pub(super) fn wrapped(mark: &str, text: &str) -> String {
    let indent = mark.chars().count();
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let width = |line: &String| indent + line.chars().count() + 1 + word.chars().count();
        match lines.last_mut() {
            Some(line) if width(line) <= WIDTH => *line = format!("{line} {word}"),
            Some(_) | None => lines.push(word.to_owned()),
        }
    }
    let break_and_indent = format!("\n{}", " ".repeat(indent));
    format!("{mark}{}\n", lines.join(&break_and_indent))
}

#[cfg(test)]
mod tests {
    use super::{render, wrapped};
    use crate::report::test_fixtures;

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let text = render(&test_fixtures::full_report());
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "{line:?}");
        }
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
