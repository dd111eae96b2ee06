//! Decisions of a run without side effects: what follows a failure, and the intervals of heartbeats and recovery.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use mocban_catalog::FailureAction;
use mocban_core::domain::{FailureClass, UnixMillis};
use mocban_system::failpoint;

/// Attempts of a stage that fails to read or write.
const IO_ATTEMPTS: u32 = 3;
/// Wait after the first such failure.
const BACKOFF_BASE: Duration = Duration::from_secs(1);
/// Longest wait, before jitter.
const BACKOFF_CAP: Duration = Duration::from_mins(1);

/// A failed attempt of a stage.
#[derive(Debug, Clone, Copy)]
pub(super) struct FailedAttempt {
    /// Row id of the pair or block.
    pub(super) id: i64,
    pub(super) class: FailureClass,
    /// Whether a retry may succeed.
    pub(super) is_transient: bool,
    /// Number of the attempt, from 1.
    pub(super) attempt: u32,
    /// Whether it ran with no other beside it. Always true for a block, because it was the only one of its process.
    pub(super) exclusive: bool,
}

/// Decides what follows a failed attempt: a retry after a wait, a retry while no other pair runs, or quarantine.
pub(super) fn failure_action(failed: FailedAttempt, now: UnixMillis) -> FailureAction {
    match failed.class {
        FailureClass::Io if failed.is_transient && failed.attempt < IO_ATTEMPTS => {
            FailureAction::BackOff {
                run_at: now + backoff_ms(failed.id, failed.attempt),
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

/// Returns the wait after an attempt in milliseconds: `min(cap, base * 2^(attempt - 1))` times a factor from 0.5 to
/// 1.5. The factor is a hash of pair or block, and attempt. It spreads the retries of pairs that failed together, and
/// is the same in every run.
fn backoff_ms(id: i64, attempt: u32) -> i64 {
    let doubled = BACKOFF_BASE.saturating_mul(1 << attempt.saturating_sub(1).min(16));
    let wait = doubled.min(BACKOFF_CAP).as_millis() as i64;
    let mixed =
        (id.unsigned_abs() ^ u64::from(attempt) << 48).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
    wait / 2 + wait * (mixed % 1000) as i64 / 1000
}

/// Returns the longest wait that a failure can lead to, in milliseconds.
pub(super) const fn longest_backoff_ms() -> i64 {
    BACKOFF_CAP.as_millis() as i64 * 3 / 2
}

/// Intervals of heartbeats and recovery. All workers use the same lease length, so each worker knows when others may
/// consider it dead. Every worker measures time with its own clock. The pairs of a dead worker are ready again within a
/// minute: one lease and two recovery intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Timing {
    /// Interval between heartbeats.
    pub(super) heartbeat_every: Duration,
    /// A worker without a heartbeat for this long is dead.
    pub(super) lease: Duration,
    /// Interval between searches for dead workers.
    pub(super) recover_every: Duration,
    /// A living worker loses a lease if it still sends heartbeats this long after the lease's deadline.
    pub(super) deadline_margin: Duration,
}

impl Timing {
    const DEFAULT: Self = Self {
        heartbeat_every: Duration::from_secs(10),
        lease: Duration::from_secs(50),
        recover_every: Duration::from_millis(2500),
        deadline_margin: Duration::from_mins(1),
    };

    /// Returns the intervals of this build. With debug assertions, `MOCBAN_TIME_SCALE=N` divides them by N for tests.
    pub(super) fn of_this_build() -> Self {
        Self::DEFAULT.divided_by(failpoint::time_scale("MOCBAN_TIME_SCALE"))
    }

    fn divided_by(self, scale: u32) -> Self {
        let scale = scale.max(1);
        Self {
            heartbeat_every: self.heartbeat_every / scale,
            lease: self.lease / scale,
            recover_every: self.recover_every / scale,
            deadline_margin: self.deadline_margin / scale,
        }
    }

    /// Returns the time limit for each input file that the scheduler waits for. Even if `MAX_HANGING` files hang, the
    /// scheduler sends its next heartbeat before its leases expire.
    pub(super) fn read_timeout(&self) -> Duration {
        self.heartbeat_every / 5
    }

    /// Returns the length of a lease in milliseconds.
    pub(super) const fn lease_ms(&self) -> i64 {
        self.lease.as_millis() as i64
    }
}

/// A clock that starts at the system's time and advances steadily. If the system's clock is changed during a run, this
/// clock does not follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    start: UnixMillis,
    since: Instant,
}

impl Clock {
    /// Starts at the system's time.
    pub(super) fn start() -> Self {
        let start = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_millis() as UnixMillis);
        Self {
            start,
            since: Instant::now(),
        }
    }

    /// Returns the current time.
    pub(super) fn now(&self) -> UnixMillis {
        self.start + self.since.elapsed().as_millis() as UnixMillis
    }

    /// Returns the milliseconds since the start.
    pub(super) fn elapsed_ms(&self) -> u64 {
        self.since.elapsed().as_millis() as u64
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::time::Duration;

    use super::{BACKOFF_CAP, FailedAttempt, IO_ATTEMPTS, Timing, backoff_ms, failure_action};
    use crate::input_reads::{MAX_HANGING, THREADS};
    use mocban_catalog::FailureAction;
    use mocban_core::domain::FailureClass;

    fn failed(class: FailureClass, attempt: u32) -> FailedAttempt {
        FailedAttempt {
            id: 7,
            class,
            is_transient: true,
            attempt,
            exclusive: false,
        }
    }

    #[test]
    fn a_transient_io_failure_is_retried_a_few_times() {
        let first = failure_action(failed(FailureClass::Io, 1), 1000);
        assert!(
            matches!(first, FailureAction::BackOff { run_at } if (1500..=2500).contains(&run_at))
        );
        let last = failure_action(failed(FailureClass::Io, IO_ATTEMPTS), 1000);
        assert_eq!(last, FailureAction::Quarantine);
    }

    #[test]
    fn a_missing_file_is_not_retried() {
        let missing = FailedAttempt {
            is_transient: false,
            ..failed(FailureClass::Io, 1)
        };
        assert_eq!(failure_action(missing, 0), FailureAction::Quarantine);
    }

    #[test]
    fn a_pair_that_exceeded_a_limit_is_retried_once_with_no_other_beside_it() {
        let first = failed(FailureClass::Resource, 1);
        assert_eq!(failure_action(first, 0), FailureAction::RetryExclusive);
        let second = FailedAttempt {
            exclusive: true,
            ..first
        };
        assert_eq!(failure_action(second, 0), FailureAction::Quarantine);
    }

    #[test]
    fn a_permanent_failure_is_quarantined_at_once() {
        for class in [
            FailureClass::BadInput,
            FailureClass::NoSolution,
            FailureClass::Bug,
        ] {
            assert_eq!(
                failure_action(failed(class, 1), 0),
                FailureAction::Quarantine
            );
        }
    }

    #[test]
    fn waits_double_up_to_the_cap_and_differ_between_pairs() {
        let waits: BTreeSet<_> = (0..50).map(|pair| backoff_ms(pair, 1)).collect();
        assert!(waits.len() > 10 && waits.iter().all(|wait| (500..=1500).contains(wait)));
        let cap = BACKOFF_CAP.as_millis() as i64;
        assert!((cap / 2..=cap * 3 / 2).contains(&backoff_ms(1, 30)));
    }

    #[test]
    fn dead_workers_are_found_within_a_minute_and_slow_ones_are_not_taken_for_dead() {
        let Timing {
            heartbeat_every,
            lease,
            recover_every,
            ..
        } = Timing::DEFAULT;
        // One recovery records the last heartbeat. A recovery at least one lease length later finds it unchanged.
        assert!(lease + recover_every * 2 <= Duration::from_mins(1));
        assert!(lease >= heartbeat_every * 4);
    }

    #[test]
    fn files_that_hang_do_not_make_a_worker_lose_its_leases() {
        let timing = Timing::DEFAULT;
        let longest_wait = timing.read_timeout() * MAX_HANGING.div_ceil(THREADS) as u32;
        // The reads may begin just before a heartbeat is due, and two reads may follow each other: one to recover
        // pairs and one to estimate their memory.
        assert!(timing.heartbeat_every + longest_wait * 2 < timing.lease);
    }
}
