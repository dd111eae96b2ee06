//! The status of a job.

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

#[cfg(test)]
mod tests {
    use super::JobStatus;

    #[test]
    fn status_codes_lead_back() {
        for status in JobStatus::ALL {
            assert_eq!(JobStatus::from_code(status.code()), Some(status));
        }
        assert_eq!(JobStatus::from_code(5), None);
    }
}
