//! What pages say of the whole blocks of a project: which are in progress, which the next run aligns again, and which failed.

use std::collections::BTreeSet;

use maud::{Markup, html};

use super::address::encoded;
use super::components::{grouped, stored_message};
use super::failure::{AppFailure, AppResult};
use super::number_text::english_count;
use super::projects::OpenProject;
use super::visit::Visit;
use crate::review::Language;
use mocban_catalog::{BlockState, Catalog};
use mocban_core::domain::{BlockName, JobStatus, one_line};
use mocban_project::ProjectResult;
use mocban_project::block_status::BlockStatus;
use mocban_runner::{RunOptions, planned_blocks};

/// Most blocks in progress that are named.
const MAX_BLOCKS: usize = 5;
/// Most failed blocks that are named.
const MAX_FAILED: usize = 3;

/// Says that an import named other files of finished blocks, which no run has read.
pub(super) fn other_blocks_text(visit: &Visit, blocks: &BlockStatus) -> Option<String> {
    let number = grouped(blocks.other_files());
    (blocks.other_files() > 0).then(|| match visit.language {
        Language::English => format!(
            "Blocks with another scan, page or labels than before: {number}. The next run looks at these files, and cuts the blocks again if their content differs."
        ),
        Language::Vietnamese => format!(
            "Số ván có bản quét, trang in hoặc nhãn khác so với trước: {number}. Lần chạy tới sẽ xem lại các tệp đó và cắt lại ván nếu nội dung tệp khác đi."
        ),
    })
}

/// Returns the button that cuts these blocks again.
pub(super) fn cut_again_text(visit: &Visit, blocks: u64) -> String {
    match visit.language {
        Language::English => format!("Cut {} again", english_count(blocks, ["block", "blocks"])),
        Language::Vietnamese => format!("Cắt lại {} ván", grouped(blocks)),
    }
}

/// Returns how many finished or failed blocks the next run would align again, because their control points, settings or
/// files have changed.
pub(super) async fn outdated_blocks(
    catalog: &Catalog,
    options: &RunOptions,
    blocks: &BlockStatus,
) -> ProjectResult<u64> {
    Ok(outdated_names(catalog, options, &blocks.0).await?.len() as u64)
}

/// Returns the names of these blocks.
async fn outdated_names(
    catalog: &Catalog,
    options: &RunOptions,
    blocks: &[BlockState],
) -> ProjectResult<BTreeSet<BlockName>> {
    let settled = blocks
        .iter()
        .filter(|state| matches!(state.status, JobStatus::Done | JobStatus::Quarantined));
    let settled: BTreeSet<&BlockName> = settled.map(|state| &state.attributes.name).collect();
    if settled.is_empty() {
        return Ok(BTreeSet::new());
    }
    let planned = planned_blocks(catalog, options).await?;
    let names = planned.into_iter().map(|entry| entry.block);
    Ok(names.filter(|name| settled.contains(name)).collect())
}

/// Returns the finished or failed blocks that were changed since their last run, as far as the catalog knows.
pub(super) async fn changed_names(
    open: &OpenProject,
    blocks: &[BlockState],
) -> AppResult<BTreeSet<BlockName>> {
    let options = mocban_project::run::options(&open.settings()?.config);
    let outdated = outdated_names(&open.catalog, &options, blocks).await;
    let mut names = outdated.map_err(|error| AppFailure::of(error, &open.dir))?;
    let moved = blocks.iter().filter(|state| state.other_files);
    names.extend(moved.map(|state| state.attributes.name.clone()));
    Ok(names)
}

/// Says on the page of a block, or above a list with such blocks, that the next run works on what was changed. `run` is the
/// relative address of the page that starts it.
pub(super) fn changed_part(visit: &Visit, run: &str, blocks: u64) -> Markup {
    let text = match (visit.language, blocks) {
        (Language::English, 1) => {
            "Boxes, chosen places, files or settings of 1 block were changed after its last run. The next run looks at them, and cuts the block again if they differ."
                .to_owned()
        }
        (Language::English, _) => format!(
            "Boxes, chosen places, files or settings of {} blocks were changed after their last run. The next run looks at them, and cuts the blocks again if they differ.",
            grouped(blocks)
        ),
        (Language::Vietnamese, _) => format!(
            "Khung chữ, điểm tự chọn, tệp hoặc thiết lập của {} ván đã đổi sau lần chạy trước. Lần chạy tới sẽ xem lại và cắt lại ván nếu chúng khác đi.",
            grouped(blocks)
        ),
    };
    html! {
        @if blocks > 0 {
            p.notice.warn #changed-blocks { (text) " " a href=(run) { (visit.t("Run", "Căn chỉnh")) } }
        }
    }
}

