//! Worker registration, due back-offs and open work.

use sqlx::SqliteConnection;

use crate::catalog::queue::counters::{CounterKey, Cursor, Deltas, cursor};
use crate::catalog::queue::fingerprint::FingerprintIds;
use crate::catalog::queue::selection::PairSelection;
use crate::catalog::{Catalog, Result};
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, sqlx::FromRow)]
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

/// Makes jobs ready if their back-off is due, or ends so far in the future that the clock must have jumped.
pub(crate) const DUE: &str = "
UPDATE job SET status = 0, run_at = NULL WHERE status = 2 AND (run_at <= ?1 OR run_at > ?2)
RETURNING stage, status, coalesce(fingerprint, 0) AS fingerprint";

pub(crate) const LEFT_ALL: &str = "
SELECT
    (SELECT count(*) FROM (SELECT 1 FROM job WHERE status = 0 AND stage <= ?1 LIMIT 1000)) AS ready,
    (SELECT count(*) FROM job WHERE status = 1 AND stage <= ?1) AS leased,
    (SELECT count(*) FROM job WHERE status = 2 AND stage <= ?1) AS backoff,
    (SELECT min(run_at) FROM job WHERE status = 2 AND stage <= ?1) AS next_due";

const LEFT_AMONG: &str = "
SELECT count(*) FILTER (WHERE j.status = 0) AS ready, count(*) FILTER (WHERE j.status = 1) AS leased,
    count(*) FILTER (WHERE j.status = 2) AS backoff, min(j.run_at) AS next_due
FROM json_each(?2) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value WHERE j.stage <= ?1";

const COUNT_ALL: &str = "SELECT stage, status, sum(n) FROM counter GROUP BY stage, status";

const COUNT_AMONG: &str = "
SELECT j.stage, j.status, count(*) FROM json_each(?1) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
GROUP BY j.stage, j.status";

impl Catalog {
    /// Registers a worker process and the fingerprints of its settings. Returns the worker's id; ids are never reused.
    ///
    /// # Errors
    /// If the database returns an error.
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
    /// If the database returns an error.
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

    /// Makes pairs ready whose back-off is due. Back-offs due more than `longest` milliseconds ahead end too, because
    /// only a clock jump can cause them. Returns the number of pairs made ready.
    ///
    /// # Errors
    /// If the database returns an error.
    pub async fn release_due_backoffs(&self, now: UnixMillis, longest: i64) -> Result<u64> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let query = sqlx::query_as(DUE).bind(now).bind(now + longest);
                let due: Vec<CounterKey> = query.fetch_all(&mut *conn).await?;
                let mut deltas = Deltas::default();
                for key in &due {
                    deltas.move_job(key.with_status(JobStatus::Backoff), *key);
                }
                deltas.apply(conn).await?;
                Ok(due.len() as u64)
            })
        })
        .await
    }

    /// Returns the open work up to a stage, among some pairs or all. Among all pairs, `ready` is at most 1000.
    ///
    /// # Errors
    /// If the database returns an error.
    pub async fn outstanding(
        &self,
        until: Stage,
        among: Option<&PairSelection>,
    ) -> Result<Outstanding> {
        let mut conn = self.read_conn().await?;
        let query = match among {
            None => sqlx::query_as(LEFT_ALL).bind(cursor(until)),
            Some(among) => sqlx::query_as(LEFT_AMONG)
                .bind(cursor(until))
                .bind(&among.json),
        };
        Ok(query.fetch_one(&mut *conn).await?)
    }

    /// Returns the open stages up to a stage. They are read from the counters, or, if pairs are given, counted from the
    /// jobs of these pairs.
    ///
    /// # Errors
    /// If the database returns an error.
    pub async fn work_left(&self, until: Stage, among: Option<&PairSelection>) -> Result<WorkLeft> {
        let mut conn = self.read_conn().await?;
        let query = match among {
            None => sqlx::query_as(COUNT_ALL),
            Some(among) => sqlx::query_as(COUNT_AMONG).bind(&among.json),
        };
        let counted: Vec<(Cursor, JobStatus, u64)> = query.fetch_all(&mut *conn).await?;
        let mut left = WorkLeft::default();
        for (at, status, n) in counted {
            if status == JobStatus::Quarantined {
                left.quarantined += n;
            } else if at <= cursor(until) {
                left.pairs += n;
                for open in &mut left.by_stage[at as usize..=until.index()] {
                    *open += n;
                }
            }
        }
        Ok(left)
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
