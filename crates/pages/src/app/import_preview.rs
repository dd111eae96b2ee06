//! The pairs that would be imported, and what a person can change in them.

use std::collections::BTreeSet;
use std::path::Path;

use maud::{Markup, html};

use super::components::{action_form, choice, grouped, unit_name};
use super::import_choice::{BLOCK_CHARS, ImportChoice, Planned, SHOWN_PAIRS};
use super::import_files::files_part;
use super::project_name::NAME_CHARS;
use super::sentence::{Sentence, without_commands};
use super::visit::Visit;
use crate::messages;
use crate::review::Language;
use mocban_core::domain::{LengthUnit, one_line};
use mocban_lists::columns::plain_name;
use mocban_lists::manifest::{BlockRow, PairingChanges};
use mocban_project::import_plan::{ImportPlan, PlannedPair};
use mocban_project::manifest_file::IGNORED;
use mocban_project::renamed_columns::{RENAMED, renamed_columns};

/// Number of warnings and missing files that are shown.
const SHOWN_LINES: usize = 12;
/// Number of columns of a list of blocks that are named.
const SHOWN_COLUMNS: usize = 40;
/// Number of files without a partner from which one is chosen.
const SHOWN_FILES: usize = 500;

/// The columns of a list, and what the page calls them in Vietnamese.
const COLUMN_NAMES: [[&str; 2]; 10] = [
    ["id", "Mã"],
    ["mesh", "Bản quét"],
    ["print", "Bản in"],
    ["character", "Chữ"],
    ["block", "Ván"],
    ["unit", "Đơn vị"],
    ["scanned_face_down", "Quét úp"],
    ["page", "Trang in"],
    ["labels", "Nhãn"],
    ["side", "Mặt"],
];

/// Returns what would be imported, with the form that imports it. `from` is the position of the first pair that is shown,
/// and `changed` says what changes in known pairs.
pub(super) fn plan_part(
    visit: &Visit,
    chosen: &ImportChoice,
    planned: &Planned,
    from: u64,
    changed: &Markup,
) -> Markup {
    let total = match planned {
        Planned::Pairs(plan, _) => plan.pairs,
        Planned::Blocks(read, _) => read.rows.len() as u64,
    };
    html! {
        section.card {
            h2 { (visit.t("What would be imported", "Sẽ nhập những gì")) }
            @match planned {
                Planned::Blocks(read, _) => {
                    p { b { (grouped(read.rows.len() as u64)) } " " (visit.form(read.rows.len() as u64, ["whole block", "whole blocks"], "ván nguyên")) }
                    p { (visit.t("Scans of whole blocks with their pages. A run finds the characters and makes the pairs.", "Bản quét ván nguyên kèm trang in. Lần chạy sẽ tìm các chữ và tạo cặp.")) }
                    @for line in &read.warnings { p.notice { (one_line(&warning(visit, line))) } }
                    @if let Some(renamed) = renamed_columns(&read.renamed).and_then(|line| renamed_text(visit, &line)) { p.muted { (one_line(&renamed)) } }
                    (block_table(visit, &read.rows))
                    (other_columns(visit, &read.rows))
                },
                Planned::Pairs(plan, at) => (pairs_part(visit, chosen, plan, *at, from)),
            }
            @if total > 0 { (files_part(visit, matches!(planned, Planned::Blocks(..)), total)) }
            (changed)
            (import_form(visit, chosen, planned))
        }
    }
}

fn pairs_part(
    visit: &Visit,
    chosen: &ImportChoice,
    plan: &ImportPlan,
    at: usize,
    from: u64,
) -> Markup {
    let shown = plan.shown.iter().skip(at).take(SHOWN_PAIRS as usize);
    let changes = chosen.changes().unwrap_or_default();
    let no_pair = plan.no_pair.as_deref().map(Sentence::of_program);
    html! {
        p { b { (grouped(plan.pairs)) } " " (visit.form(plan.pairs, ["pair", "pairs"], "cặp"))
            @if plan.missing.count > 0 { " · " span.bad { (grouped(plan.missing.count as u64)) " " (visit.form(plan.missing.count as u64, ["missing file", "missing files"], "tệp không có")) } }
        }
        @if let Some(why) = no_pair { p.notice.bad { (why.text(visit.language)) } }
        @for line in plan.missing.lines.iter().take(SHOWN_LINES) { p.notice.bad { (one_line(Sentence::of_program(line).text(visit.language))) } }
        @for line in plan.warnings.iter().take(SHOWN_LINES) { p.notice { (one_line(&warning(visit, line))) } }
        @if let Some(renamed) = plan.renamed.as_deref().and_then(|line| renamed_text(visit, line)) { p.muted { (one_line(&renamed)) } }
        @if shown.len() > 0 {
            div.scroll tabindex="0" role="region" aria-label=(visit.t("Pairs", "Các cặp")) {
                table {
                    thead { tr {
                        @for title in [visit.t("Id", "Mã"), visit.t("Scan", "Bản quét"), visit.t("Print", "Bản in"), visit.t("Character", "Chữ"), visit.t("Block", "Ván"), visit.t("Change", "Thay đổi")] {
                            th scope="col" { (title) }
                        }
                    } }
                    tbody { @for pair in shown { (pair_row(visit, chosen, &changes, pair)) } }
                }
            }
            (pager(visit, plan.pairs, from))
        }
        (changes_part(visit, &changes))
        (join_form(visit, plan))
        (whole_block_form(visit, plan))
    }
}