/// Returns the stages of the blocks in progress and how many blocks are done, such as `b04: registration with the page,
/// 1 of 3 blocks done`.
pub(super) fn blocks_text(visit: &Visit, blocks: &BlockStatus) -> String {
    let mut parts: Vec<String> = (blocks.in_progress())
        .take(MAX_BLOCKS)
        .map(|(block, stage)| {
            let (block, stage) = (one_line(block.as_str()), visit.block_stage(stage));
            format!("{block}: {stage}")
        })
        .collect();
    let done = grouped(blocks.number(&[JobStatus::Done]));
    let all = blocks.0.len() as u64;
    parts.push(match visit.language {
        Language::English => {
            let all = english_count(all, ["block", "blocks"]);
            format!("{done} of {all} done")
        }
        Language::Vietnamese => format!("xong {done} trên {} ván", grouped(all)),
    });
    let failed = failed_blocks(blocks);
    parts.extend((failed > 0).then(|| format!("{} {}", grouped(failed), visit.t("failed", "lỗi"))));
    parts.join(", ")
}

/// Says that blocks have other control points, settings or files than when they were aligned.
pub(super) fn outdated_blocks_text(visit: &Visit, outdated: u64) -> Option<String> {
    let blocks = grouped(outdated);
    match (visit.language, outdated) {
        (_, 0) => None,
        (Language::English, 1) => Some(
            "1 block has other control points, settings or files than in its last run: the next run aligns and cuts it again."
                .to_owned(),
        ),
        (Language::English, _) => Some(format!(
            "{blocks} blocks have other control points, settings or files than in their last run: the next run aligns and cuts them again."
        )),
        (Language::Vietnamese, _) => Some(format!(
            "{blocks} ván có điểm tự chọn, thiết lập hoặc tệp khác so với lần chạy trước: lần chạy tới sẽ căn chỉnh và cắt lại."
        )),
    }
}

/// Returns the number of failed blocks.
pub(super) fn failed_blocks(blocks: &BlockStatus) -> u64 {
    blocks.number(&[JobStatus::Quarantined])
}

/// Says how many blocks failed, with a link to them. `base` is the relative address of the project.
pub(super) fn failed_blocks_part(visit: &Visit, base: &str, failed: u64) -> Markup {
    let number = grouped(failed);
    let text = match (visit.language, failed) {
        (Language::English, 1) => "1 block failed, so its characters are missing.".to_owned(),
        (Language::English, _) => {
            format!("{number} blocks failed, so their characters are missing.")
        }
        (Language::Vietnamese, _) => format!("{number} ván bị lỗi nên thiếu các chữ của ván."),
    };
    html! {
        @if failed > 0 {
            p.notice.bad #failed-blocks { (text) " " a href={ (base) "blocks?state=failed" } { (visit.t("See why", "Xem lý do")) } }
        }
    }
}

/// Returns the first failed blocks with their reasons.
pub(super) fn failed_block_list(visit: &Visit, blocks: &BlockStatus) -> Markup {
    let failed = failed_blocks(blocks);
    html! {
        @if failed > 0 {
            section {
                h2 { (visit.t("Failed blocks", "Các ván lỗi")) }
                article.card {
                    ul { @for state in blocks.failed().take(MAX_FAILED) {
                        @let name = state.attributes.name.as_str();
                        li { p {
                            a href={ "block/" (encoded(name)) "/" } { (one_line(name)) }
                            @if let Some(stored) = &state.failure { ": " (stored_message(visit, &stored.failure.message)) }
                        } }
                    } }
                    a.button href="blocks?state=failed" { (visit.t("Show them", "Xem các ván này")) " (" (grouped(failed)) ")" }
                }
            }
        }
    }
}
