//! A pair's way through the stages as a state machine: the rule the catalog's SQL is held to.

use serde::{Deserialize, Serialize};

use super::{Stage, UnixMillis, WorkerId};

/// Where a job stands, without its data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JobStatus {
    /// Waits to be claimed.
    Ready,
    /// A worker has it.
    Leased,
    /// Waits for a time before it is ready again.
    Backoff,
    /// All four stages are behind it.
    Done,
    /// Failed for good until somebody retries it.
    Quarantined,
    /// Set aside by hand.
    Held,
}

impl JobStatus {
    /// Every status in the order of `status --json`.
    pub const ALL: [Self; 6] = [
        Self::Ready,
        Self::Leased,
        Self::Backoff,
        Self::Done,
        Self::Quarantined,
        Self::Held,
    ];

    /// Number in the catalog.
    pub const fn code(self) -> i64 {
        match self {
            Self::Ready => 0,
            Self::Leased => 1,
            Self::Backoff => 2,
            Self::Done => 3,
            Self::Quarantined => 4,
            Self::Held => 5,
        }
    }

    /// The status of a number in the catalog.
    pub fn from_code(code: i64) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.code() == code)
    }

    /// Name in JSON and on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ready => "ready",
            Self::Leased => "leased",
            Self::Backoff => "backoff",
            Self::Done => "done",
            Self::Quarantined => "quarantined",
            Self::Held => "held",
        }
    }
}

impl std::fmt::Display for JobStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// Where a job stands, with what belongs to it there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobState {
    /// Waits to be claimed for `stage`.
    Ready {
        /// Next stage.
        stage: Stage,
    },
    /// A worker runs it from `stage` on.
    Leased {
        /// Stage in hand.
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
    /// Set aside before `stage`.
    Held {
        /// Next stage.
        stage: Stage,
    },
}

impl JobState {
    /// The status without its data.
    pub const fn status(&self) -> JobStatus {
        match self {
            Self::Ready { .. } => JobStatus::Ready,
            Self::Leased { .. } => JobStatus::Leased,
            Self::Backoff { .. } => JobStatus::Backoff,
            Self::Done => JobStatus::Done,
            Self::Quarantined { .. } => JobStatus::Quarantined,
            Self::Held { .. } => JobStatus::Held,
        }
    }

    /// The stage that comes next; `None` when all are done.
    pub const fn stage(&self) -> Option<Stage> {
        match self {
            Self::Ready { stage }
            | Self::Leased { stage, .. }
            | Self::Backoff { stage, .. }
            | Self::Quarantined { stage }
            | Self::Held { stage } => Some(*stage),
            Self::Done => None,
        }
    }
}

/// Something that happens to a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
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
        /// The stage that is done: the one in hand, or an earlier one that had to be computed again.
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
    Rescue {
        /// Whether too many workers died over it: see [`is_condemned`].
        condemned: bool,
    },
    /// The back-off time may be over.
    Due {
        /// The time now.
        now: UnixMillis,
    },
    /// Somebody asks for it again, or its settings or inputs changed: back to `stage`, never forward.
    SendBack {
        /// First stage to run.
        stage: Stage,
    },
    /// Somebody sets it aside.
    Hold,
}

/// How many workers may die over a pair before it is quarantined.
pub const CRASH_LIMIT: u32 = 3;

/// Whether a pair is to blame for its dead workers.
///
/// `crashes` counts workers that died with this pair alone in hand since its last finished stage, `deaths` all that
/// died of late. Where pairs kill their workers, nearly all deaths are one pair's, but for a first one that it shared
/// with others. Every further death that was not its own speaks for a cause outside, such as somebody who kills
/// processes, and the pair is allowed as many more.
pub const fn is_condemned(crashes: u32, deaths: u32) -> bool {
    crashes >= CRASH_LIMIT + deaths.saturating_sub(crashes + 1)
}

/// An event that cannot happen to a job where it stands; nothing changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a job that is {status} does not take {event:?}")]
pub struct Refused {
    /// Where the job stands.
    pub status: JobStatus,
    /// What was tried.
    pub event: Event,
}

/// What becomes of a job when something happens to it.
///
/// # Errors
/// When the event cannot happen there, or comes from a worker that does not hold the lease.
pub fn transition(state: JobState, event: Event) -> Result<JobState, Refused> {
    let next = match (state, event) {
        (JobState::Ready { stage }, Event::Claim { worker, deadline }) => Some(JobState::Leased {
            stage,
            worker,
            deadline,
        }),
        (JobState::Leased { stage, worker, .. }, event) => leased(stage, worker, event),
        (JobState::Backoff { stage, run_at }, Event::Due { now }) if run_at <= now => {
            Some(JobState::Ready { stage })
        }
        (state, Event::SendBack { stage }) => Some(JobState::Ready {
            stage: state.stage().map_or(stage, |at| at.min(stage)),
        }),
        (JobState::Ready { stage } | JobState::Backoff { stage, .. }, Event::Hold) => {
            Some(JobState::Held { stage })
        }
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
        Event::Rescue { condemned: true } => Some(JobState::Quarantined { stage }),
        Event::Rescue { condemned: false } => Some(JobState::Ready { stage }),
        Event::Claim { .. } | Event::Due { .. } | Event::SendBack { .. } | Event::Hold => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Event, JobState, JobStatus, is_condemned, transition};
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
        let spared = transition(state, Event::Rescue { condemned: false });
        assert_eq!(spared, Ok(JobState::Ready { stage }));
        let condemned = transition(state, Event::Rescue { condemned: true });
        assert_eq!(condemned, Ok(JobState::Quarantined { stage }));
    }

    #[test]
    fn the_third_crash_condemns_unless_others_died_too() {
        assert!(!is_condemned(2, 2));
        assert!(is_condemned(3, 3));
        // The first death was shared.
        assert!(is_condemned(3, 4));
        // Two deaths the pair had no part in.
        assert!(!is_condemned(3, 6));
        assert!(!is_condemned(4, 7));
        assert!(is_condemned(5, 8));
    }

    #[test]
    fn sending_back_never_moves_forward() {
        let state = JobState::Quarantined { stage: Stage::Fit };
        let event = Event::SendBack {
            stage: Stage::Register,
        };
        assert_eq!(
            transition(state, event),
            Ok(JobState::Ready { stage: Stage::Fit })
        );
        assert!(transition(leased(Stage::Fit), event).is_err());
    }

    #[test]
    fn status_codes_lead_back() {
        for status in JobStatus::ALL {
            assert_eq!(JobStatus::from_code(status.code()), Some(status));
        }
        assert_eq!(JobStatus::from_code(6), None);
    }
}
