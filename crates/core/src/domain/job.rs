//! The status of a job, and when a pair is quarantined because its workers die.

use serde::{Deserialize, Serialize};

use super::enum_names;

/// The status of a pair's job in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JobStatus {
    /// Ready to be claimed.
    Ready,
    /// Claimed by a worker.
    Leased,
    /// Waits for its next attempt after a transient failure.
    Backoff,
    /// All stages are done.
    Done,
    /// Failed permanently; only `retry` or a changed input runs it again.
    Quarantined,
}

enum_names! { pub JobStatus, "a job status":
    Ready = "ready", Leased = "leased", Backoff = "backoff", Done = "done", Quarantined = "quarantined",
}

impl JobStatus {
    /// Returns the code in the catalog.
    pub const fn code(self) -> i64 {
        self as i64
    }

    /// Returns the status of a code in the catalog.
    pub fn from_code(code: i64) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.code() == code)
    }
}

/// A pair is quarantined for killing workers only if its crashes reach this number.
pub const CRASH_LIMIT: u32 = 3;

/// Returns whether a pair must be quarantined because it probably kills its workers.
///
/// `crashes` is the number of workers that died while they leased only this pair, or hung on this pair. A finished
/// stage resets `crashes`. `deaths` is the number of recent worker deaths. If the pair is the cause, `deaths` exceeds
/// `crashes` by at most one, for a worker that also leased other pairs. Each further death suggests an external cause,
/// such as killed processes, and raises the limit by one.
pub const fn is_poisoned(crashes: u32, deaths: u32) -> bool {
    crashes >= CRASH_LIMIT + deaths.saturating_sub(crashes + 1)
}

#[cfg(test)]
mod tests {
    use super::{JobStatus, is_poisoned};

    #[test]
    fn the_third_crash_poisons_unless_others_died_too() {
        assert!(!is_poisoned(2, 2));
        assert!(is_poisoned(3, 3));
        // The first death was shared.
        assert!(is_poisoned(3, 4));
        // Two deaths the pair had no part in.
        assert!(!is_poisoned(3, 6));
        assert!(!is_poisoned(4, 7));
        assert!(is_poisoned(5, 8));
    }

    #[test]
    fn status_codes_lead_back() {
        for status in JobStatus::ALL {
            assert_eq!(JobStatus::from_code(status.code()), Some(status));
        }
        assert_eq!(JobStatus::from_code(5), None);
    }
}
