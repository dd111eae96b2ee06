//! Writes the events of a run to the log, so that an unattended run leaves a history.
//!
//! Each pair and block takes a few lines at most: what happens to many pairs of a sound run is a debug message, what ends
//! or delays one is information.

use super::error::RunError;
use super::events::{RunEvent, RunSummary};
use super::stop::StopLevel;

/// Logs an event. Starts of stages are left out, because their ends follow.
pub(super) fn log_event(event: &RunEvent) {
    match event {
        RunEvent::Started {
            pairs,
            stages,
            blocks,
            workers,
            ..
        } => tracing::info!(pairs, stages, blocks, workers, "the run starts"),
        RunEvent::StageStarted { .. } | RunEvent::BlockStageStarted { .. } => {}
        RunEvent::StageFinished { pair, stage, ms } => {
            tracing::debug!(%pair, %stage, ms, "a stage is stored");
        }
        RunEvent::PairDone { pair } => tracing::debug!(%pair, "the pair is done"),
        RunEvent::PairFailed {
            pair,
            stage,
            failure,
            ..
        } => {
            let (class, reason) = (failure.class, &failure.message);
            tracing::info!(%pair, %stage, %class, reason, "the pair failed");
        }
        RunEvent::PairBackingOff {
            pair,
            stage,
            failure,
            wait_ms,
        } => {
            let (class, reason) = (failure.class, &failure.message);
            tracing::info!(%pair, %stage, %class, reason, wait_ms, "the pair is tried again later");
        }
        RunEvent::Recovered { pairs } => {
            tracing::info!(pairs, "pairs of workers that ended early are ready again");
        }
        RunEvent::Stopping { level, reason } => {
            let at_once = *level == StopLevel::Now;
            tracing::info!(reason, at_once, "the run stops");
        }
        RunEvent::BlockStageFinished { .. }
        | RunEvent::BlockWarned { .. }
        | RunEvent::BlockDone { .. }
        | RunEvent::BlockFailed { .. }
        | RunEvent::BlockBackingOff { .. } => log_block_event(event),
    }
}

fn log_block_event(event: &RunEvent) {
    match event {
        RunEvent::BlockStageFinished { block, stage, ms } => {
            tracing::debug!(%block, %stage, ms, "a stage is stored");
        }
        // The progress shows it, so it is no warning here.
        RunEvent::BlockWarned {
            block,
            stage,
            warning,
        } => tracing::info!(%block, %stage, warning, "a stage warned"),
        RunEvent::BlockDone { block, cut, .. } => tracing::info!(
            %block,
            added = cut.added,
            changed = cut.changed,
            unchanged = cut.unchanged,
            retired = cut.retired,
            "the block is done"
        ),
        RunEvent::BlockFailed {
            block,
            stage,
            failure,
        } => {
            let (class, reason) = (failure.class, &failure.message);
            tracing::info!(%block, %stage, %class, reason, "the block failed");
        }
        RunEvent::BlockBackingOff {
            block,
            stage,
            failure,
            wait_ms,
        } => {
            let (class, reason) = (failure.class, &failure.message);
            tracing::info!(%block, %stage, %class, reason, wait_ms, "the block is tried again later");
        }
        _ => {}
    }
}

/// Logs how a run ended.
pub(super) fn log_end(ended: &Result<RunSummary, RunError>) {
    match ended {
        Ok(summary) => tracing::info!(
            done = summary.done,
            failed = summary.failed,
            left = summary.left,
            stages = summary.stages,
            blocks_done = summary.blocks.done,
            blocks_failed = summary.blocks.failed,
            stopped = summary.stopped,
            elapsed_ms = summary.elapsed_ms,
            "the run ends"
        ),
        // The command prints this error, so it is no warning here.
        Err(error) => tracing::info!(%error, "the run ends with an error"),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use tracing::span::{Attributes, Id, Record};
    use tracing::{Event, Level, Metadata, Subscriber, subscriber};

    use super::{RunEvent, log_event};
    use mocban_core::domain::{Failure, FailureClass, PairName, Stage};

    /// A subscriber that keeps the levels of events.
    #[derive(Default)]
    struct LevelRecorder(Arc<Mutex<Vec<Level>>>);

    impl Subscriber for LevelRecorder {
        fn enabled(&self, _: &Metadata<'_>) -> bool {
            true
        }

        fn event(&self, event: &Event<'_>) {
            let mut levels = self.0.lock().expect("no panic");
            levels.push(*event.metadata().level());
        }

        fn new_span(&self, _: &Attributes<'_>) -> Id {
            Id::from_u64(1)
        }

        fn record(&self, _: &Id, _: &Record<'_>) {}

        fn record_follows_from(&self, _: &Id, _: &Id) {}

        fn enter(&self, _: &Id) {}

        fn exit(&self, _: &Id) {}
    }

    #[test]
    fn failures_and_the_start_are_information_and_stages_are_for_debugging() {
        let pair = || PairName::new("p0").expect("a name");
        let failure = || Failure::new(FailureClass::BadInput, "no faces".to_owned());
        let stage = Stage::Fit;
        let levels = LevelRecorder::default();
        let logged = Arc::clone(&levels.0);
        let _log = subscriber::set_default(levels);
        for (event, expected) in [
            (
                RunEvent::Started {
                    pairs: 1,
                    stages: 4,
                    by_stage: [1; 4],
                    blocks: 0,
                    workers: 1,
                },
                vec![Level::INFO],
            ),
            (
                RunEvent::StageStarted {
                    pair: pair(),
                    stage,
                },
                vec![],
            ),
            (
                RunEvent::StageFinished {
                    pair: pair(),
                    stage,
                    ms: 5,
                },
                vec![Level::DEBUG],
            ),
            (
                RunEvent::PairFailed {
                    pair: pair(),
                    stage,
                    failure: failure(),
                    skipped: 4,
                },
                vec![Level::INFO],
            ),
            (
                RunEvent::PairBackingOff {
                    pair: pair(),
                    stage,
                    failure: failure(),
                    wait_ms: 100,
                },
                vec![Level::INFO],
            ),
            (RunEvent::Recovered { pairs: 1 }, vec![Level::INFO]),
        ] {
            log_event(&event);
            let found = std::mem::take(&mut *logged.lock().expect("no panic"));
            assert_eq!(found, expected, "{event:?}");
        }
    }
}
