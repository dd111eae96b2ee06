//! Recovers the leases of workers that died or hang, of pairs and blocks in one transaction, and quarantines jobs that kill
//! workers.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use serde_json::json;

use crate::blocks::block_job::BlockJob;
use crate::db::conn::Conn;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::rows::json_array;
use crate::db::script::Script;
use crate::db::transaction::in_transaction;
use crate::queue::checkpoint::{add_records, merged};
use crate::queue::counters::{Deltas, KeyedJob};
use crate::queue::kind::{JobKind, StoredKind, Template};
use crate::queue::pair_job::PairJob;
use crate::{Catalog, Result};
use mocban_core::domain::{FailureClass, JobStatus, PairId, UnixMillis, WorkerId};

/// A job is quarantined for killing workers only if its crashes reach this number.
pub(crate) const CRASH_LIMIT: u32 = 3;

/// A worker that holds leases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeaseHolder {
    /// The worker.
    pub worker: WorkerId,
    /// Last heartbeat of the worker, by its own clock. Compare it only with other heartbeats of the same worker,
    /// because clocks may differ.
    pub heartbeat: UnixMillis,
    /// Whether the worker is connected to the server. Always true if the catalog is a file.
    pub is_connected: bool,
}

from_row! { LeaseHolder { worker: "id", heartbeat, is_connected } }

/// The result of a recovery.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Recovered {
    /// Number of pairs that are ready again.
    pub ready: u64,
    /// Pairs that killed too many workers and are now quarantined.
    pub poisoned: Vec<PairId>,
    /// Number of blocks that are ready again.
    pub blocks: u64,
}

/// Which workers are dead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DeadWorker {
    /// These workers, with the heartbeats and connections observed. One that has sent a heartbeat or connected since is
    /// left out. After `valid_until`, no worker is marked as dead, because an outage may have delayed all heartbeats.
    Observed {
        /// The workers.
        workers: Vec<LeaseHolder>,
        /// When the observation is too old.
        valid_until: Instant,
    },
    /// This worker, which is known to be dead, such as an earlier id of this process.
    Known(WorkerId),
    /// All workers except this one, which holds the exclusive run lock.
    AllExcept(WorkerId),
}

pub(crate) const HOLDERS: &str = "
SELECT w.id, w.heartbeat, 1 AS is_connected FROM worker AS w
WHERE w.id IN (SELECT worker FROM job WHERE status = 1 UNION ALL SELECT worker FROM block_job WHERE status = 1)
ORDER BY w.id";

/// Selects the workers in `?1`, a list of `[worker, heartbeat]`, whose stored heartbeat is still the given one.
const STILL_SILENT: &str = "
SELECT w.id FROM json_each(?1) AS seen CROSS JOIN worker AS w ON w.id = CAST(seen.value ->> 0 AS bigint)
WHERE w.heartbeat = CAST(seen.value ->> 1 AS bigint)";

/// Selects the given workers that hold leases, of pairs or blocks. `died` is 1 if the worker did not end properly.
pub(crate) const ORPHANED: &str = "
SELECT w.id, w.ended IS NULL AS died, count(*) AS leases FROM (
        SELECT worker FROM job WHERE status = 1 AND worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1))
        UNION ALL
        SELECT worker FROM block_job WHERE status = 1 AND worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1))) AS lease
    JOIN worker AS w ON w.id = lease.worker
GROUP BY w.id";

/// Recovers the leases of the workers in `?1`, a list of `[worker, died, blamed]`. `blamed` is 1 if the worker died with
/// only one lease, so that this pair or block is blamed. The interrupted attempt is not counted. Pairs of a worker that
/// died must run exclusively from now on.
///
/// `crashes` counts the workers that died while they leased only this job, or hung on it; a finished stage resets it. `?3`
/// counts recent worker deaths. If the job is the cause, they exceed its crashes by at most one, for a worker that also
/// leased other jobs. Each further death suggests an external cause, such as killed processes, and raises the limit `?2` for
/// status 4 (quarantined) by one.
pub(crate) static RECOVER: Template = Template::new(
    "
UPDATE {job} SET
    status = CASE WHEN [2] = 1 AND crashes + 1 >= ?2 + max(0, ?3 - crashes - 2) THEN 4 ELSE 0 END,
    worker = NULL, deadline = NULL, token = token + 1, crashes = crashes + [2], attempt = max(attempt - 1, 0){and_recover}
FROM json_each(?1) AS item WHERE {job}.status = 1 AND {job}.worker = [0]
RETURNING {unit} AS unit, stage, status, crashes, coalesce({fingerprint}, 0) AS fingerprint",
);

