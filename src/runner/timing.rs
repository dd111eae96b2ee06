//! How often workers show that they live, and how long the others wait for it.

use std::time::Duration;

/// Times by which workers know of each other. A lease lasts as long for the one that holds it as for those who watch
/// it, each by its own clock, so that whoever is taken for dead knows it too. A dead worker's pairs are back within a
/// minute: a lease and two looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Timing {
    /// Between two signs of life.
    pub(super) beat_every: Duration,
    /// Without a sign of life for so long a worker is dead.
    pub(super) lease: Duration,
    /// Between two looks for dead workers.
    pub(super) rescue_every: Duration,
    /// How long after its deadline a lease is taken back from a worker that still lives.
    pub(super) deadline_margin: Duration,
}

impl Timing {
    const REAL: Self = Self {
        beat_every: Duration::from_secs(10),
        lease: Duration::from_secs(50),
        rescue_every: Duration::from_secs(5),
        deadline_margin: Duration::from_mins(1),
    };

    /// As it is; in builds with debug assertions `MOCBAN_TIME_SCALE=N` makes it N times as fast, for tests.
    pub(super) fn of_this_build() -> Self {
        let haste = cfg!(debug_assertions)
            .then(|| std::env::var("MOCBAN_TIME_SCALE").ok()?.parse().ok())
            .flatten();
        Self::REAL.hastened(haste.unwrap_or(1))
    }

    fn hastened(self, times: u32) -> Self {
        let times = times.max(1);
        Self {
            beat_every: self.beat_every / times,
            lease: self.lease / times,
            rescue_every: self.rescue_every / times,
            deadline_margin: self.deadline_margin / times,
        }
    }

    /// Length of a lease in milliseconds.
    pub(super) const fn lease_ms(&self) -> i64 {
        self.lease.as_millis() as i64
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::Timing;

    #[test]
    fn the_dead_are_found_within_a_minute_and_the_slow_are_not_taken_for_dead() {
        let Timing {
            beat_every,
            lease,
            rescue_every,
            ..
        } = Timing::REAL;
        // The heartbeat is first seen at a look, and the end of the lease noticed at another.
        assert!(lease + rescue_every * 2 <= Duration::from_mins(1));
        assert!(lease >= beat_every * 4);
    }
}
