//! Taking leases back from workers that died or hang, and finding the pairs that kill them.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::db::script::Script;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::checkpoint::{UPDATE_INPUTS, input_row};
use crate::catalog::queue::counters::{CounterKey, Deltas};
use crate::catalog::queue::lease::InputVersions;
use crate::domain::{CRASH_LIMIT, FailureClass, JobStatus, PairId, UnixMillis, WorkerId};

/// A worker that holds leases, and when it last gave a sign of life by its own clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeaseHolder {
    /// Which worker.
    pub worker: WorkerId,
    /// Its last heartbeat. Compare it with an earlier look, never with this machine's clock.
    pub heartbeat: UnixMillis,
}

/// What a recovery brought back.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Recovered {
    /// How many pairs are ready again.
    pub ready: u64,
    /// Pairs that killed too many workers: quarantined.
    pub poisoned: Vec<PairId>,
}

/// Which leases to take back: those of some workers, or all but one's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DeadWorker {
    /// These.
    Workers(Vec<WorkerId>),
    /// Everybody else, because the lock proves that no other process lives.
    AllExcept(WorkerId),
}

pub(crate) const HOLDERS: &str = "
SELECT w.id, w.heartbeat FROM worker AS w
WHERE w.id IN (SELECT worker FROM job WHERE status = 1)
ORDER BY w.id";

/// Workers among some, whether each died (did not end in order), and how many leases it left.
pub(crate) const LEFT_BY: &str = "
SELECT w.id, w.ended IS NULL AS died, count(*) AS leases
FROM job AS j JOIN worker AS w ON w.id = j.worker
WHERE j.status = 1 AND j.worker IN (SELECT value FROM json_each(?1)) GROUP BY w.id";

/// Takes leases back: worker, whether it died, whether its pair is to blame. A crash counts as a crash and not as a
/// try, so that a failure that may pass later keeps all its tries. Pairs of a worker that died are suspect:
/// they run after the others, each by itself. The condition is `domain::is_poisoned`.
pub(crate) const RECOVER: &str = "
UPDATE job SET
    status = iif((item.value ->> 2)
        AND crashes + 1 >= ?2 + max(0, ?3 - crashes - 2), 4, 0),
    worker = NULL, deadline = NULL, token = token + 1, crashes = crashes + (item.value ->> 2),
    attempt = max(attempt - 1, 0), exclusive = max(exclusive, item.value ->> 1)
FROM json_each(?1) AS item WHERE job.status = 1 AND job.worker = item.value ->> 0
RETURNING pair, stage, status, crashes, fingerprint";

/// Notes that workers died: some, or all that did not end in order but for one.
const DIED: &str =
    "UPDATE worker SET died = 1 WHERE ended IS NULL AND id IN (SELECT value FROM json_each(?1))";
const ALL_DIED: &str = "
UPDATE worker SET died = 1 WHERE ended IS NULL AND id <> ?1
    AND id IN (SELECT id FROM worker ORDER BY id DESC LIMIT 33)";

/// How many of the newest 32 workers died.
const DEATHS: &str = "
SELECT count(*) FROM (SELECT died, ended FROM worker ORDER BY id DESC LIMIT 32) WHERE died AND ended IS NULL";

/// Whose leases are taken back.
pub(crate) const AFFECTED_PAIRS: &str = "
SELECT pair, worker FROM job WHERE status = 1 AND worker IN (SELECT value FROM json_each(?1))";

/// Takes back leases of other workers that still give signs of life long after the lease's deadline. Heartbeat and deadline
/// are both by the worker's own clock: two clocks are never compared.
pub(crate) const OVERDUE: &str = "
UPDATE job SET status = iif(crashes + 1 >= ?2, 4, 0), worker = NULL, deadline = NULL,
    token = token + 1, crashes = crashes + 1, attempt = max(attempt - 1, 0), exclusive = 1
