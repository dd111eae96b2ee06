//! The report as LaTeX tables with `booktabs` rules and `siunitx` columns.

use super::code_spans::{SentencePart, parts};
use super::comparison_tables::{comparisons, score_comparisons};
use super::latex_text::{escape, sentence_text};
use super::provenance_lines::provenance_lines;
use super::report_tables::tables;
use super::risk_coverage_tables::full_tables;
use super::table::{ColumnFormat, Table, TableColumn};
use crate::model::Report;

/// What a document needs, and how characters of other scripts are shown.
pub(super) const PREAMBLE: &str = r"% Needs \usepackage{array,booktabs,graphicx,siunitx}.
% Thousands: \sisetup{group-digits = integer, group-minimum-digits = 4, group-separator = {,}}.
% Labels of tables begin with tab:mocban-, such as \ref{tab:mocban-scores}.
% Letters beyond Latin, such as Han-Nom characters and Vietnamese letters with two marks, are in \mocbanchar. XeLaTeX and
% LuaLaTeX show them if the font of the document has them; pdfLaTeX shows their code points.
\providecommand{\mocbanchar}[2]{\ifdefined\Umathchar#2\else U+#1\fi}
";

/// Returns the report as LaTeX, for `\input`.
pub(super) fn render(report: &Report) -> String {
    let headline = report.headline.iter().map(|text| sentence(text));
    let mut blocks = vec![PREAMBLE.to_owned(), paragraph("", headline)];
    if !report.warnings.is_empty() {
        let warnings = report.warnings.iter().map(|text| sentence_text(text));
        blocks.push(paragraph("Notes: ", warnings));
    }
    let mut tables = tables(report);
    tables.extend(full_tables(report));
    tables.extend(comparisons(report));
    tables.extend(score_comparisons(report));
    blocks.extend(tables.iter().map(float));
    blocks.push(provenance(report));
    blocks.join("\n")
}

/// Returns a paragraph whose lines may have wide spaces, so that no word extends into the margin.
fn paragraph(title: &str, sentences: impl Iterator<Item = String>) -> String {
    let sentences: Vec<String> = sentences.collect();
    let text = sentences.join("\n");
    format!("\\begin{{sloppypar}}\\noindent\n{title}{text}\n\\end{{sloppypar}}\\medskip\n")
}

/// Returns what the numbers were computed from as the last table, so that it stays behind the other tables.
fn provenance(report: &Report) -> String {
    let lines = provenance_lines(report).into_iter();
    let rows = lines.map(|(what, text)| format!("    {what} & {} \\\\\n", sentence_text(&text)));
    let tabular = format!(
        "  \\begin{{tabular}}{{l >{{\\raggedright\\arraybackslash}}p{{0.75\\linewidth}}}}\n    \\toprule\n{}    \
         \\bottomrule\n  \\end{{tabular}}\n",
        rows.collect::<String>()
    );
    placed(
        "provenance",
        "What the numbers were computed from.",
        &tabular,
    )
}

/// Returns a sentence with its commands in the font for code.
fn sentence(text: &str) -> String {
    let part = |part| match part {
        SentencePart::Words(words) => sentence_text(words),
        // Braces keep two hyphens from becoming a dash.
        SentencePart::Command(command) => {
            format!("\\texttt{{{}}}", escape(command).replace("--", "-{}-"))
        }
    };
    parts(text).map(part).collect()
}

/// Returns a floating table. It is scaled down if it is wider than the text.
fn float(table: &Table) -> String {
    let columns: Vec<String> = (0..table.columns.len())
        .map(|i| column_type(table, i))
        .collect();
    let headers = table.columns.iter().map(header);
    let mut body = line(headers) + "    \\midrule\n";
    for row in &table.rows {
        let cells = row.iter().zip(&table.columns);
        body += &line(cells.map(|(cell, column)| cell_text(cell.as_deref(), *column)));
    }
    let columns = columns.join(" ");
    let tabular = format!(
        "  \\resizebox{{\\ifdim\\width>\\linewidth\\linewidth\\else\\width\\fi}}{{!}}{{%\n  \
         \\begin{{tabular}}{{{columns}}}\n    \\toprule\n{body}    \\bottomrule\n  \\end{{tabular}}}}\n"
    );
    placed(table.id, &table.caption, &tabular)
}

/// Returns a float with caption and label above its content.
fn placed(id: &str, caption: &str, content: &str) -> String {
    let caption = sentence_text(caption);
    format!(
        "\\begin{{table}}[htbp]\n  \\centering\\small\\setlength{{\\tabcolsep}}{{3pt}}\n  \
         \\setlength{{\\abovecaptionskip}}{{0pt}}\\setlength{{\\belowcaptionskip}}{{6pt}}\n  \
         \\caption{{{caption}}}\n  \\label{{tab:mocban-{id}}}\n{content}\\end{{table}}\n"
    )
}

/// Returns the type of a column. A column of numbers reserves space for the longest integer part.
fn column_type(table: &Table, index: usize) -> String {
    let ColumnFormat::Number(decimals) = table.columns[index].format else {
        return "l".to_owned();
    };
    let integer_digits = |row: &Vec<Option<String>>| {
        let number = row[index].as_deref().map_or("", |text| text);
        let integer = number.split('.').next().unwrap_or_default();
        integer.chars().filter(|c| *c != ',').count()
    };
    let digits = table.rows.iter().map(integer_digits).fold(1, usize::max);
    format!("S[table-format={digits}.{decimals}]")
}

/// Returns a header. Braces keep `siunitx` from reading it as a number.
fn header(column: &TableColumn) -> String {
    match column.format {
        ColumnFormat::Text | ColumnFormat::Interval => escape(column.header),
        ColumnFormat::Number(_) => format!("{{{}}}", escape(column.header)),
    }
}

fn cell_text(cell: Option<&str>, column: TableColumn) -> String {
    match (cell, column.format) {
        (None, ColumnFormat::Text | ColumnFormat::Interval) => "--".to_owned(),
        (None, ColumnFormat::Number(_)) => "{--}".to_owned(),
        (Some(text), ColumnFormat::Interval | ColumnFormat::Text) => escape(text),
        // `siunitx` adds the separators of thousands itself, and would read a comma as a decimal marker.
        (Some(text), ColumnFormat::Number(_)) => text.replace(',', ""),
    }
}

fn line(cells: impl Iterator<Item = String>) -> String {
    format!("    {} \\\\\n", cells.collect::<Vec<_>>().join(" & "))
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::process::Command;

    use super::render;
    use crate::{Report, ReportAccumulator, test_fixtures};
    use mocban_core::domain::FailureClass;
    use mocban_results::TruthEvaluation;

    /// Compiles a report in a document of the class `article` with its default margins and font size. Returns the log, or
    /// `None` if the engine is not installed.
    fn log_of(engine: &str, report: &Report, dir: &Path) -> Option<String> {
        std::fs::write(dir.join("report.tex"), render(report)).expect("a file");
        let document = "\\documentclass{article}\\usepackage{booktabs,graphicx,siunitx}\n\\begin{document}\n\
                        \\input{report}\n\\end{document}\n";
        std::fs::write(dir.join("document.tex"), document).expect("a file");
        let mut command = Command::new(engine);
        command
            .args(["-interaction=nonstopmode", "document.tex"])
            .current_dir(dir);
        let output = command.output().ok()?;
        let log = String::from_utf8_lossy(&output.stdout).into_owned();
        // A small installation may lack the packages.
        (!log.contains(".sty' not found")).then_some(log)
    }

    fn check(engine: &str, report: &Report) {
        let dir = tempfile::tempdir().expect("a directory");
        let Some(log) = log_of(engine, report, dir.path()) else {
            eprintln!("skipped: {engine} with booktabs, graphicx and siunitx is not installed");
            return;
        };
        for problem in ["Overfull", "\n!", "multiply defined"] {
            assert!(!log.contains(problem), "{problem}: {log}");
        }
        let file = dir.path().join("document.pdf");
        assert!(std::fs::metadata(file).expect("a document").len() > 10_000);
    }

    #[test]
    fn a_report_has_no_overfull_boxes() {
        let mut full = test_fixtures::full_report();
        // A path and characters that the fonts of pdfLaTeX lack.
        let warning = format!(
            "1 record is not used: chữ số 𡨸/{}.json, line 7.",
            "part_".repeat(30)
        );
        full.warnings.push(warning.into());
        full.provenance.compare_with(|_| serde_json::Value::Null);
        check("pdflatex", &full);
        check("xelatex", &full);
    }

    #[test]
    fn small_reports_have_no_overfull_boxes() {
        let mut report = ReportAccumulator::default();
        check("pdflatex", &report.clone().finish());
        report.add(
            &test_fixtures::done("a", 0.8, &[]),
            &TruthEvaluation::default(),
        );
        let failed = test_fixtures::failed("b", FailureClass::Io, "gone");
        report.add(&failed, &TruthEvaluation::default());
        check("pdflatex", &report.finish());
    }

    #[test]
    fn captions_and_labels_are_above_their_table() {
        let text = render(&test_fixtures::full_report());
        let tables = text.split("\\begin{table}").skip(1);
        let mut labels = std::collections::BTreeSet::new();
        for table in tables {
            let at = |part: &str| table.find(part).expect("a part of a table");
            assert!(at("\\caption") < at("\\label") && at("\\label") < at("\\begin{tabular}"));
            let label = &table[at("\\label")..];
            labels.insert(label.split('}').next());
        }
        assert_eq!(labels.len(), text.matches("\\begin{table}").count());
    }
}
