//! The report as Markdown tables of GitHub's dialect.

use super::code_spans::{SentencePart, parts};
use super::comparison_tables::{comparison_sentences, comparisons, score_comparisons};
use super::provenance_lines::provenance_lines;
use super::report_tables::tables;
use super::risk_coverage_tables::full_tables;
use super::table::{ColumnFormat, Table};
use crate::model::{FailureGroup, Report};
use crate::score_comparison::conclusions;
use mocban_core::domain::one_line;
use mocban_results::number_format::format_count;

/// Returns the report as Markdown.
pub(super) fn render(report: &Report) -> String {
    let headline = report.headline.iter().map(|text| sentence(text));
    let mut blocks = vec![format!("{}\n", headline.collect::<Vec<_>>().join("\n"))];
    for found in tables(report).iter().chain(&full_tables(report)) {
        blocks.extend(with_caption(found));
    }
    let compared = comparisons(report);
    if !compared.is_empty() {
        blocks.push(list(&comparison_sentences(report)));
        blocks.extend(compared.iter().flat_map(with_caption));
    }
    if let Some(found) = score_comparisons(report) {
        blocks.push(list(&conclusions(&report.score_comparisons)));
        blocks.extend(with_caption(&found));
    }
    for warning in &report.warnings {
        blocks.push(format!("> **Note:** {}\n", escape(warning)));
    }
    blocks.extend(report.failures.iter().map(failures));
    let provenance = provenance_lines(report).into_iter();
    let provenance = provenance.map(|(what, text)| format!("- {what}: {}\n", escape(&text)));
    blocks.push(format!(
        "**Provenance**\n\n{}",
        provenance.collect::<String>()
    ));
    blocks.join("\n")
}

/// Returns a sentence with its commands as code.
fn sentence(text: &str) -> String {
    let part = |part| match part {
        SentencePart::Words(words) => escape(words),
        SentencePart::Command(command) => format!("`{command}`"),
    };
    parts(text).map(part).collect()
}

fn list(sentences: &[String]) -> String {
    let items = sentences.iter();
    let items = items.map(|text| format!("- {}\n", escape(text)));
    items.collect::<Vec<_>>().concat()
}

fn with_caption(table: &Table) -> [String; 2] {
    let headers = table.columns.iter().map(|column| escape(column.header));
    let delimiters = table.columns.iter().map(|column| match column.format {
        ColumnFormat::Text | ColumnFormat::Interval => "---".to_owned(),
        ColumnFormat::Number(_) => "---:".to_owned(),
    });
    let mut text = line(headers) + &line(delimiters);
    for row in &table.rows {
        let cells = row.iter().map(Option::as_deref);
        text += &line(cells.map(|cell| cell.map_or("–".to_owned(), escape)));
    }
    [text, format!("{}\n", escape(&table.caption))]
}

fn line(cells: impl Iterator<Item = String>) -> String {
    format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
}

fn failures(group: &FailureGroup) -> String {
    let class = escape(group.class.name());
    let count = format_count(group.count);
    let mut lines = vec![format!("**Failed: {count} {class}**\n\n")];
    lines.extend(group.pairs.iter().map(|pair| {
        let (id, error) = (escape(pair.id.as_str()), escape(&pair.error));
        format!("- {id} ({}): {error}\n", pair.stage)
    }));
    let more = group.count - group.pairs.len() as u64;
    lines.extend((more > 0).then(|| format!("- and {} more\n", format_count(more))));
    lines.concat()
}

/// Escapes text so that Markdown shows it unchanged, on one line.
fn escape(text: &str) -> String {
    let escape = |c| match c {
        '\\' | '`' | '*' | '_' | '|' | '<' | '>' | '[' | ']' | '#' | '~' => format!("\\{c}"),
        other => other.to_string(),
    };
    // `one_line` comes first, because the backslashes that it adds must be escaped too.
    one_line(text).chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::{escape, render};
    use crate::{ReportAccumulator, test_fixtures};
    use mocban_core::domain::FailureClass;
    use mocban_results::TruthEvaluation;

    #[test]
    fn messages_cannot_add_markup() {
        let mut report = ReportAccumulator::default();
        let failed = test_fixtures::failed("b_1", FailureClass::BadInput, "x|y <b>.stl");
        report.add(&failed, &TruthEvaluation::default());
        let text = render(&report.finish());
        let line = "- b\\_1 (fit): x\\|y \\<b\\>.stl\n";
        assert!(text.contains(line), "{text}");
    }

    #[test]
    fn a_line_break_cannot_leave_its_cell() {
        assert_eq!(escape("a\r\n| b"), "a  \\| b");
    }
}
