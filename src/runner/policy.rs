//! The run's decisions as pure functions: what a failure means, who is dead, how long to wait.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::catalog::{FailureAction, LeaseHolder};
use crate::domain::{FailureClass, PairId, UnixMillis, WorkerId};

/// Tries of a stage that reading or writing failed in.
pub(super) const IO_ATTEMPTS: u32 = 3;
/// First wait after such a failure.
pub(super) const BACKOFF_BASE: Duration = Duration::from_secs(1);
/// Longest wait.
pub(super) const BACKOFF_CAP: Duration = Duration::from_mins(1);

/// What is known of a failed try.
#[derive(Debug, Clone, Copy)]
pub(super) struct FailedAttempt {
    pub(super) pair: PairId,
    pub(super) class: FailureClass,
    /// Whether another try may go better.
    pub(super) is_transient: bool,
    /// Which try it was, from 1.
    pub(super) attempt: u32,
    /// Whether it ran with nothing beside it.
    pub(super) exclusive: bool,
}

/// What a failed try means for the job.
pub(super) fn action(failed: FailedAttempt, now: UnixMillis) -> FailureAction {
    match failed.class {
        FailureClass::Io if failed.is_transient && failed.attempt < IO_ATTEMPTS => {
            FailureAction::BackOff {
                run_at: now + backoff_ms(failed.pair, failed.attempt),
            }
        }
        FailureClass::Resource if !failed.exclusive => FailureAction::RetryExclusive,
        FailureClass::Io
        | FailureClass::Resource
        | FailureClass::BadInput
        | FailureClass::NoSolution
        | FailureClass::Bug => FailureAction::Quarantine,
    }
}

/// `min(cap, base * 2^(attempt - 1))` times 0.5 to 1.5, told by pair and try so that it can be told again.
fn backoff_ms(pair: PairId, attempt: u32) -> i64 {
    let doubled = BACKOFF_BASE.saturating_mul(1 << attempt.saturating_sub(1).min(16));
    let wait = doubled.min(BACKOFF_CAP).as_millis() as i64;
    let mixed = (pair.0.unsigned_abs() ^ u64::from(attempt) << 48)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        >> 32;
    wait / 2 + wait * (mixed % 1000) as i64 / 1000
}

/// Longest wait that a back-off can ask for.
pub(super) fn longest_backoff_ms() -> i64 {
    BACKOFF_CAP.as_millis() as i64 * 3 / 2
}

/// Tells dead workers by their heartbeats: the same heartbeat for as long as a lease, by our own clock. Two machines' clocks
/// are never compared.
#[derive(Debug)]
pub(super) struct Liveness {
    lease_ms: i64,
    seen: BTreeMap<WorkerId, (UnixMillis, UnixMillis)>,
}

impl Liveness {
    /// With leases of this length.
    pub(super) const fn new(lease_ms: i64) -> Self {
        Self {
            lease_ms,
            seen: BTreeMap::new(),
        }
    }

    /// Takes in what the lease holders' heartbeats are now; gives those that are dead.
    pub(super) fn observe(
        &mut self,
        holders: &[LeaseHolder],
        me: WorkerId,
        now: UnixMillis,
    ) -> Vec<WorkerId> {
        self.seen
            .retain(|worker, _| holders.iter().any(|holder| holder.worker == *worker));
        let mut dead = Vec::new();
        for holder in holders.iter().filter(|holder| holder.worker != me) {
            let (heartbeat, since) = self
                .seen
                .entry(holder.worker)
                .or_insert((holder.heartbeat, now));
            if *heartbeat != holder.heartbeat {
                (*heartbeat, *since) = (holder.heartbeat, now);
            } else if now - *since >= self.lease_ms {
                dead.push(holder.worker);
            }
        }
        dead
    }
}

#[cfg(test)]
mod tests {
    use super::{BACKOFF_CAP, FailedAttempt, IO_ATTEMPTS, Liveness, action, backoff_ms};
    use crate::catalog::{FailureAction, LeaseHolder};
    use crate::domain::{FailureClass, PairId, WorkerId};

    fn failed(class: FailureClass, attempt: u32) -> FailedAttempt {
        FailedAttempt {
            pair: PairId(7),
            class,
            is_transient: true,
            attempt,
            exclusive: false,
        }
    }

    #[test]
    fn reading_is_tried_again_but_not_for_ever() {
        let first = action(failed(FailureClass::Io, 1), 1000);
        assert!(
            matches!(first, FailureAction::BackOff { run_at } if (1500..=2500).contains(&run_at))
        );
        let last = action(failed(FailureClass::Io, IO_ATTEMPTS), 1000);
        assert_eq!(last, FailureAction::Quarantine);
    }

    #[test]
    fn a_missing_file_is_not_waited_for() {
        let missing = FailedAttempt {
            is_transient: false,
            ..failed(FailureClass::Io, 1)
        };
        assert_eq!(action(missing, 0), FailureAction::Quarantine);
    }

    #[test]
    fn too_much_is_tried_alone_once() {
        let first = failed(FailureClass::Resource, 1);
        assert_eq!(action(first, 0), FailureAction::RetryExclusive);
        let again = FailedAttempt {
            exclusive: true,
            ..first
        };
        assert_eq!(action(again, 0), FailureAction::Quarantine);
    }

    #[test]
    fn what_cannot_change_is_quarantined_at_once() {
        for class in [
            FailureClass::BadInput,
            FailureClass::NoSolution,
            FailureClass::Bug,
        ] {
            assert_eq!(action(failed(class, 1), 0), FailureAction::Quarantine);
        }
    }

    #[test]
    fn waits_double_up_to_the_cap_and_differ_between_pairs() {
        let waits: std::collections::BTreeSet<_> =
            (0..50).map(|pair| backoff_ms(PairId(pair), 1)).collect();
        assert!(waits.len() > 10 && waits.iter().all(|wait| (500..=1500).contains(wait)));
        let cap = BACKOFF_CAP.as_millis() as i64;
        assert!((cap / 2..=cap * 3 / 2).contains(&backoff_ms(PairId(1), 30)));
    }

    #[test]
    fn a_silent_worker_is_dead_after_a_lease_and_a_beating_one_never() {
        let (me, other) = (WorkerId(1), WorkerId(2));
        let holders = |heartbeat| {
            [me, other].map(|worker| LeaseHolder {
                worker,
                heartbeat: if worker == me { 0 } else { heartbeat },
            })
        };
        let mut liveness = Liveness::new(60_000);
        assert!(liveness.observe(&holders(5), me, 0).is_empty());
        assert!(liveness.observe(&holders(6), me, 59_999).is_empty());
        assert!(liveness.observe(&holders(6), me, 119_998).is_empty());
        assert_eq!(liveness.observe(&holders(6), me, 119_999), [other]);
    }
}