/// Marks workers as dead, unless they ended properly.
const DIED: &str = "UPDATE worker SET died = 1 WHERE ended IS NULL AND id IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";
/// Marks recent workers except one as dead. Only [`DEATHS`] reads the mark, and it ignores older workers.
const ALL_DIED: &str = "
UPDATE worker SET died = 1 WHERE ended IS NULL AND id <> ?1
    AND id IN (SELECT id FROM worker ORDER BY id DESC LIMIT 33)";

/// Selects the numbers of all locks of workers in this catalog. The key is that of `TRY_LOCK` in
/// `queue/commit/write_connection.rs`.
const WORKER_LOCKS: &str = "
SELECT CAST(objid AS bigint) FROM pg_locks
WHERE locktype = 'advisory' AND objsubid = 2 AND granted
    AND database = (SELECT oid FROM pg_database WHERE datname = current_database())
    AND classid = CAST(hashtext(current_setting('search_path')) AS oid)";

/// Counts the workers that died among the newest 32.
const DEATHS: &str = "
SELECT count(*) FROM (SELECT died, ended FROM worker ORDER BY id DESC LIMIT 32) AS newest
WHERE died = 1 AND ended IS NULL";

/// Selects the leased jobs of the given workers.
pub(crate) static AFFECTED: Template = Template::new(
    "
SELECT {unit} AS unit, worker FROM {job}
WHERE status = 1 AND worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1))",
);

/// Recovers overdue leases of workers that are not known to be dead. A lease is overdue if the worker's last heartbeat
/// is more than `?3` after the deadline. Both times are by the worker's own clock.
pub(crate) static OVERDUE: Template = Template::new(
    "
UPDATE {job} SET status = CASE WHEN crashes + 1 >= ?2 THEN 4 ELSE 0 END, worker = NULL, deadline = NULL,
    token = token + 1, crashes = crashes + 1, attempt = max(attempt - 1, 0){and_overdue}
WHERE status = 1 AND worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1))
    AND deadline + ?3 < (SELECT w.heartbeat FROM worker AS w WHERE w.id = {job}.worker)
RETURNING {unit} AS unit, stage, status, crashes, coalesce({fingerprint}, 0) AS fingerprint",
);

/// A row of [`RECOVER`] or [`OVERDUE`].
struct RecoveredJob {
    job: KeyedJob,
    crashes: i64,
}

from_row! { RecoveredJob { job in row, crashes } }

/// Recovered jobs of a kind.
#[derive(Debug)]
struct RecoveredJobs<K: JobKind> {
    /// Number of jobs that are ready again.
    ready: u64,
    /// Jobs that killed too many workers and are now quarantined.
    poisoned: Vec<K::Unit>,
}

impl Catalog {
    /// Returns the workers that hold leases.
    pub async fn lease_holders(&self) -> Result<Vec<LeaseHolder>> {
        let mut conn = self.read_conn().await?;
        let mut holders: Vec<LeaseHolder> = query_as(HOLDERS).fetch_all(&mut conn).await?;
        if self.is_shared() && !holders.is_empty() {
            let workers = holders.iter().map(|holder| holder.worker);
            let connected = connected_workers(&mut conn, workers).await?;
            for holder in &mut holders {
                holder.is_connected = connected.contains(&holder.worker);
            }
        }
        Ok(holders)
    }

    /// Recovers the leases of dead workers. Each pair or block becomes ready again, or is quarantined if it probably
    /// caused several deaths.
    ///
    /// A pair or block is blamed for a death if it was the worker's only lease. The limit for its crashes rises with other
    /// recent deaths. Therefore, killing processes from outside rarely quarantines one.
    pub async fn recover(&self, dead: DeadWorker, now: UnixMillis) -> Result<Recovered> {
        in_transaction!(self, |conn| {
            let workers = mark_dead(conn, &dead).await?;
            let items = orphaned(conn, &workers).await?;
            let deaths = deaths(conn).await?;
            let left = [&*workers, &items];
            let pairs = recover_jobs::<PairJob>(conn, left, deaths, now).await?;
            let blocks = recover_jobs::<BlockJob>(conn, left, deaths, now).await?;
            Ok(both(pairs, &blocks))
        })
    }

