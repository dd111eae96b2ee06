//! Worker registration, due back-offs and open work.

use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::counters::{CounterKey, Deltas, cursor};
use crate::catalog::queue::fingerprint::FingerprintIds;
use crate::catalog::queue::selection::PairSelection;
use crate::domain::{JobStatus, Stage, UnixMillis, WorkerId};

/// The process a worker runs in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerInfo {
    /// Host name.
    pub host: String,
    /// Process id.
    pub pid: u32,
    /// Boot id of the machine, where known.
    pub boot_id: Option<String>,
}

/// Open work among some pairs or all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Outstanding {
    /// Ready pairs with a stage to run.
    pub ready: u64,
    /// Pairs leased by anybody, with such a stage.
    pub leased: u64,
    /// Pairs that back off from such a stage.
    pub backoff: u64,
    /// Time of the first due back-off.
    pub next_due: Option<UnixMillis>,
}

/// Open stages among some pairs or all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WorkLeft {
    /// Pairs with open stages that are not quarantined.
    pub pairs: u64,
    /// Open stages by stage.
    pub by_stage: [u64; 4],
    /// Quarantined pairs.
    pub quarantined: u64,
}

/// Due back-offs, including those implausibly far in the future (clock jump).
pub(crate) const DUE: &str = "
UPDATE job SET status = 0, run_at = NULL WHERE status = 2 AND (run_at <= ?1 OR run_at > ?2)
RETURNING stage, fingerprint";

pub(crate) const LEFT_ALL: &str = "
SELECT
    (SELECT count(*) FROM (SELECT 1 FROM job WHERE status = 0 AND stage <= ?1 LIMIT 1000)),
    (SELECT count(*) FROM job WHERE status = 1 AND stage <= ?1),
    (SELECT count(*) FROM job WHERE status = 2 AND stage <= ?1),
    (SELECT min(run_at) FROM job WHERE status = 2 AND stage <= ?1)";

const LEFT_AMONG: &str = "
SELECT count(*) FILTER (WHERE j.status = 0), count(*) FILTER (WHERE j.status = 1),
    count(*) FILTER (WHERE j.status = 2), min(j.run_at)
FROM json_each(?2) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value WHERE j.stage <= ?1";

const COUNT_ALL: &str = "SELECT stage, status, sum(n) FROM counter GROUP BY stage, status";

const COUNT_AMONG: &str = "
SELECT j.stage, j.status, count(*) FROM json_each(?1) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
GROUP BY j.stage, j.status";

impl Catalog {
    /// Registers a worker process with the fingerprints it computes with; ids are never reused.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn register_worker(
        &self,
        info: WorkerInfo,
        fingerprints: FingerprintIds,
        now: UnixMillis,
    ) -> Result<WorkerId> {
        self.in_transaction(move |conn| Box::pin(insert_worker(conn, info, fingerprints, now)))
            .await
    }

    /// Records that a worker ended properly.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn end_worker(&self, worker: WorkerId, now: UnixMillis) -> Result<()> {
        self.in_transaction(move |conn| {
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

    /// Makes pairs with due back-offs ready, also those due more than `longest` milliseconds ahead, which only a clock
    /// jump can cause. Returns how many.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn release_due_backoffs(&self, now: UnixMillis, longest: i64) -> Result<u64> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let due: Vec<(i64, Option<i64>)> = sqlx::query_as(DUE)
                    .bind(now)
                    .bind(now + longest)
                    .fetch_all(&mut *conn)
                    .await?;
                let mut deltas = Deltas::default();
                for (cursor, fingerprint) in &due {
                    let to = CounterKey::new(*cursor, JobStatus::Ready, *fingerprint);
                    deltas.move_job(to.with_status(JobStatus::Backoff), to);
                }
                deltas.apply(conn).await?;
                Ok(due.len() as u64)
            })
        })
        .await
    }

    /// Returns the open work up to a stage; `ready` stops counting at 1000.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn outstanding(
        &self,
        until: Stage,
        among: Option<&PairSelection>,
    ) -> Result<Outstanding> {
        let mut conn = self.read_conn().await?;
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

async fn insert_worker(
    conn: &mut SqliteConnection,
    info: WorkerInfo,
    fingerprints: FingerprintIds,
    now: UnixMillis,
) -> Result<WorkerId> {
    let id: i64 = sqlx::query_scalar(
        "INSERT INTO worker (host, pid, boot_id, started, heartbeat, fingerprints)
        VALUES (?1, ?2, ?3, ?4, ?4, ?5) RETURNING id",
    )
    .bind(info.host)
    .bind(info.pid)
    .bind(info.boot_id)
    .bind(now)
    .bind(fingerprints.json())
    .fetch_one(conn)
    .await?;
    Ok(WorkerId(id))
}

impl Catalog {
    /// Returns the open stages up to a stage, from the counters, or counted among some pairs.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn work_left(&self, until: Stage, among: Option<&PairSelection>) -> Result<WorkLeft> {
        let mut conn = self.read_conn().await?;
        let query = match among {
            None => sqlx::query(COUNT_ALL),
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
                JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff | JobStatus::Done => {}
            }
        }
        Ok(left)
    }
}
