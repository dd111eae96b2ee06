//! Time during which this process runs. Time limits count it instead of the time on a clock, because a process may be
//! suspended: by Ctrl-Z, by a batch scheduler, or with its virtual machine.

use std::time::{Duration, Instant};

/// Parts of a time limit. A suspension counts as one of them at most.
const PARTS: u32 = 8;
/// Longest part.
const LONGEST_PART: Duration = Duration::from_millis(500);

/// Waits until this process has run for as long as `limit`.
pub async fn sleep_active(limit: Duration) {
    let part = (limit / PARTS).min(LONGEST_PART);
    let mut left = limit;
    while !left.is_zero() {
        let next = left.min(part.max(Duration::from_millis(1)));
        tokio::time::sleep(next).await;
        left -= next;
    }
}

/// Waits for a future, but only while this process runs for at most `limit`. Returns `None` if the limit was reached first.
pub async fn timeout_active<T>(limit: Duration, future: impl Future<Output = T>) -> Option<T> {
    tokio::select! {
        biased;
        output = future => Some(output),
        () = sleep_active(limit) => None,
    }
}

/// Measures for how long this process has run. It must be read often: a longer time between two readings than
/// `longest_gap` counts as `longest_gap`.
#[derive(Debug)]
pub struct ActiveClock {
    longest_gap: Duration,
    active: Duration,
    read_at: Instant,
}

impl ActiveClock {
    /// Starts at 0.
    pub fn start(longest_gap: Duration) -> Self {
        Self {
            longest_gap,
            active: Duration::ZERO,
            read_at: Instant::now(),
        }
    }

    /// Continues from a time.
    #[cfg(any(test, feature = "test-helpers"))]
    pub fn continued(longest_gap: Duration, active: Duration) -> Self {
        Self {
            active,
            ..Self::start(longest_gap)
        }
    }

    /// Returns the time since the start, without suspensions.
    pub fn now(&mut self) -> Duration {
        self.advance_to(Instant::now())
    }

    fn advance_to(&mut self, now: Instant) -> Duration {
        let gap = now.saturating_duration_since(self.read_at);
        self.active += gap.min(self.longest_gap);
        self.read_at = now;
        self.active
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::{ActiveClock, PARTS, sleep_active, timeout_active};

    const SECOND: Duration = Duration::from_secs(1);
    const LIMIT: Duration = Duration::from_millis(80);

    #[tokio::test]
    async fn a_limit_without_a_suspension_is_the_time_on_the_clock() {
        for limit in [Duration::ZERO, Duration::from_nanos(1), LIMIT] {
            let begun = Instant::now();
            sleep_active(limit).await;
            assert!(begun.elapsed() >= limit, "{limit:?}");
        }
        assert_eq!(timeout_active(SECOND, async { 7 }).await, Some(7));
        let never = std::future::pending::<()>();
        assert_eq!(timeout_active(LIMIT, never).await, None);
    }

    /// The thread of the runtime is blocked, as that of a suspended process is.
    #[tokio::test]
    async fn a_suspension_counts_as_one_part_of_a_limit() {
        let suspended = async {
            std::thread::sleep(2 * LIMIT);
            Instant::now()
        };
        let ((), resumed) = tokio::join!(sleep_active(LIMIT), suspended);
        let left = LIMIT * (PARTS - 1) / PARTS;
        assert!(resumed.elapsed() >= left, "{:?}", resumed.elapsed());
    }

    #[test]
    fn a_long_gap_between_two_readings_counts_as_the_longest_one() {
        let mut clock = ActiveClock::start(2 * SECOND);
        let start = clock.read_at;
        assert_eq!(clock.advance_to(start + SECOND), SECOND);
        assert_eq!(clock.advance_to(start + 3600 * SECOND), 3 * SECOND);
        assert_eq!(clock.advance_to(start + 3601 * SECOND), 4 * SECOND);
        assert_eq!(clock.advance_to(start), 4 * SECOND);
    }
}
