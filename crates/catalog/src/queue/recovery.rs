//! Recovers leases of workers that died or hang, and quarantines pairs that kill workers.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use serde_json::json;

use crate::db::conn::Conn;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::rows::json_array;
use crate::db::script::Script;
use crate::queue::checkpoint::{UPDATE_INPUTS, input_item};
use crate::queue::counters::{Deltas, KeyedJob};
use crate::queue::lease::InputVersions;
use crate::queue::worker_lock;
use crate::{Catalog, Result};
use mocban_core::domain::{CRASH_LIMIT, FailureClass, JobStatus, PairId, UnixMillis, WorkerId};

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

/// Selects the given workers that hold leases. `died` is 1 if the worker did not end properly.
pub(crate) const LEFT_BY: &str = "
SELECT w.id, w.ended IS NULL AS died, count(*) AS leases
FROM job AS j JOIN worker AS w ON w.id = j.worker
WHERE j.status = 1 AND j.worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1)) GROUP BY w.id";

/// Recovers the leases of the workers in `?1`, a list of `[worker, died, blamed]`. `blamed` is 1 if the worker died with
/// only one lease, so that this pair is blamed. The interrupted attempt is not counted. Pairs of a worker that died must
/// run exclusively from now on. The condition for status 4 (quarantined) is that of `domain::is_poisoned`.
pub(crate) const RECOVER: &str = "
UPDATE job SET
    status = CASE WHEN CAST(item.value ->> 2 AS bigint) = 1
        AND crashes + 1 >= ?2 + max(0, ?3 - crashes - 2) THEN 4 ELSE 0 END,
    worker = NULL, deadline = NULL, token = token + 1, crashes = crashes + CAST(item.value ->> 2 AS bigint),
    attempt = max(attempt - 1, 0), exclusive = max(exclusive, CAST(item.value ->> 1 AS bigint))
FROM json_each(?1) AS item WHERE job.status = 1 AND job.worker = CAST(item.value ->> 0 AS bigint)
RETURNING pair, stage, status, crashes, coalesce(fingerprint, 0) AS fingerprint";

/// Marks workers as dead, unless they ended properly.
const DIED: &str = "UPDATE worker SET died = 1 WHERE ended IS NULL AND id IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";
/// Marks recent workers except one as dead. Only [`DEATHS`] reads the mark, and it ignores older workers.
const ALL_DIED: &str = "
UPDATE worker SET died = 1 WHERE ended IS NULL AND id <> ?1
    AND id IN (SELECT id FROM worker ORDER BY id DESC LIMIT 33)";

/// Counts the workers that died among the newest 32.
const DEATHS: &str = "
SELECT count(*) FROM (SELECT died, ended FROM worker ORDER BY id DESC LIMIT 32) AS newest
WHERE died = 1 AND ended IS NULL";

/// Selects the leased pairs of the given workers.
pub(crate) const AFFECTED_PAIRS: &str = "
SELECT pair, worker FROM job WHERE status = 1 AND worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";

/// Recovers overdue leases of workers that are not known to be dead. A lease is overdue if the worker's last heartbeat
/// is more than `?3` after the deadline. Both times are by the worker's own clock.
pub(crate) const OVERDUE: &str = "
UPDATE job SET status = CASE WHEN crashes + 1 >= ?2 THEN 4 ELSE 0 END, worker = NULL, deadline = NULL,
    token = token + 1, crashes = crashes + 1, attempt = max(attempt - 1, 0), exclusive = 1
WHERE status = 1 AND worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1))
    AND deadline + ?3 < (SELECT w.heartbeat FROM worker AS w WHERE w.id = job.worker)
RETURNING pair, stage, status, crashes, coalesce(fingerprint, 0) AS fingerprint";

/// Stores the failure of a quarantined pair, with its worker's settings and the inputs as last read.
const CRASHED: &str = "
INSERT INTO failure (pair, stage, class, message, fingerprint, mesh_hash, print_hash, attributes, at)
SELECT p.id, CAST(item.value ->> 'stage' AS bigint), item.value ->> 'class', item.value ->> 'message',
    CAST(w.fingerprints ->> CAST(item.value ->> 'stage' AS bigint) AS bigint), p.mesh_hash, p.print_hash, p.attributes, CAST(item.value ->> 'at' AS bigint)
FROM json_each(?1) AS item CROSS JOIN pair AS p ON p.id = CAST(item.value ->> 'pair' AS bigint)
    LEFT JOIN worker AS w ON w.id = CAST(item.value ->> 'worker' AS bigint)
WHERE true
ON CONFLICT (pair) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash, print_hash = excluded.print_hash,
    attributes = excluded.attributes, at = excluded.at";

const CRASH_ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, class, message, at)
SELECT CAST(value ->> 'pair' AS bigint), CAST(value ->> 'stage' AS bigint), CAST(value ->> 'worker' AS bigint), value ->> 'class', value ->> 'message', CAST(value ->> 'at' AS bigint) FROM json_each(?1)";

const FATAL_INPUTS: &str = "
UPDATE failure SET mesh_hash = coalesce(failure.mesh_hash, unhex(item.value ->> 'mesh_hash')),
    print_hash = coalesce(failure.print_hash, unhex(item.value ->> 'print_hash'))
FROM json_each(?) AS item WHERE failure.pair = CAST(item.value ->> 'pair' AS bigint)";

/// A row of [`RECOVER`] or [`OVERDUE`].
struct RecoveredJob {
    job: KeyedJob,
    crashes: i64,
}