    /// Recovers overdue leases of other workers that are not known to be dead. A lease is overdue if its worker's last
    /// heartbeat is more than `margin_ms` after the deadline. This is rare, because processes enforce their own
    /// deadlines.
    pub async fn recover_overdue(
        &self,
        me: WorkerId,
        margin_ms: i64,
        now: UnixMillis,
    ) -> Result<Recovered> {
        self.in_transaction(move |conn| Box::pin(overdue(conn, me, margin_ms, now)))
            .await
    }
}

async fn overdue(
    conn: &mut Conn,
    me: WorkerId,
    margin_ms: i64,
    now: UnixMillis,
) -> Result<Recovered> {
    let others = holders_but(conn, me).await?;
    let pairs = recover_overdue_jobs::<PairJob>(conn, &others, margin_ms, now).await?;
    let blocks = recover_overdue_jobs::<BlockJob>(conn, &others, margin_ms, now).await?;
    Ok(both(pairs, &blocks))
}

fn both(pairs: RecoveredJobs<PairJob>, blocks: &RecoveredJobs<BlockJob>) -> Recovered {
    Recovered {
        ready: pairs.ready,
        poisoned: pairs.poisoned,
        blocks: blocks.ready,
    }
}

/// Recovers the jobs of dead workers, given as a JSON array and as the items of [`orphaned`].
async fn recover_jobs<K: StoredKind>(
    conn: &mut Conn,
    [workers, items]: [&str; 2],
    deaths: i64,
    now: UnixMillis,
) -> Result<RecoveredJobs<K>> {
    let affected = affected::<K>(conn, workers).await?;
    let query = query_as(RECOVER.of::<K>()).bind(items).bind(CRASH_LIMIT);
    let found = query.bind(deaths).fetch_all(&mut *conn).await?;
    store_recovered(conn, found, &affected, now).await
}

/// Recovers the overdue jobs of living workers, given as a JSON array.
async fn recover_overdue_jobs<K: StoredKind>(
    conn: &mut Conn,
    workers: &str,
    margin_ms: i64,
    now: UnixMillis,
) -> Result<RecoveredJobs<K>> {
    let affected = affected::<K>(conn, workers).await?;
    let query = query_as(OVERDUE.of::<K>()).bind(workers).bind(CRASH_LIMIT);
    let found = query.bind(margin_ms).fetch_all(&mut *conn).await?;
    store_recovered(conn, found, &affected, now).await
}

/// Counts the recent deaths of workers.
async fn deaths(conn: &mut Conn) -> Result<i64> {
    query_scalar(DEATHS).fetch_one(conn).await
}

/// Builds the items of [`RECOVER`] for some workers.
async fn orphaned(conn: &mut Conn, workers: &str) -> Result<String> {
    let found: Vec<(i64, bool, i64)> = query_as(ORPHANED).bind(workers).fetch_all(conn).await?;
    let items = found.into_iter().map(|(worker, died, leases)| {
        let blamed = died && leases == 1;
        json!([worker, i64::from(died), i64::from(blamed)])
    });
    Ok(json_array(items))
}

/// Marks workers as dead. Returns the ids of the workers whose leases must be recovered, as a JSON array.
async fn mark_dead(conn: &mut Conn, dead: &DeadWorker) -> Result<String> {
    match dead {
        DeadWorker::Observed {
            workers,
            valid_until,
        } => {
            let workers = if Instant::now() < *valid_until {
                still_dead(conn, workers).await?
            } else {
                Vec::new()
            };
            let workers = json_array(workers.iter().map(|worker| worker.0));
            query(DIED).bind(&workers).execute(conn).await?;
            Ok(workers)
        }
        DeadWorker::Known(worker) => {
            let workers = json_array([worker.0]);
            query(DIED).bind(&workers).execute(conn).await?;
            Ok(workers)
        }
        DeadWorker::AllExcept(me) => {
            query(ALL_DIED).bind(me.0).execute(&mut *conn).await?;
            holders_but(conn, *me).await
        }
    }
}

