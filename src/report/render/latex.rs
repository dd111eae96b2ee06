//! The report as LaTeX tables with `booktabs` rules and `siunitx` columns.

use super::table::{self, ColumnFormat, Table, TableColumn};
use super::{coverage_tables, scored};
use crate::report::model::Report;

/// The report as LaTeX, to be read in by `\input`.
pub(super) fn render(report: &Report) -> String {
    let mut blocks = vec![format!(
        "% Needs \\usepackage{{booktabs}} and \\usepackage{{siunitx}}.\n% {}\n",
        comment(&table::headline(report))
    )];
    for warning in &report.warnings {
        blocks.push(format!("% Note: {}\n", comment(warning)));
    }
    let mut tables = table::tables(report);
    tables.extend(coverage_tables::full(report));
    blocks.extend(
        tables
            .iter()
            .chain(table::comparisons(report).as_ref())
            .chain(scored::comparisons(report).as_ref())
            .map(float),
    );
    blocks.join("\n")
}

/// One table with its caption.
fn float(table: &Table) -> String {
    let columns: Vec<String> = (0..table.columns.len()).map(|i| column(table, i)).collect();
    let heads = table.columns.iter().map(head);
    let mut body = line(heads) + "    \\midrule\n";
    for row in &table.rows {
        body += &line(
            row.iter()
                .zip(&table.columns)
                .map(|(cell, column)| shown(cell.as_deref(), *column)),
        );
    }
    format!(
        "\\begin{{table}}\n  \\centering\\small\\setlength{{\\tabcolsep}}{{3pt}}\n  \\caption{{{}}}\n  \\begin{{tabular}}{{{}}}\n    \\toprule\n{body}    \
         \\bottomrule\n  \\end{{tabular}}\n\\end{{table}}\n",
        escape(&table.caption),
        columns.join(" "),
    )
}

/// The column type; a number column is as wide as its longest cell.
fn column(table: &Table, index: usize) -> String {
    match table.columns[index].kind {
        ColumnFormat::Words | ColumnFormat::IntervalMethod => "l".to_owned(),
        ColumnFormat::Number(decimals) => {
            let whole = |cell: Option<&String>| {
                cell.map_or(1, |text| text.split('.').next().map_or(1, str::len))
            };
            let digits = table
                .rows
                .iter()
                .map(|row| whole(row[index].as_ref()))
                .fold(1, usize::max);
            format!("S[table-format={digits}.{decimals}]")
        }
    }
}

/// A head; braces keep `siunitx` from reading it as a number.
fn head(column: &TableColumn) -> String {
    match column.kind {
        ColumnFormat::Words | ColumnFormat::IntervalMethod => escape(column.head),
        ColumnFormat::Number(_) => format!("{{{}}}", escape(column.head)),
    }
}

fn shown(cell: Option<&str>, column: TableColumn) -> String {
    match (cell, column.kind) {
        (None, _) => missing(column).to_owned(),
        (Some(text), ColumnFormat::IntervalMethod) => escape(text).replace('-', "--"),
        (Some(text), ColumnFormat::Words | ColumnFormat::Number(_)) => escape(text),
    }
}

const fn missing(column: TableColumn) -> &'static str {
    match column.kind {
        ColumnFormat::Words | ColumnFormat::IntervalMethod => "--",
        ColumnFormat::Number(_) => "{--}",
    }
}

fn line(cells: impl Iterator<Item = String>) -> String {
    format!("    {} \\\\\n", cells.collect::<Vec<_>>().join(" & "))
}

/// Text that cannot end its comment line.
fn comment(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// Text that LaTeX sets as it is.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                escaped.push('\\');
                escaped.push(c);
            }
            '\\' => escaped.push_str("\\textbackslash{}"),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '<' => escaped.push_str("\\textless{}"),
            '>' => escaped.push_str("\\textgreater{}"),
            '\u{b0}' => escaped.push_str("\\textdegree{}"),
            '\n' | '\r' => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::{escape, render};
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    const GOLDEN: &str = r"\begin{table}
  \centering\small\setlength{\tabcolsep}{3pt}
  \caption{Acc is the share passed of those passed or failed by reviewers; SSIM, IoU and Dice are means over the n finished pairs, by pixel; IoU box is of bounding boxes.}
  \begin{tabular}{l S[table-format=2.0] S[table-format=1.3] l S[table-format=1.3] S[table-format=1.3] S[table-format=1.3] S[table-format=1.3]}
    \toprule
    Method & {n} & {Acc} & 95\% Wilson & {SSIM} & {IoU} & {IoU box} & {Dice} \\
    \midrule
    Non-luminous SSIM & 12 & {--} & -- & 0.810 & 0.750 & 0.900 & 0.857 \\
    Pixel density & 12 & {--} & -- & 0.810 & 0.750 & 0.900 & 0.857 \\
    Ensemble & 12 & {--} & -- & 0.810 & 0.750 & 0.900 & 0.857 \\
    Relief & 12 & {--} & -- & 0.810 & 0.750 & 0.900 & 0.857 \\
    \bottomrule
  \end{tabular}
\end{table}
";

    #[test]
    fn table_is_booktabs_with_columns_as_wide_as_their_numbers() {
        let mut tally = ReportAccumulator::default();
        for i in 0..12 {
            tally.add(
                &test_fixtures::done(&format!("p{i:02}"), 0.75, &[]),
                &TruthEvaluation::default(),
            );
        }
        let text = render(&tally.finish());
        assert!(text.contains(GOLDEN), "{text}");
        assert!(text.starts_with("% Needs"));
    }

    #[test]
    fn nothing_in_a_cell_is_a_command() {
        assert_eq!(
            escape(r"a_b & 5 % \x {y}"),
            r"a\_b \& 5 \% \textbackslash{}x \{y\}"
        );
        assert_eq!(escape("in 5\u{b0}"), r"in 5\textdegree{}");
    }
}
