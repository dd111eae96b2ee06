//! Counts a run's progress through whole blocks from its events.

use mocban_core::domain::{BlockName, BlockStage};
use mocban_runner::RunEvent;

/// The blocks of a run so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct BlockProgress {
    /// Blocks with stages to run when the run started.
    total: u64,
    /// Blocks that are done or failed.
    ended: u64,
    /// The block in progress, and its stage.
    current: Option<(BlockName, BlockStage)>,
}

/// Number of stages of a block.
const STAGES: u64 = BlockStage::ALL.len() as u64;

impl BlockProgress {
    /// Counts one event.
    pub(crate) fn observe(&mut self, event: &RunEvent) {
        match event {
            RunEvent::Started { blocks, .. } => self.total = *blocks,
            RunEvent::BlockStageStarted { block, stage } => {
                self.current = Some((block.clone(), *stage));
            }
            RunEvent::BlockDone { .. } | RunEvent::BlockFailed { .. } => {
                self.ended += 1;
                self.current = None;
            }
            RunEvent::BlockBackingOff { .. } => self.current = None,
            _ => {}
        }
    }

    /// Returns whether blocks are left, so that the number of pairs is not yet known.
    pub(crate) const fn is_open(&self) -> bool {
        self.ended < self.total || self.current.is_some()
    }

    /// Returns the finished stages and all stages of blocks, or `None` if no block is left.
    pub(crate) fn position(&self) -> Option<(u64, u64)> {
        let total = self
            .total
            .max(self.ended + u64::from(self.current.is_some()));
        let begun = self.current.as_ref();
        let begun = begun.map_or(0, |(_, stage)| stage.index() as u64);
        self.is_open()
            .then_some((self.ended * STAGES + begun, total * STAGES))
    }

    /// Returns `block 2 of 3: b04 at align, stage 2 of 4`, or `None` if no block is left.
    pub(crate) fn line(&self) -> Option<String> {
        let (_, stages) = self.position()?;
        let (ended, total) = (self.ended, stages / STAGES);
        Some(match &self.current {
            Some((block, stage)) => {
                let (number, step) = (ended + 1, stage.index() + 1);
                format!("block {number} of {total}: {block} at {stage}, stage {step} of {STAGES}")
            }
            None => format!("{ended} of {total} blocks finished"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::BlockProgress;
    use crate::cli::output::run_progress::RunProgress;
    use mocban_catalog::CutSummary;
    use mocban_core::domain::{BlockName, BlockStage, Failure, FailureClass};
    use mocban_runner::RunEvent;

    fn block(name: &str) -> BlockName {
        name.parse().expect("valid id")
    }

    fn stage_of(name: &str, stage: BlockStage) -> RunEvent {
        let block = block(name);
        RunEvent::BlockStageStarted { block, stage }
    }

    #[test]
    fn blocks_show_their_stages_and_pairs_are_estimated_only_when_all_are_cut() {
        let mut progress = RunProgress::default();
        progress.observe(&RunEvent::Started {
            pairs: 0,
            stages: 0,
            by_stage: [0; 4],
            blocks: 2,
            workers: 1,
        });
        assert_eq!(progress.line(0), "0 of 2 blocks finished");
        assert_eq!(progress.percent(), 0);
        progress.observe(&stage_of("b1", BlockStage::Align));
        let first = "block 1 of 2: b1 at align, stage 2 of 4";
        assert_eq!(progress.line(1000), first);
        assert_eq!(progress.percent(), 12);
        progress.observe(&RunEvent::BlockDone {
            block: block("b1"),
            cut: CutSummary {
                added: 3,
                ..CutSummary::default()
            },
            stages: 4,
        });
        progress.observe(&stage_of("b2", BlockStage::Face));
        let second = "block 2 of 2: b2 at face, stage 1 of 4 · 0 of 3 pairs so far done, 0 failed";
        assert_eq!(progress.line(2000), second);
        progress.observe(&RunEvent::BlockFailed {
            block: block("b2"),
            stage: BlockStage::Face,
            failure: Failure::new(FailureClass::NoSolution, "flat"),
        });
        assert_eq!(progress.blocks.line(), None);
        assert_eq!(progress.line(0), "0 % · 0 of 3 pairs done, 0 failed");
    }

    #[test]
    fn a_block_that_is_added_during_the_run_counts_too() {
        let mut blocks = BlockProgress::default();
        assert!(!blocks.is_open());
        blocks.observe(&stage_of("b9", BlockStage::Cut));
        assert_eq!(blocks.position(), Some((3, 4)));
    }
}
