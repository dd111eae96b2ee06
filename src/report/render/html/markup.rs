//! Tables as HTML: a caption, heads with their scope, the first cell of a row as its head.

use maud::{Markup, html};

use crate::report::render::table::{ColumnFormat, Table, TableColumn};

/// A table in a frame that scrolls sideways where it is too wide.
pub(super) fn table(table: &Table) -> Markup {
    html! {
        div.wide tabindex="0" role="region" aria-label=(name(table)) {
            table {
                caption { span { (table.caption) } }
                thead { tr { @for column in &table.columns { th scope="col" class=(class(column)) { (column.head) } } } }
                tbody { @for row in &table.rows { (line(table, row)) } }
            }
        }
    }
}

/// What the table is of: the head of its first column.
fn name(table: &Table) -> &str {
    table.columns.first().map_or("", |column| column.head)
}

fn line(table: &Table, row: &[Option<String>]) -> Markup {
    html! {
        tr {
            @for (i, (cell, column)) in row.iter().zip(&table.columns).enumerate() {
                @if i == 0 {
                    th scope="row" { (shown(cell.as_deref(), column.kind)) }
                } @else {
                    td class=(class(column)) { (shown(cell.as_deref(), column.kind)) }
                }
            }
        }
    }
}

/// A cell with the dash or the minus that its hyphen stands for.
fn shown(cell: Option<&str>, kind: ColumnFormat) -> Markup {
    match (cell, kind) {
        (Some(text), ColumnFormat::IntervalMethod) => html! { (text.replace('-', "\u{2013}")) },
        (Some(text), ColumnFormat::Number(_)) => html! { (text.replace('-', "\u{2212}")) },
        (Some(text), ColumnFormat::Words) => html! { (text) },
        (None, _) => html! { span.none title="does not exist" { "\u{2013}" } },
    }
}

const fn class(column: &TableColumn) -> &'static str {
    match column.kind {
        ColumnFormat::Words => "words",
        ColumnFormat::IntervalMethod => "interval",
        ColumnFormat::Number(_) => "number",
    }
}
