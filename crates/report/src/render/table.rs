//! A table of text cells, which the text, Markdown, LaTeX and HTML renderers share.

use mocban_core::domain::one_line;
use mocban_results::number_format::NumberStyle::{self, Count, Score, Share};
use mocban_results::number_format::{format_count, format_interval, format_number, format_share};

/// A table of text cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Table {
    /// Its name in labels and addresses, unique in a report: lower case letters and hyphens.
    pub(super) id: &'static str,
    /// Whole sentences on what it shows.
    pub(super) caption: String,
    /// Its columns.
    pub(super) columns: Vec<TableColumn>,
    /// Its rows. A quantity that does not exist is `None`.
    pub(super) rows: Vec<Vec<Option<String>>>,
}

/// A column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TableColumn {
    /// The header.
    pub(super) header: &'static str,
    /// The kind of its cells.
    pub(super) format: ColumnFormat,
}

/// The kind of a column's cells, which decides how they are aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColumnFormat {
    /// Text, aligned to the left.
    Text,
    /// The two bounds of a number, joined by an en dash and aligned to the left.
    Interval,
    /// Numbers with this many decimals, aligned at the decimal point, with a comma between thousands.
    Number(usize),
}

/// A table under construction. Columns are added one by one, each with its header, values and format.
pub(super) struct TableBuilder<T> {
    items: Vec<T>,
    columns: Vec<TableColumn>,
    rows: Vec<Vec<Option<String>>>,
}

impl Table {
    /// Starts a table with a row for each item.
    pub(super) fn of<T>(items: impl IntoIterator<Item = T>) -> TableBuilder<T> {
        let items: Vec<T> = items.into_iter().collect();
        TableBuilder {
            columns: Vec::new(),
            rows: vec![Vec::new(); items.len()],
            items,
        }
    }
}

impl<T> TableBuilder<T> {
    /// Adds a column of text.
    pub(super) fn text<V: Into<String>>(
        self,
        header: &'static str,
        value: impl Fn(&T) -> V,
    ) -> Self {
        self.optional_text(header, |item| Some(value(item).into()))
    }

    /// Adds a column of text that some rows lack.
    pub(super) fn optional_text(
        self,
        header: &'static str,
        value: impl Fn(&T) -> Option<String>,
    ) -> Self {
        self.column(header, ColumnFormat::Text, value)
    }

    /// Adds a column of counts.
    pub(super) fn count<V: Into<Option<u64>>>(
        self,
        header: &'static str,
        value: impl Fn(&T) -> V,
    ) -> Self {
        let format = ColumnFormat::Number(Count.decimals());
        self.column(header, format, |item| value(item).into().map(format_count))
    }

    /// Adds a column of scores, confidences, heights or coefficients.
    pub(super) fn score(self, header: &'static str, value: impl Fn(&T) -> Option<f64>) -> Self {
        self.number(header, Score, value)
    }

    /// Adds a column of shares of counted results, in percent.
    pub(super) fn share(self, header: &'static str, value: impl Fn(&T) -> Option<f64>) -> Self {
        let format = ColumnFormat::Number(Share.decimals());
        self.column(header, format, |item| value(item).map(format_share))
    }

    /// Adds a column of numbers.
    pub(super) fn number(
        self,
        header: &'static str,
        style: NumberStyle,
        value: impl Fn(&T) -> Option<f64>,
    ) -> Self {
        let format = ColumnFormat::Number(style.decimals());
        let text = |value| format_number(value, style);
        self.column(header, format, |item| value(item).map(text))
    }

    /// Adds a column of p-values.
    pub(super) fn p_value(self, header: &'static str, value: impl Fn(&T) -> Option<f64>) -> Self {
        let text = |p| format_number(p, NumberStyle::PValue);
        self.optional_text(header, |item| value(item).map(text))
    }

    /// Adds a column of intervals of numbers of a style.
    pub(super) fn interval(
        self,
        header: &'static str,
        style: NumberStyle,
        value: impl Fn(&T) -> Option<[f64; 2]>,
    ) -> Self {
        let text = |bounds| format_interval(bounds, style);
        self.column(header, ColumnFormat::Interval, |item| value(item).map(text))
    }

    fn column(
        mut self,
        header: &'static str,
        format: ColumnFormat,
        cell: impl Fn(&T) -> Option<String>,
    ) -> Self {
        self.columns.push(TableColumn { header, format });
        for (row, item) in self.rows.iter_mut().zip(&self.items) {
            row.push(cell(item).map(|text| one_line(&text).into_owned()));
        }
        self
    }

    /// Finishes the table with its name and caption.
    pub(super) fn caption(self, id: &'static str, caption: impl Into<String>) -> Table {
        Table {
            id,
            caption: caption.into(),
            columns: self.columns,
            rows: self.rows,
        }
    }
}
