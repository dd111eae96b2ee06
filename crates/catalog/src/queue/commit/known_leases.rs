//! Leases that this process has received from a server. The reply to a claim can be lost after its commit. Then the
//! catalog contains leases that this process has not received, and its heartbeats keep them valid.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::db::rows::json_array;
use crate::queue::checkpoint::{LeasedCheckpoints, position_after};
use crate::queue::claim::leases;
use crate::queue::kind::{StoredKind, Template};
use crate::queue::lease::{FencedRow, Lease};
use crate::queue::pair_job::PairJob;
use mocban_core::domain::{JobStatus, PairId, WorkerId};

/// Time after a reconnection or a failed claim during which unknown leases are searched for. A server may execute a commit
/// of the broken connection until it notices that the connection is broken.
const SEARCH_TIME: Duration = Duration::from_mins(2);

/// Selects jobs by pair or block.
static JOBS: Template = Template::new(
    "
SELECT j.{unit} AS unit, j.token, j.stage, j.status, j.worker FROM json_each(?1) AS wanted
    CROSS JOIN {job} AS j ON j.{unit} = CAST(wanted.atom AS bigint)",
);

/// Tokens of known leases by pair.
#[derive(Debug, Default)]
pub(crate) struct KnownLeases {
    tokens: BTreeMap<PairId, i64>,
    search_until: Option<Instant>,
}

/// The state of a job.
struct StoredJob {
    unit: i64,
    token: i64,
    stage: i64,
    status: JobStatus,
    worker: Option<i64>,
}

from_row! { StoredJob { unit, token, stage, status, worker } }

impl KnownLeases {
    /// Records that replies may have been lost.
    pub(crate) fn replies_may_be_lost(&mut self) {
        self.search_until = Some(Instant::now() + SEARCH_TIME);
    }

    /// Returns whether an earlier commit may have been stored although its reply was lost.
    pub(crate) fn is_searching(&self) -> bool {
        self.search_until
            .is_some_and(|until| Instant::now() <= until)
    }

    /// Adds leases that a claim returned.
    pub(crate) fn add(&mut self, leases: &[Lease]) {
        let tokens = leases.iter().map(|lease| (lease.unit, lease.token));
        self.tokens.extend(tokens);
    }

    /// Removes a lease that has ended. A later lease of the same pair stays.
    pub(crate) fn remove(&mut self, lease: &Lease) {
        if self.tokens.get(&lease.unit) == Some(&lease.token) {
            self.tokens.remove(&lease.unit);
        }
    }

    /// Returns the leases of a worker that this process has not received. Queries the server only for `SEARCH_TIME` after
    /// a reconnection or a failed claim.
    pub(crate) async fn unknown(&self, conn: &mut Conn, worker: WorkerId) -> Result<Vec<Lease>> {
        if !self.is_searching() {
            return Ok(Vec::new());
        }
        let mut leases = leases::<PairJob>(conn, worker).await?;
        leases.retain(|lease| self.tokens.get(&lease.unit) != Some(&lease.token));
        Ok(leases)
    }
}

/// Returns the jobs of checkpoints, and of failures and releases (`ended`), which an earlier commit has already stored.
pub(crate) async fn stored_before<'i, K: StoredKind>(
    conn: &mut Conn,
    checkpoints: impl Iterator<Item = &'i LeasedCheckpoints<K>>,
    ended: impl Iterator<Item = &'i Lease<K>>,
) -> Result<Vec<FencedRow>> {
    let checkpoints: BTreeMap<_, _> = checkpoints
        .filter_map(|(lease, stages)| Some((lease.id(), (lease, position_after(stages)?))))
        .collect();
    let ended: BTreeMap<_, _> = ended.map(|lease| (lease.id(), lease)).collect();
    let units: Vec<_> = checkpoints.keys().chain(ended.keys()).copied().collect();
    if units.is_empty() {
        return Ok(Vec::new());
    }
    let jobs = query_as(JOBS.of::<K>()).bind(json_array(units));
    let jobs = jobs.fetch_all(conn);
    let jobs: Vec<StoredJob> = jobs.await?;
    let is_stored = |job: &StoredJob| {
        if let Some((lease, (stage, status))) = checkpoints.get(&job.unit) {
            let worker = (*status == JobStatus::Leased).then_some(lease.worker.0);
            return job.token == lease.token
                && (job.stage, job.status, job.worker) == (*stage, *status, worker);
        }
        ended
            .get(&job.unit)
            .is_some_and(|lease| job.token == lease.token && job.worker.is_none())
    };
    let stored = jobs.into_iter().filter(is_stored);
    Ok(stored
        .map(|job| FencedRow {
            unit: job.unit,
            token: job.token,
        })
        .collect())
}

/// Returns whether an earlier commit has stored a failure or a release under this lease.
pub(crate) async fn is_end_stored<K: StoredKind>(
    conn: &mut Conn,
    lease: &Lease<K>,
) -> Result<bool> {
    let stored = stored_before(conn, [].into_iter(), [lease].into_iter()).await?;
    Ok(lease.is_in(&stored))
}
