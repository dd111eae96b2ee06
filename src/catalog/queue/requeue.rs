//! Requeues pairs: after a change of settings or inputs, or on request.

use std::collections::BTreeMap;

use serde_json::json;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::counters::{CounterKey, Deltas};
use crate::catalog::queue::fingerprint::{FingerprintChains, Fingerprints, current_json};
use crate::catalog::queue::fragments::fingerprint_before;
use crate::catalog::queue::selection::{PairSelection, select};
use crate::catalog::queue::staleness::{
    PAGE, RerunPolicy, StaleCause, StaleJob, clear_dirty, decide, groups, inspect, inspect_marked,
};
use crate::domain::{FailureClass, JobStatus, PairName, Stage};

/// Which failed pairs to requeue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RetrySelection {
    /// These pairs, if they failed or back off.
    Names(Vec<PairName>),
    /// All that failed or back off with this class.
    Class(FailureClass),
    /// All that failed or back off.
    All,
}

/// Sends jobs back to a stage as if newly imported, unless they are leased.
pub(crate) const REQUEUE: &str = concat!(
    "
UPDATE job SET stage = item.value ->> 1, status = 0, run_at = NULL, prio = 0, attempt = 0, crashes = 0,
    exclusive = 0, fingerprint = ",
    fingerprint_before!("(item.value ->> 1)"),
    "
FROM json_each(?1) AS item WHERE job.pair = item.value ->> 0 AND job.status <> 1
RETURNING pair, stage, fingerprint"
);

/// Unmarked jobs of a group, in pages by pair.
pub(crate) const MEMBERS: &str = "
SELECT pair FROM job WHERE pair > ?1 AND stage = ?2 AND status = ?3 AND fingerprint IS ?4 AND dirty = 0
ORDER BY pair LIMIT ?5";

const CLEAR_FAILURES: &str =
    "DELETE FROM failure WHERE pair IN (SELECT value ->> 0 FROM json_each(?1))";

const KEPT_BACK: &str = "
SELECT j.pair, j.stage, j.status, coalesce(j.fingerprint, 0) AS fingerprint FROM job AS j JOIN failure AS f ON f.pair = j.pair
WHERE j.status IN (2, 4) AND (?1 IS NULL OR f.class = ?1)";

const KEPT_BACK_AMONG: &str = "
SELECT j.pair, j.stage, j.status, coalesce(j.fingerprint, 0) AS fingerprint FROM json_each(?1) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
WHERE j.status IN (2, 4)";

/// A job that goes back to a stage.
struct RequeuedJob {
    pair: i64,
    from: CounterKey,
    to: Stage,
}

impl Catalog {
    /// Requeues pairs whose settings or inputs changed and pairs selected by the policy; returns how many.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn requeue_stale(
        &self,
        fingerprints: &Fingerprints,
        among: Option<&PairSelection>,
        policy: RerunPolicy,
    ) -> Result<u64> {
        let Some(among) = among else {
            return self.requeue_all_stale(fingerprints, policy).await;
        };
        let mut requeued = 0;
        let mut after = Some(0);
        while let Some(from) = after {
            let (fingerprints, among) = (fingerprints.clone(), among.clone());
            let (moved, next) = self
                .in_transaction(move |conn| {
                    Box::pin(async move {
                        let current = current_json(conn, &fingerprints).await?;
                        let jobs = inspect(conn, &current, from, &among).await?;
                        let moved = requeue(conn, &requeued_jobs(&jobs, policy)).await?;
                        Ok((moved, jobs.last().map(|(pair, _)| *pair)))
                    })
                })
                .await?;
            requeued += moved;
            after = next;
        }
        Ok(requeued)
    }

    /// Unmarked jobs go back by group; only marked ones are inspected. Each page is a separate transaction, so that
    /// other writes do not wait.
    async fn requeue_all_stale(
        &self,
        fingerprints: &Fingerprints,
        policy: RerunPolicy,
    ) -> Result<u64> {
        let (current, groups) = {
            let mut conn = self.snapshot().await?;
            let current = current_json(&mut conn, fingerprints).await?;
            let chains = FingerprintChains::load(&mut conn, fingerprints).await?;
            let groups = groups(&mut conn, &chains).await?;
            assert_complete(&mut conn, &groups).await?;
            (current, groups)
        };
        let mut requeued = 0;
        for (group, _) in groups {
            // Marked jobs, and so all quarantined ones, are inspected below.
            let is_marked = group.key.status == JobStatus::Quarantined;
            let Some(to) = target(&group, policy).filter(|_| !is_marked) else {
                continue;
            };
            let mut after = Some(0);
            while let Some(from) = after {
                let (moved, next) = self
                    .in_transaction(move |conn| Box::pin(requeue_group(conn, group.key, to, from)))
                    .await?;
                requeued += moved;
                after = next;
            }
        }
        let mut after = Some(0);
        while let Some(from) = after {
            let current = current.clone();
            let (moved, next) = self
                .in_transaction(move |conn| Box::pin(requeue_marked(conn, current, policy, from)))
                .await?;
            requeued += moved;
            after = next;
        }
        Ok(requeued)
    }

    /// Requeues failed pairs; returns how many. Pairs that did not fail do not change.
    ///
    /// # Errors
    /// When a named pair is not there; then nothing changes.
    pub async fn retry(&self, selection: &RetrySelection) -> Result<u64> {
        let selection = selection.clone();
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let found = kept_back(conn, &selection).await?;
                requeue(conn, &found).await
            })
        })
        .await
    }
}

