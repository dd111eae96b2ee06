//! The intervals of heartbeats and recovery, and the clock of a run.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use mocban_core::domain::UnixMillis;
use mocban_system::failpoint;

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
        let timing = Self::DEFAULT.divided_by(failpoint::time_scale("MOCBAN_TIME_SCALE"));
        if cfg!(test) {
            timing.with_rare_heartbeats()
        } else {
            timing
        }
    }

    /// Returns intervals with which a run in a unit test sends no heartbeat after its first, at any speed.
    fn with_rare_heartbeats(self) -> Self {
        Self {
            heartbeat_every: self.heartbeat_every * 100,
            lease: self.lease * 100,
            ..self
        }
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
    use super::Timing;
    use crate::input_reads::{MAX_HANGING, THREADS};
    use std::time::Duration;

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
