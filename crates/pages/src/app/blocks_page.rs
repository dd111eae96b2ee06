//! The list of the whole blocks of a project.

use std::collections::BTreeSet;
use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};

use super::address::encoded;
use super::components::{NavSection, empty, figure, frame, grouped, stored_message};
use super::failure::AppResult;
use super::remedies::import_address;
use super::run_blocks::{changed_names, changed_part};
use super::state::AppState;
use super::visit::Visit;
use mocban_catalog::BlockState;
use mocban_core::domain::{BlockName, BlockStage, JobStatus, one_line};

/// Most blocks that are listed.
const SHOWN: usize = 1000;

/// A list of blocks, as an example, with headings in English and in Vietnamese.
const SAMPLES: [&str; 2] = [
    "block,mesh,page,labels,unit
b04,scans/b04.ply,pages/b04.jpg,labels/b04.json,mm
b05,scans/b05.stl,pages/b05.png,,mm",
    "ván,bản quét,trang in,nhãn,đơn vị
b04,scans/b04.ply,pages/b04.jpg,labels/b04.json,mm
b05,scans/b05.stl,pages/b05.png,,mm",
];

/// What the list can show, by the name in its address.
const STATES: [(&str, &[JobStatus]); 3] = [
    ("done", &[JobStatus::Done]),
    ("failed", &[JobStatus::Quarantined]),
    (
        "waiting",
        &[JobStatus::Ready, JobStatus::Leased, JobStatus::Backoff],
    ),
];

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let blocks = open.catalog.block_states().await?;
    let body = if blocks.is_empty() {
        none(&visit, &key)
    } else {
        let chosen = visit.query.get("state");
        let chosen = STATES.iter().find(|(name, _)| Some(*name) == chosen);
        let is_shown = |block: &&BlockState| {
            chosen.is_none_or(|(_, statuses)| statuses.contains(&block.status))
        };
        let shown: Vec<&BlockState> = blocks.iter().filter(is_shown).collect();
        // Other pages say why settings cannot be read.
        let changed = changed_names(&open, &blocks).await.unwrap_or_default();
        html! {
            (figures(&visit, &blocks))
            (changed_part(&visit, "./", changed.len() as u64))
            @if chosen.is_some() { nav.pager { a href=(visit.here) { (visit.t("All blocks", "Tất cả các ván")) } } }
            (table(&visit, &shown, &changed))
        }
    };
    let title = visit.t("Blocks", "Các ván");
    Ok(frame(&visit, title, Some(&key), NavSection::Blocks, &body))
}

fn none(visit: &Visit, key: &str) -> Markup {
    let text = visit.t(
        "This project has no whole blocks. A list of blocks names a scan and a page for each; a run then finds the characters.",
        "Dự án này không có ván nguyên. Danh sách ván nêu bản quét và trang in của từng ván; lần chạy sẽ tìm các chữ.",
    );
    let import = import_address(visit, key, None);
    empty(
        text,
        &html! {
            p { (visit.t(
                "The columns of such a list are block, mesh (the scan) and page (the image); labels (boxes of the characters), unit and side may follow. Other columns are kept with the block. Paths are relative to the list.",
                "Các cột của danh sách là ván (mã ván), bản quét và trang in (hình trang in); có thể thêm nhãn (khung các chữ), đơn vị và mặt (trước hoặc sau). Các cột khác được giữ cùng với ván. Đường dẫn tính từ danh sách.",
            )) }
            pre.scroll #block-sample tabindex="0" role="region" aria-label=(visit.t("Example of a list", "Ví dụ về danh sách")) { (SAMPLES[visit.index()]) }
            p { (visit.t(
                "One block alone needs no list: choose its scan and the image of its page on the page Import.",
                "Chỉ một ván thì không cần danh sách: hãy chọn bản quét và hình trang in của nó ở trang Nhập dữ liệu.",
            )) }
            p { a.button href=(import) { (visit.t("Import a list of blocks", "Nhập danh sách ván")) } }
        },
    )
}