/// Refuses groups that do not cover all jobs: a wrong counter would hide stale ones.
async fn assert_complete(conn: &mut SqliteConnection, groups: &[(StaleJob, u64)]) -> Result<()> {
    let jobs: i64 = sqlx::query_scalar("SELECT count(*) FROM job")
        .fetch_one(conn)
        .await?;
    let (jobs, counted) = (jobs.unsigned_abs(), groups.iter().map(|(_, n)| n).sum());
    if counted == jobs {
        Ok(())
    } else {
        Err(CatalogError::WrongCounters { counted, jobs })
    }
}

/// Returns where a job goes back to; `None` when it stays or is going to run anyway.
fn target(job: &StaleJob, policy: RerunPolicy) -> Option<Stage> {
    let (to, cause) = decide(job, policy)?;
    let waits = matches!(
        cause,
        StaleCause::New | StaleCause::Unfinished | StaleCause::BackingOff
    );
    (!waits).then_some(to)
}

fn requeued_jobs(jobs: &[(i64, StaleJob)], policy: RerunPolicy) -> Vec<RequeuedJob> {
    let requeued = jobs.iter().filter_map(|(pair, job)| {
        Some(RequeuedJob {
            pair: *pair,
            from: job.key,
            to: target(job, policy)?,
        })
    });
    requeued.collect()
}

/// Requeues one page of a group; returns how many, and the last pair of the page.
async fn requeue_group(
    conn: &mut SqliteConnection,
    from: CounterKey,
    to: Stage,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let pairs: Vec<i64> = sqlx::query_scalar(MEMBERS)
        .bind(after)
        .bind(from.cursor)
        .bind(from.status.code())
        .bind((from.fingerprint != 0).then_some(from.fingerprint))
        .bind(PAGE as i64)
        .fetch_all(&mut *conn)
        .await?;
    let jobs = pairs.iter().map(|pair| RequeuedJob {
        pair: *pair,
        from,
        to,
    });
    let moved = requeue(conn, &jobs.collect::<Vec<_>>()).await?;
    Ok((moved, pairs.last().copied()))
}

/// Requeues one page of the marked jobs, and unmarks those whose results agree again.
async fn requeue_marked(
    conn: &mut SqliteConnection,
    current: String,
    policy: RerunPolicy,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let Some((jobs, last)) = inspect_marked(conn, &current, after).await? else {
        return Ok((0, None));
    };
    let moved = requeue(conn, &requeued_jobs(&jobs, policy)).await?;
    clear_dirty(conn, after, last).await?;
    Ok((moved, Some(last)))
}

async fn kept_back(
    conn: &mut SqliteConnection,
    selection: &RetrySelection,
) -> Result<Vec<RequeuedJob>> {
    let found = match selection {
        RetrySelection::All => {
            sqlx::query(KEPT_BACK)
                .bind(None::<&str>)
                .fetch_all(conn)
                .await?
        }
        RetrySelection::Class(class) => {
            sqlx::query(KEPT_BACK)
                .bind(class.name())
                .fetch_all(conn)
                .await?
        }
        RetrySelection::Names(names) => {
            for name in names {
                if select(conn, std::slice::from_ref(name)).await?.is_empty() {
                    return Err(CatalogError::UnknownPair(name.clone()));
                }
            }
            let among = select(conn, names).await?;
            sqlx::query(KEPT_BACK_AMONG)
                .bind(among.json)
                .fetch_all(conn)
                .await?
        }
    };
    found
        .iter()
        .map(|row| {
            let at: i64 = row.try_get("stage")?;
            Ok(RequeuedJob {
                pair: row.try_get("pair")?,
                from: CounterKey {
                    cursor: at,
                    status: rows::status(row.try_get("status")?)?,
                    fingerprint: row.try_get("fingerprint")?,
                },
                to: rows::stage(at)?,
            })
        })
        .collect()
}

async fn requeue(conn: &mut SqliteConnection, jobs: &[RequeuedJob]) -> Result<u64> {
    if jobs.is_empty() {
        return Ok(0);
    }
    let items = jobs.iter().map(|job| json!([job.pair, job.to.index()]));
    let items = rows::array(items).to_string();
    let moved: Vec<(i64, i64, Option<i64>)> = sqlx::query_as(REQUEUE)
        .bind(&items)
        .fetch_all(&mut *conn)
        .await?;
    sqlx::query(CLEAR_FAILURES)
        .bind(&items)
        .execute(&mut *conn)
        .await?;
    let from: BTreeMap<i64, CounterKey> = jobs.iter().map(|job| (job.pair, job.from)).collect();
    let mut deltas = Deltas::default();
    for (pair, cursor, fingerprint) in &moved {
        if let Some(from) = from.get(pair) {
            let to = CounterKey::new(*cursor, JobStatus::Ready, *fingerprint);
            deltas.move_job(*from, to);
        }
    }
    deltas.apply(conn).await?;
    Ok(moved.len() as u64)
}
