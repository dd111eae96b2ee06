//! Upkeep of the queue: workers, dead workers' leases, back-off times, what is left.

use serde_json::{Value, json};
use sqlx::{Row as _, SqliteConnection};

use super::claim::PairSelection;
use super::counters::{Deltas, cursor};
use super::{Catalog, Result, rows};
use crate::domain::{CRASH_LIMIT, FailureClass, JobStatus, Stage, UnixMillis, WorkerId};

/// The process a worker runs in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerInfo {
    /// Name of the machine.
    pub host: String,
    /// Process number.
    pub pid: u32,
    /// Which start of the machine, where it can be told.
    pub boot_id: Option<String>,
}

/// A worker that holds leases, and when it last gave a sign of life by its own clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeaseHolder {
    /// Which worker.
    pub worker: WorkerId,
    /// Its last beat. Compare it with an earlier look, never with this machine's clock.
    pub beat: UnixMillis,
}

/// What a rescue brought back.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Rescued {
    /// Pairs that are ready again.
    pub ready: u64,
    /// Pairs that killed too many workers.
    pub quarantined: u64,
}

/// Work that is left among some pairs or all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Outstanding {
    /// Ready pairs with a stage to run.
    pub ready: u64,
    /// Pairs leased by anybody, with such a stage.
    pub leased: u64,
    /// Pairs that back off from such a stage.
    pub backoff: u64,
    /// When the first of those is due.
    pub next_due: Option<UnixMillis>,
}

/// Stages that are left among some pairs or all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WorkLeft {
    /// Pairs with a stage before them that is not kept back by a failure.
    pub pairs: u64,
    /// Those stages by stage.
    pub by_stage: [u64; 4],
    /// Pairs that failed for good.
    pub quarantined: u64,
}

/// Which leases to take back: those of some workers, or all but one's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Dead {
    /// These.
    Workers(Vec<WorkerId>),
    /// Everybody else, because the lock proves that no other process lives.
    AllBut(WorkerId),
}

pub(super) const HOLDERS: &str = "
SELECT w.id, w.beat FROM worker AS w
WHERE w.id IN (SELECT worker FROM job WHERE status = 1)
ORDER BY w.id";

/// Workers among some, whether each died (did not end in order), and how many leases it left.
pub(super) const LEFT_BY: &str = "
SELECT w.id, w.ended IS NULL AS died, count(*) AS leases
FROM job AS j JOIN worker AS w ON w.id = j.worker
WHERE j.status = 1 AND j.worker IN (SELECT value FROM json_each(?1)) GROUP BY w.id";

/// Takes leases back: worker, whether it died, whether its pair is to blame. A crash counts as a crash and not as a
/// try, so that a failure that may pass later keeps all its tries. Pairs of a worker that died are suspect:
/// they run after the others, each by itself. The condition is `domain::is_condemned`.
pub(super) const RESCUE: &str = "
UPDATE job SET
    status = iif((item.value ->> 2)
        AND crashes + 1 >= ?2 + max(0, ?3 - crashes - 2), 4, 0),
    worker = NULL, deadline = NULL, epoch = epoch + 1, crashes = crashes + (item.value ->> 2),
    attempt = max(attempt - 1, 0), mem_class = max(mem_class, item.value ->> 1)
FROM json_each(?1) AS item WHERE job.status = 1 AND job.worker = item.value ->> 0
RETURNING pair, stage, status, crashes";

/// Processes that did not end in order, among the newest 32; the one that asks is among them.
const DEATHS: &str = "
SELECT count(*) FROM (SELECT ended FROM worker ORDER BY id DESC LIMIT 32) WHERE ended IS NULL";

/// Takes back leases of other workers that still give signs of life long after the lease's deadline. Beat and deadline
/// are both by the worker's own clock: two clocks are never compared.
pub(super) const OVERDUE: &str = "
UPDATE job SET status = iif(crashes + 1 >= ?2, 4, 0), worker = NULL, deadline = NULL,
    epoch = epoch + 1, crashes = crashes + 1, attempt = max(attempt - 1, 0), mem_class = 1
WHERE status = 1 AND worker IN (SELECT value FROM json_each(?1))
    AND deadline + ?3 < (SELECT w.beat FROM worker AS w WHERE w.id = job.worker)
RETURNING pair, stage, status, crashes";

/// Back-off times that are over, or so far ahead that the clock must have jumped.
pub(super) const DUE: &str = "
UPDATE job SET status = 0, run_at = NULL WHERE status = 2 AND (run_at <= ?1 OR run_at > ?2)
RETURNING stage";

const CRASHED: &str = "
INSERT INTO failure (pair, stage, class, message, at)
SELECT value ->> 'pair', value ->> 'stage', value ->> 'class', value ->> 'message', value ->> 'at'
FROM json_each(?1) WHERE true
ON CONFLICT (pair) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    recipe = NULL, mesh_hash = NULL, print_hash = NULL, facts = NULL, at = excluded.at";

