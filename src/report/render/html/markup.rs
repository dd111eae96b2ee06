//! Tables as HTML. Each has a caption and column headers, and the first cell of a row is the row's header.

use maud::{Markup, html};

use crate::report::render::table::{ColumnFormat, Table, TableColumn};

/// Returns a table in a frame that scrolls sideways if the table is too wide.
pub(super) fn table(table: &Table) -> Markup {
    html! {
        div.wide tabindex="0" role="region" aria-label=(name(table)) {
            table {
                caption { span { (table.caption) } }
                thead { tr { @for column in &table.columns { th scope="col" class=(class(column)) { (column.header) } } } }
                tbody { @for row in &table.rows { (line(table, row)) } }
            }
        }
    }
}

/// Returns the name of a table: the header of its first column.
fn name(table: &Table) -> &str {
    table.columns.first().map_or("", |column| column.header)
}

fn line(table: &Table, row: &[Option<String>]) -> Markup {
    html! {
        tr {
            @for (i, (cell, column)) in row.iter().zip(&table.columns).enumerate() {
                @if i == 0 {
                    th scope="row" { (cell_text(cell.as_deref(), column.format)) }
                } @else {
                    td class=(class(column)) { (cell_text(cell.as_deref(), column.format)) }
                }
            }
        }
    }
}

/// Returns a cell with its hyphen replaced by an en dash or a minus sign.
fn cell_text(cell: Option<&str>, format: ColumnFormat) -> Markup {
    match (cell, format) {
        (Some(text), ColumnFormat::Interval) => html! { (text.replace('-', "\u{2013}")) },
        (Some(text), ColumnFormat::Number(_)) => html! { (text.replace('-', "\u{2212}")) },
        (Some(text), ColumnFormat::Text) => html! { (text) },
        (None, _) => html! { span.none title="does not exist" { "\u{2013}" } },
    }
}

const fn class(column: &TableColumn) -> &'static str {
    match column.format {
        ColumnFormat::Text => "text",
        ColumnFormat::Interval => "interval",
        ColumnFormat::Number(_) => "number",
    }
}
