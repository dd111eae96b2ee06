//! Lists the workers with their metrics, for people who watch them.

use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::jobs::shared_runs::SHOWN_ACTIVE_MS;
use crate::{Catalog, Result};
use mocban_core::domain::{UnixMillis, WorkerId, WorkerMetrics, enum_names};

/// Selects the workers whose last heartbeat is later than `?1`. Leaves out workers that ended without metrics.
pub(crate) const LIST: &str = "
SELECT w.id, w.host, w.pid, w.started, w.heartbeat, w.ended, w.died, w.metrics,
    (SELECT count(*) FROM job AS j WHERE j.worker = w.id AND j.status = 1) AS leased
FROM worker AS w WHERE w.heartbeat > ?1 AND (w.ended IS NULL OR w.metrics IS NOT NULL)
ORDER BY w.id";

/// Selects the worker that registered last.
const LAST: &str = "
SELECT w.id, w.host, w.pid, w.started, w.heartbeat, w.ended, w.died, w.metrics,
    (SELECT count(*) FROM job AS j WHERE j.worker = w.id AND j.status = 1) AS leased
FROM worker AS w ORDER BY w.id DESC LIMIT 1";

/// A worker as stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerRecord {
    /// The worker.
    pub id: WorkerId,
    /// Host name.
    pub host: String,
    /// Process id.
    pub pid: u32,
    /// Time of the registration, by the worker's clock.
    pub started: UnixMillis,
    /// Time of the last heartbeat, by the worker's clock.
    pub heartbeat: UnixMillis,
    /// When the worker ended properly.
    pub ended: Option<UnixMillis>,
    /// Whether another worker found it dead.
    pub died: bool,
    /// Pairs that it has leased.
    pub leased: u64,
    /// What it reported with its last heartbeat.
    pub metrics: Option<WorkerMetrics>,
}

from_row! { WorkerRecord { id, host, pid, started, heartbeat, ended, died, leased, metrics as JsonOrNull } }

/// What a worker does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum WorkerState {
    /// It works.
    Alive,
    /// It finishes the stages in progress, and starts no more.
    Stopping,
    /// It did not end properly: another worker found it dead, or it has sent no heartbeat for a minute.
    Gone,
    /// It ended properly.
    Ended,
}

enum_names! { pub WorkerState, "a state of a worker":
    Alive = "alive", Stopping = "stopping", Gone = "gone", Ended = "ended",
}

impl WorkerRecord {
    /// Returns what the worker does, as far as others know. Compares the worker's clock with `now`.
    pub fn state(&self, now: UnixMillis) -> WorkerState {
        if self.ended.is_some() {
            WorkerState::Ended
        } else if self.died || now - self.heartbeat > SHOWN_ACTIVE_MS {
            WorkerState::Gone
        } else if self.metrics.as_ref().is_some_and(|one| one.stopping) {
            WorkerState::Stopping
        } else {
            WorkerState::Alive
        }
    }
}

impl Catalog {
    /// Returns the workers whose last heartbeat is later than `since`, in the order in which they registered.
    pub async fn workers(&self, since: UnixMillis) -> Result<Vec<WorkerRecord>> {
        let mut conn = self.read_conn().await?;
        query_as(LIST).bind(since).fetch_all(&mut conn).await
    }

    /// Returns the worker that registered last, also if it ended without metrics. `None` if no run has begun.
    pub async fn last_worker(&self) -> Result<Option<WorkerRecord>> {
        let mut conn = self.read_conn().await?;
        query_as(LAST).fetch_optional(&mut conn).await
    }
}