const CRASH_ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, class, message, at)
SELECT value ->> 'pair', value ->> 'stage', value ->> 'class', value ->> 'message', value ->> 'at' FROM json_each(?1)";

const LEFT_ALL: &str = "
SELECT
    (SELECT count(*) FROM (SELECT 1 FROM job WHERE status = 0 AND stage <= ?1 LIMIT 1000)),
    (SELECT count(*) FROM job WHERE status = 1 AND stage <= ?1),
    (SELECT count(*) FROM job WHERE status = 2 AND stage <= ?1),
    (SELECT min(run_at) FROM job WHERE status = 2 AND stage <= ?1)";

const LEFT_AMONG: &str = "
SELECT count(*) FILTER (WHERE j.status = 0), count(*) FILTER (WHERE j.status = 1),
    count(*) FILTER (WHERE j.status = 2), min(j.run_at)
FROM json_each(?2) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value WHERE j.stage <= ?1";

const COUNT_AMONG: &str = "
SELECT j.stage, j.status, count(*) FROM json_each(?1) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
GROUP BY j.stage, j.status";

impl Catalog {
    /// Enters a process that will work; its number is never used again.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn register_worker(&self, info: WorkerInfo, now: UnixMillis) -> Result<WorkerId> {
        self.alone(move |conn| {
            Box::pin(async move {
                let id: i64 = sqlx::query_scalar(
                    "INSERT INTO worker (host, pid, boot_id, started, beat) VALUES (?1, ?2, ?3, ?4, ?4) RETURNING id",
                )
                .bind(info.host)
                .bind(info.pid)
                .bind(info.boot_id)
                .bind(now)
                .fetch_one(conn)
                .await?;
                Ok(WorkerId(id))
            })
        })
        .await
    }

    /// Says that a worker ended in order.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn end_worker(&self, worker: WorkerId, now: UnixMillis) -> Result<()> {
        self.alone(move |conn| {
            Box::pin(async move {
                sqlx::query("UPDATE worker SET ended = ?2 WHERE id = ?1")
                    .bind(worker.0)
                    .bind(now)
                    .execute(conn)
                    .await?;
                Ok(())
            })
        })
        .await
    }

    /// Workers that hold leases.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn lease_holders(&self) -> Result<Vec<LeaseHolder>> {
        let mut conn = self.reader().await?;
        let found = sqlx::query(HOLDERS).fetch_all(&mut *conn).await?;
        found
            .iter()
            .map(|row| {
                Ok(LeaseHolder {
                    worker: WorkerId(row.try_get(0)?),
                    beat: row.try_get(1)?,
                })
            })
            .collect()
    }

    /// Takes back the leases of dead workers: ready again, or quarantined when too many died over the pair.
    ///
    /// A pair is blamed for a death only when its worker held no other, and condemned only as `is_condemned` says.
    /// So a process that is killed from outside, however often, does not bring its pairs into quarantine.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn rescue(&self, dead: Dead, now: UnixMillis) -> Result<Rescued> {
        self.alone(move |conn| {
            Box::pin(async move {
                let workers = match dead {
                    Dead::Workers(workers) => workers.iter().map(|worker| worker.0).collect(),
                    Dead::AllBut(me) => holders_but(conn, me).await?,
                };
                let items = left_by(conn, workers).await?;
                let deaths: i64 = sqlx::query_scalar(DEATHS).fetch_one(&mut *conn).await?;
                let found = sqlx::query(RESCUE)
                    .bind(items)
                    .bind(CRASH_LIMIT)
                    .bind(deaths - 1)
                    .fetch_all(&mut *conn)
                    .await?;
                brought_back(conn, &found, now).await
            })
        })
        .await
    }

    /// Takes back the leases of other workers that have outlived the lease's deadline by more than `margin_ms`: they
    /// hang although their process lives. A living process looks after its deadlines itself, so this is rare.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn rescue_overdue(
        &self,
        me: WorkerId,
        margin_ms: i64,
        now: UnixMillis,
    ) -> Result<Rescued> {
        self.alone(move |conn| {
            Box::pin(async move {
                let others = holders_but(conn, me).await?;
                let found = sqlx::query(OVERDUE)
                    .bind(Value::from(others).to_string())
                    .bind(CRASH_LIMIT)
                    .bind(margin_ms)
                    .fetch_all(&mut *conn)
                    .await?;
                brought_back(conn, &found, now).await
            })
        })
        .await
    }

    /// Makes pairs ready whose back-off is over; also those due more than `longest` ahead, which only a clock
    /// that jumped can bring about. Says how many.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn stage_due(&self, now: UnixMillis, longest: i64) -> Result<u64> {
        self.alone(move |conn| {
            Box::pin(async move {
                let stages: Vec<i64> = sqlx::query_scalar(DUE)
                    .bind(now)
                    .bind(now + longest)
                    .fetch_all(&mut *conn)
                    .await?;
                let mut deltas = Deltas::default();
                for stage in &stages {
                    deltas.moved((*stage, JobStatus::Backoff), (*stage, JobStatus::Ready));
                }
                deltas.apply(conn).await?;
                Ok(stages.len() as u64)
            })
        })
        .await
    }

    /// What is left to do up to a stage; `ready` stops counting at 1000.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn outstanding(
        &self,
        until: Stage,
        among: Option<&PairSelection>,
    ) -> Result<Outstanding> {
        let mut conn = self.reader().await?;
        let query = match among {
            None => sqlx::query(LEFT_ALL).bind(cursor(until)),
            Some(among) => sqlx::query(LEFT_AMONG)
                .bind(cursor(until))
                .bind(&among.json),
        };
        let row = query.fetch_one(&mut *conn).await?;
        let count = |index: usize| row.try_get::<i64, _>(index).map(i64::unsigned_abs);
        Ok(Outstanding {
            ready: count(0)?,
            leased: count(1)?,
            backoff: count(2)?,
            next_due: row.try_get(3)?,
        })
    }
}