/// Returns the form that takes a scan and an image that are alone for a whole block and its page.
fn whole_block_form(visit: &Visit, plan: &ImportPlan) -> Markup {
    let [meshes, prints] = &plan.alone;
    html! {
        @if plan.pairs == 0 && meshes.len() == 1 && prints.len() == 1 {
            form #whole-block.fields method="get" action=(visit.here) {
                @for (name, value) in visit.query.pairs() { input type="hidden" name=(name) value=(value); }
                input type="hidden" name="whole_block" value="yes";
                button { (visit.t("Take them as one whole block with its page", "Coi là một ván nguyên với trang in của nó")) }
            }
        }
    }
}

/// Returns the first blocks that would be imported.
fn block_table(visit: &Visit, rows: &[BlockRow]) -> Markup {
    let label = visit.t("Blocks", "Các ván");
    html! {
        div.scroll tabindex="0" role="region" aria-label=(label) {
            table {
                thead { tr {
                    @for title in [visit.t("Block", "Ván"), visit.t("Scan", "Bản quét"), visit.t("Page", "Trang in"), visit.t("Labels", "Nhãn")] {
                        th scope="col" { (title) }
                    }
                } }
                tbody { @for row in rows.iter().take(SHOWN_PAIRS as usize) {
                    tr {
                        th scope="row" { (one_line(row.name.as_str())) }
                        td { (file_name(&row.mesh)) }
                        td { (file_name(&row.page)) }
                        td { (row.labels.as_deref().map_or_else(|| "–".to_owned(), file_name)) }
                    }
                } }
            }
        }
        @if rows.len() > SHOWN_PAIRS as usize {
            p.muted { (visit.t("Only the first are listed:", "Chỉ liệt kê các ván đầu tiên:")) " " (grouped(SHOWN_PAIRS)) }
        }
    }
}

/// Names the columns of a list of blocks that are only kept, as a misspelt one is.
fn other_columns(visit: &Visit, rows: &[BlockRow]) -> Markup {
    let names: BTreeSet<&String> = rows.iter().flat_map(|row| row.meta.keys()).collect();
    let shown = names.iter().take(SHOWN_COLUMNS);
    let shown: Vec<_> = shown.map(|name| one_line(name)).collect();
    html! {
        @if !names.is_empty() {
            p.muted #other-columns {
                (visit.t("Other columns, which are kept and shown but not used", "Các cột khác, được giữ lại và hiển thị nhưng không dùng đến")) ": "
                (shown.join(", "))
                @if names.len() > shown.len() { ", …" }
            }
        }
    }
}

/// Returns a warning of an import, which is translated if its beginning is known, or else quoted.
pub(super) fn warning(visit: &Visit, line: &str) -> String {
    let line = &without_commands(line);
    let [mesh_alone, print_alone, other] = IGNORED;
    let beginnings = [
        (
            mesh_alone,
            [
                "ignored, scan without print",
                "Bỏ qua, bản quét không có bản in",
            ],
        ),
        (
            print_alone,
            [
                "ignored, print without scan",
                "Bỏ qua, bản in không có bản quét",
            ],
        ),
        // A scan may lie in the folder of the prints.
        (
            other,
            [
                "ignored, no scan in the folder of scans, or no image in the folder of prints",
                "Bỏ qua, không phải bản quét trong thư mục bản quét, hoặc không phải hình trong thư mục bản in",
            ],
        ),
    ];
    let found = beginnings
        .into_iter()
        .find_map(|(known, [english, vietnamese])| {
            let rest = line.strip_prefix(known)?;
            Some(match visit.language {
                Language::English => format!("{english}{rest}"),
                Language::Vietnamese => {
                    let more = messages::with_more(rest, "tệp khác");
                    format!("{vietnamese}{}", more.unwrap_or_else(|| rest.to_owned()))
                }
            })
        });
    found.unwrap_or_else(|| match visit.language {
        Language::English => line.to_owned(),
        Language::Vietnamese => {
            let known = messages::vietnamese(line);
            known.unwrap_or_else(|| format!("Chương trình báo: {line}"))
        }
    })
}

