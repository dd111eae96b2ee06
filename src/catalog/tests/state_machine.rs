//! The state machine of a job: the specification that the SQL of the queue is tested against.

use crate::domain::{JobStatus, Stage, UnixMillis, WorkerId};

/// Where a job stands, with what belongs to it there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JobState {
    /// Waits to be claimed for `stage`.
    Ready {
        /// Next stage.
        stage: Stage,
    },
    /// A worker runs it from `stage` on.
    Leased {
        /// Current stage.
        stage: Stage,
        /// Whose lease it is.
        worker: WorkerId,
        /// When the stage should be over.
        deadline: UnixMillis,
    },
    /// Waits until `run_at`.
    Backoff {
        /// Next stage.
        stage: Stage,
        /// When it may be claimed again.
        run_at: UnixMillis,
    },
    /// All four stages are behind it.
    Done,
    /// Failed at `stage`.
    Quarantined {
        /// Stage that failed.
        stage: Stage,
    },
}

impl JobState {
    /// The status without its data.
    pub(super) const fn status(&self) -> JobStatus {
        match self {
            Self::Ready { .. } => JobStatus::Ready,
            Self::Leased { .. } => JobStatus::Leased,
            Self::Backoff { .. } => JobStatus::Backoff,
            Self::Done => JobStatus::Done,
            Self::Quarantined { .. } => JobStatus::Quarantined,
        }
    }

    /// The stage that comes next; `None` when all are done.
    pub(super) const fn stage(&self) -> Option<Stage> {
        match self {
            Self::Ready { stage }
            | Self::Leased { stage, .. }
            | Self::Backoff { stage, .. }
            | Self::Quarantined { stage } => Some(*stage),
            Self::Done => None,
        }
    }
}

/// Something that happens to a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event {
    /// A worker takes it until a deadline.
    Claim {
        /// Who takes it.
        worker: WorkerId,
        /// When the stage should be over.
        deadline: UnixMillis,
    },
    /// A stage is done and its result stored; the next may last until the deadline.
    Checkpoint {
        /// Who did it.
        worker: WorkerId,
        /// The completed stage: the current one, or an earlier one that had to be computed again.
        stage: Stage,
        /// When the next stage should be over.
        deadline: UnixMillis,
    },
    /// The stage failed in a way that may pass.
    BackOff {
        /// Who reports it.
        worker: WorkerId,
        /// When to try again.
        run_at: UnixMillis,
    },
    /// The stage failed for good.
    Quarantine {
        /// Who reports it.
        worker: WorkerId,
    },
    /// The worker gives it back unfinished, at a drain or to be run alone.
    Release {
        /// Who gives it back.
        worker: WorkerId,
    },
    /// The worker is dead or the deadline long past.
    Recover {
        /// Whether too many workers died over it: see [`is_poisoned`].
        poisoned: bool,
    },
    /// The back-off time may be over, or too far ahead because the clock jumped.
    Due {
        /// The time now.
        now: UnixMillis,
        /// No back-off is longer.
        longest_ms: i64,
    },
    /// Somebody asks for it again, or its settings or inputs changed: back to `stage`, never forward.
    Requeue {
        /// First stage to run.
        stage: Stage,
    },
}

/// An event that cannot happen to a job where it stands; nothing changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a job that is {status} does not take {event:?}")]
pub(super) struct Refused {
    /// Where the job stands.
    pub(super) status: JobStatus,
    /// What was tried.
    pub(super) event: Event,
}

/// What becomes of a job when something happens to it.
///
/// # Errors
/// When the event cannot happen there, or comes from a worker that does not hold the lease.
pub(super) fn transition(state: JobState, event: Event) -> Result<JobState, Refused> {
    let next = match (state, event) {
        (JobState::Ready { stage }, Event::Claim { worker, deadline }) => Some(JobState::Leased {
            stage,
            worker,
            deadline,
        }),
        (JobState::Leased { stage, worker, .. }, event) => leased(stage, worker, event),
        (JobState::Backoff { stage, run_at }, Event::Due { now, longest_ms })
            if run_at <= now || run_at > now + longest_ms =>
        {
            Some(JobState::Ready { stage })
        }
        (state, Event::Requeue { stage }) => Some(JobState::Ready {
            stage: state.stage().map_or(stage, |at| at.min(stage)),
        }),
        _ => None,
    };
    next.ok_or(Refused {
        status: state.status(),
        event,
    })
}

/// What becomes of a leased job.
fn leased(stage: Stage, holder: WorkerId, event: Event) -> Option<JobState> {
    match event {
        Event::Checkpoint {
            worker,
            stage: done,
            deadline,
        } => (worker == holder && done <= stage).then(|| match done.next() {
            Some(stage) => JobState::Leased {
                stage,
                worker,
                deadline,
            },
            None => JobState::Done,
        }),
        Event::BackOff { worker, run_at } => {
            (worker == holder).then_some(JobState::Backoff { stage, run_at })
        }
        Event::Quarantine { worker } => {
            (worker == holder).then_some(JobState::Quarantined { stage })
        }
        Event::Release { worker } => (worker == holder).then_some(JobState::Ready { stage }),
        Event::Recover { poisoned: true } => Some(JobState::Quarantined { stage }),
        Event::Recover { poisoned: false } => Some(JobState::Ready { stage }),
        Event::Claim { .. } | Event::Due { .. } | Event::Requeue { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Event, JobState, transition};
    use crate::domain::{Stage, WorkerId};

    const ME: WorkerId = WorkerId(1);
    const OTHER: WorkerId = WorkerId(2);

    fn leased(stage: Stage) -> JobState {
        JobState::Leased {
            stage,
            worker: ME,
            deadline: 10,
        }
    }

    #[test]
    fn four_checkpoints_end_in_done() {
        let mut state = leased(Stage::Fit);
        for stage in Stage::ALL {
            let event = Event::Checkpoint {
                worker: ME,
                stage,
                deadline: 20,
            };
            state = transition(state, event).expect("the holder may checkpoint");
        }
        assert_eq!(state, JobState::Done);
    }

    #[test]
    fn another_worker_changes_nothing() {
        for event in [
            Event::Checkpoint {
                worker: OTHER,
                stage: Stage::Fit,
                deadline: 20,
            },
            Event::BackOff {
                worker: OTHER,
                run_at: 5,
            },
            Event::Quarantine { worker: OTHER },
            Event::Release { worker: OTHER },
        ] {
            assert!(transition(leased(Stage::Fit), event).is_err());
        }
    }

    #[test]
    fn a_condemned_pair_is_quarantined_and_another_ready() {
        let state = leased(Stage::Depth);
        let stage = Stage::Depth;
        let spared = transition(state, Event::Recover { poisoned: false });
        assert_eq!(spared, Ok(JobState::Ready { stage }));
        let poisoned = transition(state, Event::Recover { poisoned: true });
        assert_eq!(poisoned, Ok(JobState::Quarantined { stage }));
    }

    #[test]
    fn sending_back_never_moves_forward() {
        let state = JobState::Quarantined { stage: Stage::Fit };
        let event = Event::Requeue {
            stage: Stage::Register,
        };
        assert_eq!(
            transition(state, event),
            Ok(JobState::Ready { stage: Stage::Fit })
        );
        assert!(transition(leased(Stage::Fit), event).is_err());
    }
}