impl Catalog {
    /// What is left to do up to a stage, from the counters, or counted among some pairs.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn work_left(&self, until: Stage, among: Option<&PairSelection>) -> Result<WorkLeft> {
        let mut conn = self.reader().await?;
        let query = match among {
            None => sqlx::query("SELECT stage, status, n FROM counter WHERE n > 0"),
            Some(among) => sqlx::query(COUNT_AMONG).bind(&among.json),
        };
        let mut left = WorkLeft::default();
        for row in query.fetch_all(&mut *conn).await? {
            let (at, n): (i64, i64) = (row.try_get(0)?, row.try_get(2)?);
            let n = n.unsigned_abs();
            match rows::status(row.try_get(1)?)? {
                JobStatus::Quarantined => left.quarantined += n,
                JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff
                    if at <= cursor(until) =>
                {
                    left.pairs += n;
                    for stage in Stage::ALL {
                        if (at..=cursor(until)).contains(&cursor(stage)) {
                            left.by_stage[stage.index()] += n;
                        }
                    }
                }
                JobStatus::Ready
                | JobStatus::Leased
                | JobStatus::Backoff
                | JobStatus::Done
                | JobStatus::Held => {}
            }
        }
        Ok(left)
    }
}

/// Items of [`RESCUE`] for some workers.
async fn left_by(conn: &mut SqliteConnection, workers: Vec<i64>) -> Result<String> {
    let found = sqlx::query(LEFT_BY)
        .bind(Value::from(workers).to_string())
        .fetch_all(conn)
        .await?;
    let mut items = Vec::with_capacity(found.len());
    for row in &found {
        let (worker, died, leases): (i64, bool, i64) =
            (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
        let blamed = died && leases == 1;
        items.push(json!([worker, i64::from(died), i64::from(blamed)]));
    }
    Ok(Value::from(items).to_string())
}

async fn holders_but(conn: &mut SqliteConnection, me: WorkerId) -> Result<Vec<i64>> {
    let holders: Vec<i64> = sqlx::query_scalar(HOLDERS).fetch_all(conn).await?;
    Ok(holders
        .into_iter()
        .filter(|worker| *worker != me.0)
        .collect())
}

/// Counts what came back, and says why the quarantined ones are.
async fn brought_back(
    conn: &mut SqliteConnection,
    found: &[sqlx::sqlite::SqliteRow],
    now: UnixMillis,
) -> Result<Rescued> {
    let mut rescued = Rescued::default();
    let mut deltas = Deltas::default();
    let mut crashed = Vec::new();
    for row in found {
        let (pair, stage): (i64, i64) = (row.try_get(0)?, row.try_get(1)?);
        let (status, crashes): (_, i64) = (rows::status(row.try_get(2)?)?, row.try_get(3)?);
        deltas.moved((stage, JobStatus::Leased), (stage, status));
        if status == JobStatus::Quarantined {
            rescued.quarantined += 1;
            crashed.push(json!({
                "pair": pair, "stage": stage, "class": FailureClass::Resource, "at": now,
                "message": format!("{crashes} workers died or hung over it at {}", rows::stage(stage)?),
            }));
        } else {
            rescued.ready += 1;
        }
    }
    if !crashed.is_empty() {
        let items = Value::from(crashed).to_string();
        for sql in [CRASHED, CRASH_ATTEMPT] {
            sqlx::query(sql).bind(&items).execute(&mut *conn).await?;
        }
    }
    deltas.apply(conn).await?;
    Ok(rescued)
}