/// Says which columns were read under other names than the page has for them. `None` if there are none.
fn renamed_text(visit: &Visit, line: &str) -> Option<String> {
    let columns = line.strip_prefix(RENAMED)?.strip_prefix(": ")?;
    if visit.language == Language::English {
        return Some(line.to_owned());
    }
    // A comma within a heading is followed by no quotation mark, unless the heading has one.
    let columns = columns.split(", \"").filter_map(|column| {
        let (written, name) = column.rsplit_once("\" as ")?;
        let written = written.trim_start_matches('"');
        let mut names = COLUMN_NAMES.iter();
        let known = names.find(|[english, _]| *english == name);
        let name = known.map_or(name, |[_, vietnamese]| *vietnamese);
        let is_same = plain_name(written) == plain_name(name);
        (!is_same).then(|| format!("\"{written}\" là {name}"))
    });
    let columns: Vec<String> = columns.collect();
    (!columns.is_empty()).then(|| format!("Đã hiểu các cột có tên khác: {}", columns.join(", ")))
}

fn pair_row(
    visit: &Visit,
    chosen: &ImportChoice,
    changes: &PairingChanges,
    pair: &PlannedPair,
) -> Markup {
    let folder = Path::new(&chosen.meshes);
    let is_joined = chosen.list.is_empty()
        && pair.mesh.strip_prefix(folder).is_ok_and(|mesh| {
            let mut joined = changes.joined.iter();
            joined.any(|(known, _)| Path::new(known) == mesh)
        });
    let name = pair.name.as_str();
    let leave = visit.query.with("leave", name).text();
    html! {
        tr {
            th scope="row" { (one_line(name)) }
            td { (file_name(&pair.mesh)) } td { (file_name(&pair.print)) }
            td { (pair.character.as_deref().map(one_line).unwrap_or_default()) }
            td { (pair.block.as_deref().map(one_line).unwrap_or_default()) }
            td {
                @if is_joined { (visit.t("joined by you", "do bạn ghép")) }
                @else {
                    a href={ (visit.here) (leave) } aria-label={ (visit.t("leave out", "bỏ qua")) " " (one_line(name)) } { (visit.t("leave out", "bỏ qua")) }
                }
            }
        }
    }
}

/// Returns the last two parts of a path.
fn file_name(path: &Path) -> String {
    let parts: Vec<_> = path.components().rev().take(2).collect();
    let parts = parts
        .iter()
        .rev()
        .map(|part| part.as_os_str().to_string_lossy());
    one_line(&parts.collect::<Vec<_>>().join("/")).to_string()
}

/// Returns links to the pairs before and after.
fn pager(visit: &Visit, pairs: u64, from: u64) -> Markup {
    let last = pairs.min(from + SHOWN_PAIRS);
    let link = |from: u64, text: &str| {
        let from = (from > 0).then(|| from.to_string());
        let query = visit.query.with("from", &from.unwrap_or_default());
        html! { a.button href={ (visit.here) (query.text()) } { (text) } " " }
    };
    html! {
        @if pairs > SHOWN_PAIRS {
            p.pager {
                @if from > 0 { (link(from.saturating_sub(SHOWN_PAIRS), visit.t("Previous pairs", "Các cặp trước"))) }
                span.muted { (grouped(from + 1)) "–" (grouped(last)) " / " (grouped(pairs)) }
                @if last < pairs { (link(last, visit.t("Next pairs", "Các cặp sau"))) }
            }
        }
    }
}

/// Returns the changes that were made, each with a link that takes it back.
pub(super) fn changes_part(visit: &Visit, changes: &PairingChanges) -> Markup {
    let undo = |name: &str, value: &str| {
        let query = visit.query.with(name, value);
        html! { a href={ (visit.here) (query.text()) } aria-label={ (visit.t("take back", "hoàn lại")) " " (one_line(value)) } { (visit.t("take back", "hoàn lại")) } }
    };
    html! {
        @if *changes != PairingChanges::default() {
            h3 { (visit.t("Your changes", "Các thay đổi của bạn")) }
            ul #changes {
                @for (index, (scan, print)) in changes.joined.iter().enumerate() {
                    li { (visit.t("joined", "ghép")) ": " (one_line(scan)) " + " (one_line(print)) " " (undo("split", &index.to_string())) }
                }
                @for id in &changes.left_out {
                    li { (visit.t("left out", "bỏ qua")) ": " (one_line(id)) " " (undo("take", id)) }
                }
            }
        }
    }
}

