//! Markdown tables that are readable as plain text.

/// A table of text cells.
pub(super) struct Table {
    title: &'static str,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Creates a table without rows.
    pub(super) fn new(title: &'static str, heads: &[&str]) -> Self {
        Self {
            title,
            rows: vec![heads.iter().map(|head| (*head).to_owned()).collect()],
        }
    }

    /// Adds a row of as many cells as there are heads.
    pub(super) fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    /// Renders title, table and note.
    pub(super) fn render(&self, note: &str) -> String {
        let widths = self.widths();
        let mut lines: Vec<String> = self.rows.iter().map(|row| line(row, &widths)).collect();
        let rule: Vec<String> = widths.iter().map(|width| "-".repeat(*width)).collect();
        lines.insert(1, line(&rule, &widths));
        format!("## {}\n\n{}\n{note}\n", self.title, lines.concat())
    }

    fn widths(&self) -> Vec<usize> {
        let width = |column: usize| {
            let letters = self.rows.iter().map(|row| row[column].chars().count());
            letters.max().unwrap_or(0).max(3)
        };
        (0..self.rows[0].len()).map(width).collect()
    }
}

fn line(cells: &[String], widths: &[usize]) -> String {
    let padded = cells.iter().zip(widths);
    let padded: Vec<String> = padded
        .map(|(cell, width)| format!("{cell:<width$}"))
        .collect();
    format!("| {} |\n", padded.join(" | "))
}

/// Formats a number with a number of decimals, or a dash.
pub(super) fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.decimals$}"))
}

/// Formats two numbers with a slash between them.
pub(super) fn two(values: [Option<f64>; 2], decimals: usize) -> String {
    values.map(|value| number(value, decimals)).join(" / ")
}