from_row! { RecoveredJob { job in row, crashes } }

impl Catalog {
    /// Returns the workers that hold leases.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn lease_holders(&self) -> Result<Vec<LeaseHolder>> {
        let mut conn = self.read_conn().await?;
        let mut holders: Vec<LeaseHolder> = query_as(HOLDERS).fetch_all(&mut conn).await?;
        if self.is_shared() && !holders.is_empty() {
            let workers = holders.iter().map(|holder| holder.worker);
            let connected = worker_lock::connected(&mut conn, workers).await?;
            for holder in &mut holders {
                holder.is_connected = connected.contains(&holder.worker);
            }
        }
        Ok(holders)
    }

    /// Stores the current versions of input files that no stage of a quarantined pair has read. A later run compares
    /// the stored hashes to detect replaced files.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn record_poisoned_inputs(&self, seen: Vec<(PairId, InputVersions)>) -> Result<()> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let mut script = Script::default();
                let items = || {
                    seen.iter()
                        .map(|(pair, inputs)| input_item((*pair, inputs)))
                };
                script.execute_over(UPDATE_INPUTS, items())?;
                script.execute_over(FATAL_INPUTS, items())?;
                script.run(conn).await?;
                Ok(())
            })
        })
        .await
    }
}

/// Recovers the pairs of dead workers, given as a JSON array.
pub(crate) async fn recover(
    conn: &mut Conn,
    workers: &str,
    deaths: i64,
    now: UnixMillis,
) -> Result<Recovered> {
    let affected = affected_pairs(conn, workers).await?;
    let items = left_by(conn, workers).await?;
    let query = query_as(RECOVER).bind(items).bind(CRASH_LIMIT);
    let found = query.bind(deaths).fetch_all(&mut *conn).await?;
    count_recovered(conn, found, &affected, now).await
}

/// Recovers the pairs of living workers, given as a JSON array, whose leases are overdue.
pub(crate) async fn recover_overdue(
    conn: &mut Conn,
    workers: &str,
    margin_ms: i64,
    now: UnixMillis,
) -> Result<Recovered> {
    let affected = affected_pairs(conn, workers).await?;
    let query = query_as(OVERDUE).bind(workers).bind(CRASH_LIMIT);
    let found = query.bind(margin_ms).fetch_all(&mut *conn).await?;
    count_recovered(conn, found, &affected, now).await
}

/// Counts the recent deaths of workers.
pub(crate) async fn deaths(conn: &mut Conn) -> Result<i64> {
    query_scalar(DEATHS).fetch_one(conn).await
}

/// Builds the items of [`RECOVER`] for some workers.
async fn left_by(conn: &mut Conn, workers: &str) -> Result<String> {
    let query = query_as(LEFT_BY).bind(workers);
    let found: Vec<(i64, bool, i64)> = query.fetch_all(conn).await?;
    let items = found.into_iter().map(|(worker, died, leases)| {
        let blamed = died && leases == 1;
        json!([worker, i64::from(died), i64::from(blamed)])
    });
    Ok(json_array(items))
}

/// Marks workers as dead. Returns the ids of the workers whose leases must be recovered, as a JSON array.
pub(crate) async fn mark_dead(conn: &mut Conn, dead: &DeadWorker) -> Result<String> {
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
        worker_lock::connected(conn, unconnected.into_iter()).await?
    };
    let silent = silent.into_iter().map(WorkerId);
    Ok(silent
        .filter(|worker| !connected.contains(worker))
        .collect())
}

/// Returns the workers with leases except one, as a JSON array.
pub(crate) async fn holders_but(conn: &mut Conn, me: WorkerId) -> Result<String> {
    let holders: Vec<LeaseHolder> = query_as(HOLDERS).fetch_all(conn).await?;
    let others = holders.iter().map(|holder| holder.worker);
    let others = others.filter(|worker| *worker != me);
    Ok(json_array(others.map(|worker| worker.0)))
}

/// Returns the leased pairs of some workers, each with its worker.
async fn affected_pairs(conn: &mut Conn, workers: &str) -> Result<BTreeMap<i64, i64>> {
    let query = query_as(AFFECTED_PAIRS).bind(workers);
    let found: Vec<(i64, i64)> = query.fetch_all(conn).await?;
    Ok(found.into_iter().collect())
}

/// Updates the counters for recovered pairs, and stores a failure for each quarantined pair.
async fn count_recovered(
    conn: &mut Conn,
    found: Vec<RecoveredJob>,
    affected: &BTreeMap<i64, i64>,
    now: UnixMillis,
) -> Result<Recovered> {
    let mut recovered = Recovered::default();
    let mut deltas = Deltas::default();
    let mut crashed = Vec::new();
    for RecoveredJob { job, crashes } in found {
        let KeyedJob { pair, key } = job;
        deltas.move_job(key.with_status(JobStatus::Leased), key);
        match key.stage() {
            Some(stage) if key.status == JobStatus::Quarantined => {
                recovered.poisoned.push(PairId(pair));
                crashed.push(json!({
                    "pair": pair, "worker": affected.get(&pair), "stage": key.cursor, "class": FailureClass::Resource,
                    "message": format!("{crashes} workers died or hung over it at {stage}"), "at": now,
                }));
            }
            _ => recovered.ready += 1,
        }
    }
    if !crashed.is_empty() {
        let items = json_array(crashed);
        for sql in [CRASHED, CRASH_ATTEMPT] {
            query(sql).bind(&items).execute(&mut *conn).await?;
        }
    }
    deltas.apply(conn).await?;
    Ok(recovered)
}