/// Returns the workers that have sent no heartbeat since they were observed. A worker that had no connection and has one now
/// is left out too.
async fn still_dead(conn: &mut Conn, seen: &[LeaseHolder]) -> Result<Vec<WorkerId>> {
    let items = json_array(
        seen.iter()
            .map(|seen| json!([seen.worker.0, seen.heartbeat])),
    );
    let silent: Vec<i64> = query_scalar(STILL_SILENT)
        .bind(items)
        .fetch_all(&mut *conn)
        .await?;
    let unconnected = seen.iter().filter(|seen| !seen.is_connected);
    let unconnected: Vec<WorkerId> = unconnected.map(|seen| seen.worker).collect();
    let connected = if unconnected.is_empty() {
        BTreeSet::new()
    } else {
        connected_workers(conn, unconnected.into_iter()).await?
    };
    let silent = silent.into_iter().map(WorkerId);
    Ok(silent
        .filter(|worker| !connected.contains(worker))
        .collect())
}

/// Returns the workers with leases except one, as a JSON array.
async fn holders_but(conn: &mut Conn, me: WorkerId) -> Result<String> {
    let holders: Vec<LeaseHolder> = query_as(HOLDERS).fetch_all(conn).await?;
    let others = holders.iter().map(|holder| holder.worker);
    let others = others.filter(|worker| *worker != me);
    Ok(json_array(others.map(|worker| worker.0)))
}

/// Returns the leased jobs of some workers, each with its worker.
async fn affected<K: StoredKind>(
    conn: &mut Conn,
    workers: &str,
) -> Result<BTreeMap<i64, WorkerId>> {
    let query = query_as(AFFECTED.of::<K>()).bind(workers);
    let found: Vec<(i64, WorkerId)> = query.fetch_all(conn).await?;
    Ok(found.into_iter().collect())
}

/// Updates the counters for recovered pairs, and stores a failure for each quarantined job.
async fn store_recovered<K: StoredKind>(
    conn: &mut Conn,
    found: Vec<RecoveredJob>,
    affected: &BTreeMap<i64, WorkerId>,
    now: UnixMillis,
) -> Result<RecoveredJobs<K>> {
    let mut recovered = RecoveredJobs {
        ready: 0,
        poisoned: Vec::new(),
    };
    let mut deltas = Deltas::default();
    let mut crashed = Vec::new();
    for RecoveredJob { job, crashes } in found {
        let KeyedJob { unit: id, key } = job;
        deltas.move_job(key.with_status(JobStatus::Leased), key);
        let stage = usize::try_from(key.cursor).ok().and_then(K::stage);
        match stage {
            Some(stage) if key.status == JobStatus::Quarantined => {
                let (unit, worker) = (K::unit(id), affected.get(&id).copied());
                recovered.poisoned.push(unit);
                let fields = json!({
                    "unit": id, "worker": worker, "stage": key.cursor, "class": FailureClass::Resource,
                    "message": format!("{crashes} workers died or hung over it at {stage}"), "at": now,
                    "status": key.status.code(),
                });
                let provenance = K::crashed(conn, unit, stage, worker).await?;
                crashed.push(merged(fields, provenance));
            }
            _ => recovered.ready += 1,
        }
    }
    let mut script = Script::default();
    if !crashed.is_empty() {
        add_records::<K>(&mut script, &crashed)?;
    }
    if K::IS_COUNTED {
        deltas.add_to(&mut script)?;
    }
    script.run(conn).await?;
    Ok(recovered)
}

/// Returns which of the workers hold their locks.
async fn connected_workers(
    conn: &mut Conn,
    workers: impl Iterator<Item = WorkerId>,
) -> Result<BTreeSet<WorkerId>> {
    let held: Vec<i64> = query_scalar(WORKER_LOCKS).fetch_all(conn).await?;
    let held: BTreeSet<i64> = held.into_iter().collect();
    let number = |worker: &WorkerId| worker.0 % (1 << 31);
    Ok(workers
        .filter(|worker| held.contains(&number(worker)))
        .collect())
}
