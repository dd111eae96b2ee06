//! How far a run has come, told from its events.

use crate::domain::Stage;
use crate::runner::RunEvent;

/// Counts of a run so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RunProgress {
    /// Stages to do in all.
    pub(super) stages: u64,
    /// Stages done, or that will not run because their pair failed.
    pub(super) passed: u64,
    /// Stages computed.
    pub(super) computed: u64,
    /// Pairs to do.
    pub(super) pairs: u64,
    /// Pairs done.
    pub(super) done: u64,
    /// Pairs failed.
    pub(super) failed: u64,
    /// Done and to do by stage.
    pub(super) by_stage: [(u64, u64); 4],
}

impl RunProgress {
    /// Takes in one event.
    pub(super) fn observe(&mut self, event: &RunEvent) {
        match event {
            RunEvent::Started {
                pairs,
                stages,
                by_stage,
                workers: _,
            } => {
                self.pairs = *pairs;
                self.stages = *stages;
                self.by_stage = by_stage.map(|todo| (0, todo));
            }
            RunEvent::StageFinished { stage, .. } => {
                self.passed += 1;
                self.computed += 1;
                self.by_stage[stage.index()].0 += 1;
            }
            RunEvent::PairDone { .. } => self.done += 1,
            RunEvent::PairFailed { stage, skipped, .. } => self.fail(*stage, *skipped),
            RunEvent::StageStarted { .. }
            | RunEvent::PairBackingOff { .. }
            | RunEvent::Recovered { .. }
            | RunEvent::Stopping { .. } => {}
        }
    }

    fn fail(&mut self, stage: Stage, skipped: u64) {
        self.failed += 1;
        self.passed += skipped;
        for (_, todo) in self.by_stage.iter_mut().skip(stage.index()) {
            *todo = todo.saturating_sub(1);
        }
    }

    /// `fit 24/24  depth 20/24  normalize 12/24  register 10/24`, with the failed pairs where there are some.
    pub(super) fn by_stage_line(&self) -> String {
        let mut parts: Vec<String> = Stage::ALL
            .iter()
            .zip(self.by_stage)
            .map(|(stage, (done, todo))| format!("{stage} {done}/{todo}"))
            .collect();
        if self.failed > 0 {
            parts.push(format!("{} failed", self.failed));
        }
        parts.join("  ")
    }

    /// One line for a log: `42 % · 10 of 24 pairs done, 1 failed · 3.1 stages/s · about 17 s left`.
    pub(super) fn line(&self, elapsed_ms: u64) -> String {
        let counts = format!(
            "{} % · {} of {} pairs done, {} failed",
            self.percent(),
            self.done,
            self.pairs,
            self.failed
        );
        match self.rate(elapsed_ms) {
            Some(rate) => {
                let left_ms = self.stages.saturating_sub(self.passed) as f64 / rate * 1000.0;
                let left = super::time_text::rough(left_ms as u64);
                format!("{counts} · {rate:.1} stages/s · about {left} left")
            }
            None => counts,
        }
    }

    /// Whole per cent of the stages, rounded down, so that 100 is the end.
    pub(super) const fn percent(&self) -> u64 {
        match (self.passed * 100).checked_div(self.stages) {
            Some(percent) => percent,
            None => 100,
        }
    }

    /// Stages a second; `None` before there is one.
    fn rate(&self, elapsed_ms: u64) -> Option<f64> {
        (self.computed > 0 && elapsed_ms > 0)
            .then(|| self.computed as f64 * 1000.0 / elapsed_ms as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::RunProgress;
    use crate::domain::{Failure, FailureClass, PairName, Stage};
    use crate::runner::RunEvent;

    fn pair() -> PairName {
        "0001".parse().expect("valid id")
    }

    #[test]
    fn failed_pair_takes_its_stages_off_the_list() {
        let mut counts = RunProgress::default();
        counts.observe(&RunEvent::Started {
            pairs: 2,
            stages: 8,
            by_stage: [2; 4],
            workers: 1,
        });
        for stage in Stage::ALL {
            counts.observe(&RunEvent::StageFinished {
                pair: pair(),
                stage,
                ms: 5,
            });
        }
        counts.observe(&RunEvent::PairDone { pair: pair() });
        assert_eq!(counts.percent(), 50);
        counts.observe(&RunEvent::StageFinished {
            pair: pair(),
            stage: Stage::Fit,
            ms: 5,
        });
        counts.observe(&RunEvent::PairFailed {
            pair: pair(),
            stage: Stage::Depth,
            failure: Failure::new(FailureClass::NoSolution, "flat"),
            skipped: 3,
        });
        assert_eq!(counts.percent(), 100);
        assert_eq!(
            counts.by_stage_line(),
            "fit 2/2  depth 1/1  normalize 1/1  register 1/1  1 failed"
        );
        assert_eq!(
            counts.line(1000),
            "100 % · 1 of 2 pairs done, 1 failed · 5.0 stages/s · about 0 s left"
        );
    }

    #[test]
    fn nothing_to_do_is_all_done() {
        assert_eq!(RunProgress::default().percent(), 100);
    }
}