/// Returns the form that joins a scan and a print without a partner.
fn join_form(visit: &Visit, plan: &ImportPlan) -> Markup {
    let [meshes, prints] = &plan.alone;
    let files = |name: &str, label: &str, files: &[String]| {
        html! {
            label { span { (label) }
                select name=(name) required {
                    option value="" { (visit.t("choose", "chọn")) }
                    @for file in files.iter().take(SHOWN_FILES) { (choice(file, &one_line(file), None)) }
                }
            }
        }
    };
    let is_long = meshes.len().max(prints.len()) > SHOWN_FILES;
    html! {
        @if !meshes.is_empty() && !prints.is_empty() {
            h3 { (visit.t("Files without a partner", "Các tệp không có đôi")) }
            form #join.fields method="get" action=(visit.here) {
                @for (name, value) in visit.query.pairs() { input type="hidden" name=(name) value=(value); }
                (files("scan", visit.t("Scan", "Bản quét"), meshes))
                (files("print", visit.t("Print", "Bản in"), prints))
                button { (visit.t("Join to a pair", "Ghép thành cặp")) }
            }
            @if is_long { p.muted { (visit.t("Only the first files are listed.", "Chỉ liệt kê các tệp đầu.")) } }
        }
    }
}

fn import_form(visit: &Visit, chosen: &ImportChoice, planned: &Planned) -> Markup {
    let plan = match planned {
        Planned::Pairs(plan, _) => Some(plan),
        Planned::Blocks(..) => None,
    };
    let missing = plan.is_some_and(|plan| plan.missing.count > 0);
    let is_nothing = plan.is_some_and(|plan| plan.pairs == 0);
    action_form(
        &format!("{}actions/import", visit.root),
        "fields",
        &html! {
            @for (name, value) in chosen.hidden_fields() { input type="hidden" name=(name) value=(value); }
            @if let Some(plan) = plan { input type="hidden" name="shown" value=(plan.hash); }
            input type="hidden" name="compared" value=(chosen.project);
            label { span { (visit.t("Project (new or known name)", "Dự án (tên mới hoặc đã có)")) }
                input #project name="project" value=(chosen.project) required maxlength=(NAME_CHARS) data-in-address;
            }
            @if chosen.list.is_empty() {
                label { span { (visit.t("Unit of the scans", "Đơn vị của bản quét")) }
                    select name="unit" data-in-address {
                        (choice("", visit.t("not known", "không rõ"), Some(&chosen.unit)))
                        @for unit in LengthUnit::ALL { (choice(unit.name(), unit_name(visit, unit), Some(&chosen.unit))) }
                    }
                }
            }
            @if let Some(label) = block_label(visit, chosen, planned) {
                label { span { (label) }
                    input #block name="block" value=(chosen.block) maxlength=(BLOCK_CHARS) data-in-address;
                }
            }
            @if missing {
                label.check { input type="checkbox" name="missing" value="yes" checked[!chosen.missing.is_empty()] data-in-address; " " (visit.t("Also import pairs whose files are missing", "Nhập cả các cặp thiếu tệp")) }
            }
            label.check { input type="checkbox" name="changed" value="yes" checked[!chosen.changed.is_empty()] data-in-address; " "
                @if plan.is_some() { (visit.t("Known pairs may get other files", "Cho phép đổi tệp của các cặp đã có")) }
                @else { (visit.t("Known blocks may get other files", "Cho phép đổi tệp của các ván đã có")) }
            }
            button.primary #import disabled[is_nothing] { (visit.t("Import", "Nhập")) }
        },
    )
}

/// Returns what the field for the name of a block is called: of all pairs, if neither list nor folders name a block, or of
/// the only whole block. `None` if they do.
fn block_label(visit: &Visit, chosen: &ImportChoice, planned: &Planned) -> Option<&'static str> {
    let is_named = !chosen.block.is_empty();
    match planned {
        Planned::Pairs(plan, _) => (!plan.has_blocks || is_named).then(|| {
            visit.t(
                "Block of these pairs (may be left empty)",
                "Ván của các cặp này (có thể để trống)",
            )
        }),
        Planned::Blocks(..) => (!chosen.whole_block.is_empty()).then(|| {
            visit.t(
                "Name of the block (empty: that of its file)",
                "Tên của ván (để trống: theo tên tệp)",
            )
        }),
    }
}

#[cfg(test)]
mod tests;
