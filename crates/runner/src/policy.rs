//! Decides what follows a failure: a retry after a wait, a retry alone, or quarantine. Has no side effects.

use std::time::Duration;

use mocban_catalog::FailureAction;
use mocban_core::domain::{FailureClass, UnixMillis};

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
    /// Whether it ran with as much memory as it can get, so that another attempt would fail too: a pair that ran
    /// exclusively, or a block, beside which its process claims nothing.
    pub(super) ran_alone: bool,
}

/// Decides what follows a failed attempt: a retry after a wait, a retry while no other pair runs, or quarantine.
pub(super) fn failure_action(failed: FailedAttempt, now: UnixMillis) -> FailureAction {
    match failed.class {
        FailureClass::Io if failed.is_transient && failed.attempt < IO_ATTEMPTS => {
            FailureAction::BackOff {
                run_at: now + backoff_ms(failed.id, failed.attempt),
            }
        }
        FailureClass::Resource if !failed.ran_alone => FailureAction::RetryExclusive,
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{BACKOFF_CAP, FailedAttempt, IO_ATTEMPTS, backoff_ms, failure_action};
    use mocban_catalog::FailureAction;
    use mocban_core::domain::FailureClass;

    fn failed(class: FailureClass, attempt: u32) -> FailedAttempt {
        FailedAttempt {
            id: 7,
            class,
            is_transient: true,
            attempt,
            ran_alone: false,
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
            ran_alone: true,
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
}
