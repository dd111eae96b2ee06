//! The columns of a list: which one is the id, the scan, the print, and so on, with the first rows.

use maud::{Markup, html};

use super::components::choice;
use super::import_choice::ImportChoice;
use super::visit::Visit;
use mocban_core::domain::one_line;
use mocban_lists::manifest::ListHead;

/// Value of the address that asks for the columns that the browser has kept.
pub(super) const KEPT_COLUMNS: &str = "kept_columns";

/// Names of the columns in English and Vietnamese, in the order of [`ImportChoice::columns`].
const NAMES: [[&str; 2]; 6] = [
    ["Id (needed)", "Mã (cần có)"],
    ["Scan (needed)", "Bản quét (cần có)"],
    ["Print (needed)", "Bản in (cần có)"],
    ["Character", "Chữ"],
    ["Block", "Ván"],
    ["Unit of the scan", "Đơn vị của bản quét"],
];

/// Longest header, as JSON in bytes, for which the browser keeps the chosen columns.
const MAX_HEADER: usize = 4000;

/// Returns the form that chooses the columns. It is open while a column is missing. The browser keeps what is chosen for lists
/// with the same header.
pub(super) fn columns_part(visit: &Visit, chosen: &ImportChoice, head: &ListHead) -> Markup {
    let columns = chosen.columns();
    let own = columns.iter().map(|column| column.1).chain([KEPT_COLUMNS]);
    let others = own.fold(visit.query.clone(), |query, name| query.with(name, ""));
    // Texts always have a JSON form.
    let header = serde_json::to_string(&head.header).unwrap_or_default();
    let header = Some(header).filter(|header| header.len() <= MAX_HEADER);
    let is_complete = head.is_complete();
    let is_missing = !is_complete && head.refused.is_none();
    html! {
        @if visit.query.get(KEPT_COLUMNS).is_some() {
            p.notice #kept-columns role="status" { (visit.t("The columns that you chose for a list with this header are used again.", "Dùng lại các cột bạn đã chọn cho danh sách có cùng dòng tiêu đề.")) }
        }
        details #columns.card open[!is_complete] data-header=[&header] {
            summary { h2 { (visit.t("Columns of the list", "Các cột của danh sách")) } }
            @if is_missing {
                p.notice.bad role="alert" { (visit.t("A list needs an id, a scan and a print, and the names of its columns do not say which these are. Choose them:", "Danh sách cần mã, bản quét và bản in, nhưng tên các cột không cho biết cột nào. Hãy chọn:")) }
            }
            form.fields method="get" action=(visit.here) {
                @for (name, value) in others.pairs() { input type="hidden" name=(name) value=(value); }
                @for ((field, name, value), names) in columns.into_iter().zip(NAMES) {
                    (column_choice(visit, head, (field, name, value), names[visit.index()]))
                }
                button { (visit.t("Use these columns", "Dùng các cột này")) }
            }
            div.scroll tabindex="0" role="region" aria-label=(visit.t("First rows", "Các dòng đầu")) {
                table {
                    thead { tr { @for name in &head.header { th scope="col" { (one_line(name)) } } } }
                    tbody { @for row in &head.rows { tr { @for cell in row { td { (cell) } } } } }
                }
            }
        }
        @if header.is_some() { script type="module" src={ (visit.root) "assets/columns.js" } {} }
    }
}

fn column_choice(
    visit: &Visit,
    head: &ListHead,
    (field, name, value): (&str, &str, &str),
    label: &str,
) -> Markup {
    let known = head.columns.iter().position(|known| *known == Some(field));
    let known = known.and_then(|at| head.header.get(at));
    let empty = if head.by_name.contains(&Some(field)) {
        visit.t("by its name", "theo tên cột")
    } else {
        visit.t("no column", "không có cột")
    };
    let selected = known.map_or(value, |header| header.as_str());
    html! {
        label { span { (label) }
            select name=(name) {
                (choice("", empty, Some(selected)))
                @for header in head.header.iter().filter(|header| !header.is_empty()) {
                    (choice(header, &one_line(header), Some(selected)))
                }
            }
        }
    }
}
