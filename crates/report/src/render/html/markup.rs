//! Sentences and tables as HTML. A table has a caption and column headers, and the first cell of a row is its header.

use maud::{Markup, html};

use crate::named_commands::without_named_commands;
use crate::render::code_spans::{SentencePart, parts};
use crate::render::table::{ColumnFormat, Table, TableColumn};

/// Returns a text of the report with narrow spaces before signs of percent, which stay on the line of their number.
pub(super) fn prose(text: &str) -> String {
    text.replace(" %", "\u{202f}%")
}

/// Returns a sentence that says what to do without a command. Other commands are code.
pub(super) fn sentence(text: &str) -> Markup {
    let text = without_named_commands(text);
    html! {
        @for part in parts(&text) {
            @match part {
                SentencePart::Words(words) => (prose(words)),
                SentencePart::Command(command) => code { (command) },
            }
        }
    }
}

/// Returns a table in a frame that scrolls sideways if the table is too wide.
pub(super) fn table(table: &Table) -> Markup {
    html! {
        div.wide id={ "table-" (table.id) } tabindex="0" role="group" aria-label=(name(table)) {
            table {
                caption { span { (prose(&table.caption)) } }
                thead { tr { @for column in &table.columns { th scope="col" class=(class(column)) { (prose(column.header)) } } } }
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

/// Returns a cell. Hyphens of negative numbers become minus signs.
fn cell_text(cell: Option<&str>, format: ColumnFormat) -> Markup {
    match (cell, format) {
        // Two bounds that are negative stand in a text, such as `-0.017, -0.007`. Dates and ids keep their hyphens.
        (Some(text), format) if format != ColumnFormat::Text || are_numbers(text) => {
            html! { (text.replace('-', "\u{2212}")) }
        }
        (Some(text), _) => html! { (text) },
        (None, _) => html! { span.none title="does not exist" { "\u{2013}" } },
    }
}

/// Returns whether a text is a list of numbers.
fn are_numbers(text: &str) -> bool {
    let mut parts = text.split(", ");
    parts.all(|part| part.parse::<f64>().is_ok())
}

const fn class(column: &TableColumn) -> &'static str {
    match column.format {
        ColumnFormat::Text => "text",
        ColumnFormat::Interval => "interval",
        ColumnFormat::Number(_) => "number",
    }
}
