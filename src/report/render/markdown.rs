//! The report as Markdown tables.

use super::table::{self, ColumnFormat, Table, TableColumn};
use super::{coverage_tables, scored};
use crate::report::model::{FailureGroup, Report};
use crate::report::score_comparison::in_words;

/// The report as Markdown.
pub(super) fn render(report: &Report) -> String {
    let mut blocks = vec![format!("{}\n", table::headline(report))];
    for found in table::tables(report)
        .into_iter()
        .chain(coverage_tables::full(report))
        .chain(table::comparisons_in_words(report))
        .chain(scored::comparisons(report))
    {
        blocks.push(piped(&found));
        blocks.push(format!("{}\n", escape(&found.caption)));
    }
    if scored::comparisons(report).is_some() {
        let said = in_words(&report.score_comparisons);
        let said: Vec<String> = said
            .iter()
            .map(|words| format!("- {}\n", escape(words)))
            .collect();
        blocks.push(said.concat());
    }
    for warning in &report.warnings {
        blocks.push(format!("> **Note:** {}\n", escape(warning)));
    }
    blocks.extend(report.failures.iter().map(failures));
    blocks.join("\n")
}

fn piped(table: &Table) -> String {
    let heads = table.columns.iter().map(|column| escape(column.head));
    let rules = table.columns.iter().map(|column| rule(column).to_owned());
    let mut text = line(heads) + &line(rules);
    for row in &table.rows {
        text += &line(
            row.iter()
                .map(|cell| cell.as_deref().map_or("–".to_owned(), escape)),
        );
    }
    text
}

const fn rule(column: &TableColumn) -> &'static str {
    match column.kind {
        ColumnFormat::Words | ColumnFormat::IntervalMethod => "---",
        ColumnFormat::Number(_) => "---:",
    }
}

fn line(cells: impl Iterator<Item = String>) -> String {
    format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
}

fn failures(group: &FailureGroup) -> String {
    let class = escape(group.class.name());
    let mut lines = vec![format!("**Failed: {} {class}**\n\n", group.count)];
    lines.extend(group.pairs.iter().map(|pair| {
        let (id, error) = (escape(pair.id.as_str()), escape(&pair.error));
        format!("- {id} ({}): {error}\n", pair.stage)
    }));
    let more = group.count - group.pairs.len() as u64;
    lines.extend((more > 0).then(|| format!("- and {more} more\n")));
    lines.concat()
}

/// Text that Markdown shows as it is, on one line.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' | '`' | '*' | '_' | '|' | '<' | '>' | '[' | ']' | '#' | '~' => {
                escaped.push('\\');
                escaped.push(c);
            }
            '\n' | '\r' => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::{escape, render};
    use crate::domain::{FailureClass, Verdict};
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn tables_have_rules_and_escaped_cells() {
        let mut tally = ReportAccumulator::default();
        let none = TruthEvaluation::default();
        tally.add(&test_fixtures::done("a", 0.75, &[Verdict::Pass]), &none);
        tally.add(
            &test_fixtures::failed("b_1", FailureClass::BadInput, "x|y <b>.stl"),
            &none,
        );
        let text = render(&tally.finish());
        let golden = "\
| Method | n | Acc | 95% Wilson | SSIM | IoU | IoU box | Dice |
| --- | ---: | ---: | --- | ---: | ---: | ---: | ---: |
| Non-luminous SSIM | 1 | 1.000 | 0.207-1.000 | 0.810 | 0.750 | 0.900 | 0.857 |
";
        assert!(text.contains(golden), "{text}");
        assert!(
            text.contains("- b\\_1 (fit): x\\|y \\<b\\>.stl\n"),
            "{text}"
        );
        assert!(text.contains("| Ensemble v. Pixel density | verdicts | 1 | 0 | 0 | – | – | right on the same pairs |"), "{text}");
    }

    #[test]
    fn a_line_break_cannot_leave_its_cell() {
        assert_eq!(escape("a\r\n| b"), "a  \\| b");
    }
}