WHERE status = 1 AND worker IN (SELECT value FROM json_each(?1))
    AND deadline + ?3 < (SELECT w.heartbeat FROM worker AS w WHERE w.id = job.worker)
RETURNING pair, stage, status, crashes, fingerprint";

/// With the settings of the worker that died and the inputs as last seen.
const CRASHED: &str = "
INSERT INTO failure (pair, stage, class, message, fingerprint, mesh_hash, print_hash, attributes, at)
SELECT p.id, item.value ->> 'stage', item.value ->> 'class', item.value ->> 'message',
    w.fingerprints ->> (item.value ->> 'stage'), p.mesh_hash, p.print_hash, p.attributes, item.value ->> 'at'
FROM json_each(?1) AS item CROSS JOIN pair AS p ON p.id = item.value ->> 'pair'
    LEFT JOIN worker AS w ON w.id = item.value ->> 'worker'
WHERE true
ON CONFLICT (pair) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash, print_hash = excluded.print_hash,
    attributes = excluded.attributes, at = excluded.at";

const CRASH_ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, class, message, at)
SELECT value ->> 'pair', value ->> 'stage', value ->> 'worker', value ->> 'class', value ->> 'message', value ->> 'at' FROM json_each(?1)";

const FATAL_INPUTS: &str = "
UPDATE failure SET mesh_hash = coalesce(failure.mesh_hash, unhex(item.value ->> 'mesh_hash')),
    print_hash = coalesce(failure.print_hash, unhex(item.value ->> 'print_hash'))
FROM json_each(?) AS item WHERE failure.pair = item.value ->> 'pair'";

impl Catalog {
    /// Workers that hold leases.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn lease_holders(&self) -> Result<Vec<LeaseHolder>> {
        let mut conn = self.read_conn().await?;
        let found = sqlx::query(HOLDERS).fetch_all(&mut *conn).await?;
        found
            .iter()
            .map(|row| {
                Ok(LeaseHolder {
                    worker: WorkerId(row.try_get(0)?),
                    heartbeat: row.try_get(1)?,
                })
            })
            .collect()
    }

    /// Takes back the leases of dead workers: ready again, or quarantined when too many died over the pair.
    ///
    /// A pair is blamed for a death only when its worker held no other, and poisoned only as `is_poisoned` says.
    /// So a process that is killed from outside, however often, hardly ever brings its pairs into quarantine: only one
    /// that was alone in hand at nearly every death there was, which is what a pair that kills looks like.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn recover(&self, dead: DeadWorker, now: UnixMillis) -> Result<Recovered> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let workers = mark_dead(conn, &dead).await?;
                let affected = affected_pairs(conn, &workers).await?;
                let items = left_by(conn, &workers).await?;
                let deaths: i64 = sqlx::query_scalar(DEATHS).fetch_one(&mut *conn).await?;
                let found = sqlx::query(RECOVER)
                    .bind(items)
                    .bind(CRASH_LIMIT)
                    .bind(deaths)
                    .fetch_all(&mut *conn)
                    .await?;
                brought_back(conn, &found, &affected, now).await
            })
        })
        .await
    }

    /// Notes what the input files of pairs are that killed their workers, where no stage ever said so: a file that is
    /// mended later must be told from the one that did it.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn record_poisoned_inputs(&self, seen: Vec<(PairId, InputVersions)>) -> Result<()> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let mut script = Script::default();
                let items = || seen.iter().map(|(pair, seen)| input_row(*pair, seen));
                script.execute_over(UPDATE_INPUTS, items())?;
                script.execute_over(FATAL_INPUTS, items())?;
                script.run(conn).await?;
                Ok(())
            })
        })
        .await
    }

    /// Takes back the leases of other workers that have outlived the lease's deadline by more than `margin_ms`: they
    /// hang although their process lives. A living process looks after its deadlines itself, so this is rare.
    ///
    /// # Errors
    /// When the database refuses.
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
    conn: &mut SqliteConnection,
    me: WorkerId,
    margin_ms: i64,
    now: UnixMillis,
) -> Result<Recovered> {
    let others = holders_but(conn, me).await?;
    let affected = affected_pairs(conn, &others).await?;
    let found = sqlx::query(OVERDUE)
        .bind(others)
        .bind(CRASH_LIMIT)
        .bind(margin_ms)
        .fetch_all(&mut *conn)
        .await?;
    brought_back(conn, &found, &affected, now).await
}

