//! Text about the blocks of a project in `status` and after `run`: how many are done, and why the others failed.

use std::fmt::Write as _;

use super::screen::{Palette, Tone};
use super::table::{columns, count};
use mocban_core::domain::{JobStatus, one_line};
use mocban_project::block_status::BlockStatus;

/// Number of failed blocks that are named, unless all are requested.
const NAME_LIMIT: usize = 5;

/// Returns `12 blocks · 9 done · 1 running · 1 failed · 2345 characters`. If no process works on the project,
/// leased blocks are interrupted.
pub(crate) fn blocks_line(blocks: &BlockStatus, is_running: bool, palette: Palette) -> String {
    let leased = blocks.leased();
    let characters: u64 = blocks.0.iter().map(|state| state.characters).sum();
    let mut parts = vec![count(blocks.0.len() as u64, "block")];
    let (word, tone) = if is_running {
        ("running", Tone::Strong)
    } else {
        ("interrupted", Tone::Warn)
    };
    for (number, word, tone) in [
        (blocks.number(&[JobStatus::Done]), "done", Tone::Good),
        (
            blocks.number(&[JobStatus::Quarantined]),
            "failed",
            Tone::Bad,
        ),
        (leased, word, tone),
        (blocks.waiting(), "waiting", Tone::Warn),
    ] {
        if number > 0 {
            parts.push(palette.paint(tone, format!("{number} {word}")));
        }
    }
    parts.extend(running_stages(blocks));
    if characters > 0 {
        parts.push(count(characters, "character"));
    }
    parts.join(" · ")
}

/// Returns the stages of the blocks that a process works on or left, such as `b04 at align`.
fn running_stages(blocks: &BlockStatus) -> Option<String> {
    let in_progress = blocks.in_progress();
    let stages =
        in_progress.map(|(block, stage)| format!("{} at {stage}", one_line(block.as_str())));
    let stages: Vec<String> = stages.take(NAME_LIMIT).collect();
    (!stages.is_empty()).then(|| stages.join(", "))
}

/// Returns a line for each failed block, or for the first few, with its sentence.
pub(crate) fn failed_blocks_text(blocks: &BlockStatus, all: bool) -> String {
    let limit = if all { usize::MAX } else { NAME_LIMIT };
    let failed = blocks.failed();
    let rows = failed.take(limit).filter_map(|state| {
        let failed = state.failure.as_ref()?;
        Some(vec![
            format!("  {}", state.attributes.name),
            format!("at {}", failed.stage),
            one_line(&failed.failure.message).into_owned(),
        ])
    });
    let mut text = columns(rows, "<<<");
    let more = blocks.failed().count().saturating_sub(limit);
    if more > 0 {
        // Formatting into memory does not fail.
        let _ = writeln!(text, "  and {more} more; `status --failed` lists all");
    }
    text
}

#[cfg(test)]
pub(crate) mod tests {
    use super::{blocks_line, failed_blocks_text};
    use crate::cli::output::screen::Palette;
    use mocban_catalog::{BlockAttributes, BlockState, StoredFailure};
    use mocban_core::domain::{BlockStage, Failure, FailureClass, JobStatus};
    use mocban_project::block_status::BlockStatus;

    pub(crate) fn state(name: &str, status: JobStatus) -> BlockState {
        let failure = StoredFailure {
            stage: BlockStage::Align,
            failure: Failure::new(
                FailureClass::NoSolution,
                "p.png: the page is of another block",
            ),
            at: 0,
        };
        BlockState {
            attributes: BlockAttributes {
                name: name.parse().expect("a valid id"),
                mesh_path: "m.stl".to_owned(),
                page_path: "p.png".to_owned(),
                labels_path: None,
                unit: None,
                side: None,
                meta: None,
            },
            status,
            next_stage: (status == JobStatus::Leased).then_some(BlockStage::Align),
            attempts: 0,
            crashes: 0,
            failure: (status == JobStatus::Quarantined).then_some(failure),
            control_points: None,
            characters: 100,
            left_out: 1,
            retired: 0,
            low_confidence: 2,
            other_files: name == "a",
        }
    }

    #[test]
    fn blocks_are_counted_and_refusals_named() {
        let blocks = BlockStatus(vec![
            state("a", JobStatus::Done),
            state("b", JobStatus::Quarantined),
            state("c", JobStatus::Leased),
        ]);
        let line = blocks_line(&blocks, true, Palette::PLAIN);
        assert_eq!(
            line,
            "3 blocks · 1 done · 1 failed · 1 running · c at align · 300 characters"
        );
        assert!(blocks_line(&blocks, false, Palette::PLAIN).contains("1 interrupted"));
        let text = failed_blocks_text(&blocks, false);
        assert_eq!(text, "  b  at align  p.png: the page is of another block\n");
        let json = blocks.json();
        assert_eq!(json["jobs"]["done"], 1);
        assert_eq!(json["other_files"], 1);
        assert_eq!(json["failures"][0]["stage"], "align");
    }
}
