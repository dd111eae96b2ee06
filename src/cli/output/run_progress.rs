//! Counts a run's progress from its events.

use mocban_core::domain::Stage;
use mocban_runner::RunEvent;

use super::block_progress::BlockProgress;

/// Counts of a run so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct RunProgress {
    /// All stages to compute.
    pub(crate) stages: u64,
    /// Stages done, and stages that will not run because their pair failed.
    pub(crate) finished: u64,
    /// Stages computed.
    pub(crate) computed: u64,
    /// Stages that were computed before all blocks were cut. The rate is that of the others.
    computed_before: u64,
    /// All pairs to align.
    pub(crate) pairs: u64,
    /// Pairs done.
    pub(crate) done: u64,
    /// Pairs failed.
    pub(crate) failed: u64,
    /// Done and total per stage.
    pub(crate) by_stage: [(u64, u64); Stage::COUNT],
    /// The blocks, whose pairs are added to the counts when they are cut.
    pub(crate) blocks: BlockProgress,
}

impl RunProgress {
    /// Counts one event.
    pub(crate) fn observe(&mut self, event: &RunEvent) {
        let was_open = self.blocks.is_open();
        self.blocks.observe(event);
        if was_open && !self.blocks.is_open() {
            self.computed_before = self.computed;
        }
        match event {
            RunEvent::Started {
                pairs,
                stages,
                by_stage,
                blocks: _,
                workers: _,
            } => {
                self.pairs = *pairs;
                self.stages = *stages;
                self.by_stage = by_stage.map(|total| (0, total));
            }
            RunEvent::StageFinished { stage, .. } => {
                self.finished += 1;
                self.computed += 1;
                self.by_stage[stage.index()].0 += 1;
            }
            RunEvent::PairDone { .. } => self.done += 1,
            RunEvent::PairFailed { stage, skipped, .. } => self.fail(*stage, *skipped),
            RunEvent::BlockDone { cut, stages, .. } => {
                self.add_pairs(cut.added + cut.changed, *stages);
            }
            RunEvent::StageStarted { .. }
            | RunEvent::BlockStageStarted { .. }
            | RunEvent::BlockStageFinished { .. }
            | RunEvent::BlockWarned { .. }
            | RunEvent::BlockFailed { .. }
            | RunEvent::BlockBackingOff { .. }
            | RunEvent::PairBackingOff { .. }
            | RunEvent::Recovered { .. }
            | RunEvent::Stopping { .. } => {}
        }
    }

    /// Adds pairs that were cut from a block, each with this many stages to run.
    fn add_pairs(&mut self, pairs: u64, stages: u64) {
        self.pairs += pairs;
        self.stages += pairs * stages;
        for (_, total) in self.by_stage.iter_mut().take(stages as usize) {
            *total += pairs;
        }
    }

    fn fail(&mut self, stage: Stage, skipped: u64) {
        self.failed += 1;
        self.finished += skipped;
        for (_, total) in self.by_stage.iter_mut().skip(stage.index()) {
            *total = total.saturating_sub(1);
        }
    }

    /// Returns `fit 24/24  depth 20/24  normalize 12/24  register 10/24`, and the number of failed pairs if any failed.
    pub(crate) fn by_stage_line(&self) -> String {
        let mut parts: Vec<String> = Stage::ALL
            .iter()
            .zip(self.by_stage)
            .map(|(stage, (done, total))| format!("{stage} {done}/{total}"))
            .collect();
        if self.failed > 0 {
            parts.push(format!("{} failed", self.failed));
        }
        parts.join("  ")
    }

    /// Returns one line for a log: `42 % · 10 of 24 pairs done, 1 failed · 3.1 stages/s · about 17 s left`. While there
    /// are blocks to cut, the number of pairs is not known, so the line is about blocks and has no estimate.
    /// `elapsed_ms` is the time since all blocks are cut.
    pub(crate) fn line(&self, elapsed_ms: u64) -> String {
        if let Some(blocks) = self.blocks.line() {
            return if self.pairs == 0 {
                blocks
            } else {
                let (done, failed) = (self.done, self.failed);
                format!(
                    "{blocks} · {done} of {} pairs so far done, {failed} failed",
                    self.pairs
                )
            };
        }
        let counts = format!(
            "{} % · {} of {} pairs done, {} failed",
            self.percent(),
            self.done,
            self.pairs,
            self.failed
        );
        match self.rate(elapsed_ms) {
            Some(rate) => {
                let left_ms = self.stages.saturating_sub(self.finished) as f64 / rate * 1000.0;
                let left = mocban_system::time_text::rough_duration(left_ms as u64);
                format!("{counts} · {rate:.1} stages/s · about {left} left")
            }
            None => counts,
        }
    }

    /// Returns the finished and all stages: those of blocks while there are blocks to cut, then those of pairs.
    pub(crate) fn position(&self) -> (u64, u64) {
        self.blocks
            .position()
            .unwrap_or((self.finished, self.stages))
    }

    /// Returns the percentage of finished stages, rounded down. At 100, all stages are finished.
    pub(crate) fn percent(&self) -> u64 {
        let (finished, stages) = self.position();
        (finished * 100).checked_div(stages).unwrap_or(100)
    }

    /// Returns stages of pairs per second since all blocks are cut; `None` before the first stage.
    fn rate(&self, elapsed_ms: u64) -> Option<f64> {
        let computed = self.computed - self.computed_before;
        (computed > 0 && elapsed_ms > 0).then(|| computed as f64 * 1000.0 / elapsed_ms as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::RunProgress;
    use mocban_core::domain::{Failure, FailureClass, PairName, Stage};
    use mocban_runner::RunEvent;

    fn pair() -> PairName {
        "0001".parse().expect("valid id")
    }

    #[test]
    fn stages_of_a_failed_pair_count_as_finished() {
        let mut progress = RunProgress::default();
        progress.observe(&RunEvent::Started {
            pairs: 2,
            stages: 8,
            by_stage: [2; 4],
            blocks: 0,
            workers: 1,
        });
        for stage in Stage::ALL {
            progress.observe(&RunEvent::StageFinished {
                pair: pair(),
                stage,
                ms: 5,
            });
        }
        progress.observe(&RunEvent::PairDone { pair: pair() });
        assert_eq!(progress.percent(), 50);
        progress.observe(&RunEvent::StageFinished {
            pair: pair(),
            stage: Stage::Fit,
            ms: 5,
        });
        progress.observe(&RunEvent::PairFailed {
            pair: pair(),
            stage: Stage::Depth,
            failure: Failure::new(FailureClass::NoSolution, "flat"),
            skipped: 3,
        });
        assert_eq!(progress.percent(), 100);
        assert_eq!(
            progress.by_stage_line(),
            "fit 2/2  depth 1/1  normalize 1/1  register 1/1  1 failed"
        );
        assert_eq!(
            progress.line(1000),
            "100 % · 1 of 2 pairs done, 1 failed · 5.0 stages/s · about 0 s left"
        );
    }

    #[test]
    fn run_without_stages_is_at_100_per_cent() {
        assert_eq!(RunProgress::default().percent(), 100);
    }
}