/// Items of [`RECOVER`] for some workers.
async fn left_by(conn: &mut SqliteConnection, workers: &str) -> Result<String> {
    let found = sqlx::query(LEFT_BY).bind(workers).fetch_all(conn).await?;
    let mut items = Vec::with_capacity(found.len());
    for row in &found {
        let (worker, died, leases): (i64, bool, i64) =
            (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
        let blamed = died && leases == 1;
        items.push(json!([worker, i64::from(died), i64::from(blamed)]));
    }
    Ok(Value::from(items).to_string())
}

/// Notes who died; gives those that may hold leases, as a JSON array.
async fn mark_dead(conn: &mut SqliteConnection, dead: &DeadWorker) -> Result<String> {
    match dead {
        DeadWorker::Workers(workers) => {
            let workers = rows::array(workers.iter().map(|worker| worker.0)).to_string();
            sqlx::query(DIED).bind(&workers).execute(conn).await?;
            Ok(workers)
        }
        DeadWorker::AllExcept(me) => {
            sqlx::query(ALL_DIED).bind(me.0).execute(&mut *conn).await?;
            holders_but(conn, *me).await
        }
    }
}

/// Workers with leases but for one, as a JSON array.
async fn holders_but(conn: &mut SqliteConnection, me: WorkerId) -> Result<String> {
    let holders: Vec<i64> = sqlx::query_scalar(HOLDERS).fetch_all(conn).await?;
    let others = holders.into_iter().filter(|worker| *worker != me.0);
    Ok(rows::array(others).to_string())
}

/// The pairs of some workers, each with its worker.
async fn affected_pairs(conn: &mut SqliteConnection, workers: &str) -> Result<BTreeMap<i64, i64>> {
    let found: Vec<(i64, i64)> = sqlx::query_as(AFFECTED_PAIRS)
        .bind(workers)
        .fetch_all(conn)
        .await?;
    Ok(found.into_iter().collect())
}

/// Counts what came back, and says why the quarantined ones are.
async fn brought_back(
    conn: &mut SqliteConnection,
    found: &[sqlx::sqlite::SqliteRow],
    affected: &BTreeMap<i64, i64>,
    now: UnixMillis,
) -> Result<Recovered> {
    let mut recovered = Recovered::default();
    let mut deltas = Deltas::default();
    let mut crashed = Vec::new();
    for row in found {
        let (pair, stage): (i64, i64) = (row.try_get(0)?, row.try_get(1)?);
        let (status, crashes): (_, i64) = (rows::status(row.try_get(2)?)?, row.try_get(3)?);
        let to = CounterKey::new(stage, status, row.try_get("fingerprint")?);
        deltas.move_job(to.with_status(JobStatus::Leased), to);
        if status == JobStatus::Quarantined {
            recovered.poisoned.push(PairId(pair));
            crashed.push(json!({
                "pair": pair, "worker": affected.get(&pair), "stage": stage, "class": FailureClass::Resource, "at": now,
                "message": format!("{crashes} workers died or hung over it at {}", rows::stage(stage)?),
            }));
        } else {
            recovered.ready += 1;
        }
    }
    if !crashed.is_empty() {
        let items = Value::from(crashed).to_string();
        for sql in [CRASHED, CRASH_ATTEMPT] {
            sqlx::query(sql).bind(&items).execute(&mut *conn).await?;
        }
    }
    deltas.apply(conn).await?;
    Ok(recovered)
}
