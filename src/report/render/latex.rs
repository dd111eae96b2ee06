//! The report as LaTeX tables with `booktabs` rules and `siunitx` columns.

use super::comparison_tables::{comparisons, score_comparisons};
use super::report_tables::{headline, tables};
use super::risk_coverage_tables::full_tables;
use super::table::{ColumnFormat, Table, TableColumn};
use crate::domain::{one_line, visible};
use crate::report::model::Report;

/// Returns the report as LaTeX, for `\input`.
pub(super) fn render(report: &Report) -> String {
    let mut blocks = vec![format!(
        "% Needs \\usepackage{{booktabs}} and \\usepackage{{siunitx}}.\n\
         % Thousands: \\sisetup{{group-digits = integer, group-minimum-digits = 4, group-separator = {{,}}}}.\n\
         % {}\n",
        comment(&headline(report))
    )];
    for warning in &report.warnings {
        blocks.push(format!("% Note: {}\n", comment(warning)));
    }
    let mut tables = tables(report);
    tables.extend(full_tables(report));
    tables.extend(comparisons(report));
    tables.extend(score_comparisons(report));
    blocks.extend(tables.iter().map(float));
    blocks.join("\n")
}

/// Returns a floating table with its caption.
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
    format!(
        "\\begin{{table}}\n  \\centering\\small\\setlength{{\\tabcolsep}}{{3pt}}\n  \\caption{{{}}}\n  \\begin{{tabular}}{{{}}}\n    \\toprule\n{body}    \
         \\bottomrule\n  \\end{{tabular}}\n\\end{{table}}\n",
        escape(&table.caption),
        columns.join(" "),
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
        (Some(text), ColumnFormat::Interval) => escape(text).replace('-', "--"),
        (Some(text), ColumnFormat::Text) => escape(text),
        // `siunitx` adds the separators of thousands itself, and would read a comma as a decimal marker.
        (Some(text), ColumnFormat::Number(_)) => text.replace(',', ""),
    }
}

fn line(cells: impl Iterator<Item = String>) -> String {
    format!("    {} \\\\\n", cells.collect::<Vec<_>>().join(" & "))
}

/// Returns text that cannot end its comment line.
fn comment(text: &str) -> String {
    one_line(text).into_owned()
}

/// Escapes text so that LaTeX shows it unchanged.
fn escape(text: &str) -> String {
    let escape = |c| match c {
        '&' | '%' | '$' | '#' | '_' | '{' | '}' => format!("\\{c}"),
        '\\' => "\\textbackslash{}".to_owned(),
        '~' => "\\textasciitilde{}".to_owned(),
        '^' => "\\textasciicircum{}".to_owned(),
        '<' => "\\textless{}".to_owned(),
        '>' => "\\textgreater{}".to_owned(),
        '\u{b0}' => "\\textdegree{}".to_owned(),
        '\n' | '\r' => " ".to_owned(),
        other => other.to_string(),
    };
    // `visible` comes first, because the backslashes that it adds must be escaped too.
    visible(text).chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn cells_cannot_hold_commands() {
        assert_eq!(
            escape(r"a_b & 5 % \x {y}"),
            r"a\_b \& 5 \% \textbackslash{}x \{y\}"
        );
        assert_eq!(escape("in 5\u{b0}"), r"in 5\textdegree{}");
    }
}