fn figures(visit: &Visit, blocks: &[BlockState]) -> Markup {
    let of = |statuses: &[JobStatus]| {
        let of_these = blocks.iter().filter(|one| statuses.contains(&one.status));
        of_these.count() as u64
    };
    let [done, failed, waiting] =
        STATES.map(|(name, statuses)| (of(statuses), visit.query.with("state", name).text()));
    let all = blocks.len() as u64;
    let characters: u64 = blocks.iter().map(|block| block.characters).sum();
    html! {
        div.figures {
            (figure(all, visit.form(all, ["block", "blocks"], "ván"), None, ""))
            (figure(done.0, visit.t("done", "xong"), Some(&done.1), "good"))
            (figure(failed.0, visit.t("failed", "lỗi"), Some(&failed.1), if failed.0 > 0 { "bad" } else { "" }))
            (figure(waiting.0, visit.t("waiting or running", "đang chờ hoặc đang chạy"), Some(&waiting.1), ""))
            (figure(characters, visit.form(characters, ["character", "characters"], "chữ"), None, ""))
        }
    }
}

fn table(visit: &Visit, blocks: &[&BlockState], changed: &BTreeSet<BlockName>) -> Markup {
    let label = visit.t("Blocks", "Các ván");
    html! {
        div.scroll tabindex="0" role="region" aria-label=(label) {
            table {
                thead { tr {
                    th scope="col" { (visit.t("Block", "Ván")) }
                    th scope="col" { (visit.t("State", "Trạng thái")) }
                    th.number scope="col" { (visit.t("Characters", "Số chữ")) }
                    th.number scope="col" { (visit.t("Uncertain place", "Vị trí chưa chắc")) }
                    th.number scope="col" { (visit.t("Left out", "Bỏ qua")) }
                } }
                tbody { @for block in blocks.iter().take(SHOWN) { (row(visit, block, changed.contains(&block.attributes.name))) } }
            }
        }
        @if blocks.len() > SHOWN {
            p.muted { (visit.t("Only the first are listed:", "Chỉ liệt kê các ván đầu tiên:")) " " (grouped(SHOWN as u64)) }
        }
    }
}

fn row(visit: &Visit, block: &BlockState, is_changed: bool) -> Markup {
    let name = block.attributes.name.as_str();
    html! {
        tr {
            th scope="row" { a href={ "block/" (encoded(name)) "/" } { (one_line(name)) } }
            td.reason[block.failure.is_some()] {
                (state_badge(visit, block))
                @if is_changed { " · " span.warn { (visit.t("changed after its last run", "đã đổi sau lần chạy trước")) } }
                @if let Some(stored) = &block.failure { " " span.bad { (stored_message(visit, &stored.failure.message)) } }
            }
            td.number { @if block.characters > 0 {
                a href={ "pairs?block=" (encoded(name)) } { (grouped(block.characters)) }
            } @else { (counted(block, 0)) } }
            td.number { (counted(block, block.low_confidence)) }
            td.number { (counted(block, block.left_out)) }
        }
    }
}

/// Returns a number of characters of a block. Before they are cut, it is not known.
fn counted(block: &BlockState, number: u64) -> String {
    let is_known = number > 0 || block.characters > 0 || block.next_stage.is_none();
    if is_known {
        grouped(number)
    } else {
        "–".to_owned()
    }
}

/// Returns the state of a block, with its stage if it is not done.
pub(super) fn state_badge(visit: &Visit, block: &BlockState) -> Markup {
    let name = match block.status {
        JobStatus::Done => visit.t("done", "xong"),
        status => visit.status(status),
    };
    html! {
        span.state.(block.status.name()) { (name) }
        @if let Some(stage) = block.next_stage.filter(|_| block.status != JobStatus::Quarantined) {
            " · " (visit.block_stage(stage)) " (" (stage as usize + 1) "/" (BlockStage::ALL.len()) ")"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{SAMPLES, none};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_lists::manifest::parse_blocks;

    #[test]
    fn the_examples_of_a_list_are_read_and_equal() {
        let [english, vietnamese] =
            SAMPLES.map(|sample| parse_blocks(sample.as_bytes()).expect("a list"));
        assert_eq!(english, vietnamese);
        assert_eq!(english.len(), 2);
    }

    #[test]
    fn a_page_names_the_columns_in_its_language() {
        let shown = none(&Visit::in_language(Language::Vietnamese), "p").into_string();
        for english in ["block,", "mesh", "labels,", "unit"] {
            assert!(!shown.contains(english), "{shown}");
        }
        assert!(shown.contains("ván,bản quét,trang in"), "{shown}");
    }
}
