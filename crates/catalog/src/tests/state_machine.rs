//! The state machine of a job. The SQL of the queue is tested against this specification.

use mocban_core::domain::{JobStatus, Stage, UnixMillis, WorkerId};

/// The state of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JobState {
    /// Waits to be claimed for `stage`.
    Ready {
        /// Next stage.
        stage: Stage,
    },
    /// Leased: a worker runs it from `stage` on.
    Leased {
        /// Current stage.
        stage: Stage,
        /// Holder of the lease.
        worker: WorkerId,
        /// Deadline of the stage.
        deadline: UnixMillis,
    },
    /// Waits until `run_at`.
    Backoff {
        /// Next stage.
        stage: Stage,
        /// When it may be claimed again.
        run_at: UnixMillis,
    },
    /// All stages are complete.
    Done,
    /// Failed at `stage`.
    Quarantined {
        /// Stage that failed.
        stage: Stage,
    },
}

impl JobState {
    /// Returns the status without its data.
    pub(super) const fn status(&self) -> JobStatus {
        match self {
            Self::Ready { .. } => JobStatus::Ready,
            Self::Leased { .. } => JobStatus::Leased,
            Self::Backoff { .. } => JobStatus::Backoff,
            Self::Done => JobStatus::Done,
            Self::Quarantined { .. } => JobStatus::Quarantined,
        }
    }

    /// Returns the next stage, or `None` if all stages are done.
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
    /// A worker leases it until a deadline.
    Claim {
        /// The worker.
        worker: WorkerId,
        /// Deadline of the stage.
        deadline: UnixMillis,
    },
    /// A stage is complete and its result is stored. `deadline` is for the next stage.
    Checkpoint {
        /// The worker.
        worker: WorkerId,
        /// The completed stage. It precedes the current stage if it had to be computed again.
        stage: Stage,
        /// Deadline of the next stage.
        deadline: UnixMillis,
    },
    /// The stage failed transiently.
    BackOff {
        /// The worker.
        worker: WorkerId,
        /// Time of the next attempt.
        run_at: UnixMillis,
    },
    /// The stage failed permanently.
    Quarantine {
        /// The worker.
        worker: WorkerId,
    },
    /// The worker releases the job unfinished: the worker is stopping, or the job must run exclusively.
    Release {
        /// The worker.
        worker: WorkerId,
    },
    /// The worker is dead, or its lease is overdue.
    Recover {
        /// Whether the job is quarantined because it probably kills its workers: see `model::is_poisoned`.
        poisoned: bool,
    },
    /// Ends a back-off that is due, or whose end is so far away that the clock must have jumped.
    Due {
        /// The current time.
        now: UnixMillis,
        /// Longest back-off.
        longest_ms: i64,
    },
    /// A new run was requested, or settings or inputs changed. The job goes back to `stage`, never forward.
    Requeue {
        /// First stage to run.
        stage: Stage,
    },
}

/// An event that is invalid in the job's state; nothing changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a job that is {status} does not take {event:?}")]
pub(super) struct Refused {
    /// State of the job.
    pub(super) status: JobStatus,
    /// The event.
    pub(super) event: Event,
}

/// Applies an event to a job.
///
/// # Errors
/// Returns an error if the event is invalid in that state, or if its worker does not hold the lease.
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

/// Applies an event to a leased job.
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
    use mocban_core::domain::{Stage, WorkerId};

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
