//! The run's clock: one look at the wall clock at the start, then only forward.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

use crate::domain::UnixMillis;

/// Wall time that a jump of the system's clock cannot move while the run lasts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    wall: UnixMillis,
    since: Instant,
}

impl Clock {
    /// Starts from the system's clock.
    pub(super) fn start() -> Self {
        let wall = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_millis() as UnixMillis);
        Self {
            wall,
            since: Instant::now(),
        }
    }

    /// Now.
    pub(super) fn now(&self) -> UnixMillis {
        self.wall + self.since.elapsed().as_millis() as UnixMillis
    }

    /// Milliseconds since the start.
    pub(super) fn elapsed_ms(&self) -> u64 {
        self.since.elapsed().as_millis() as u64
    }
}
