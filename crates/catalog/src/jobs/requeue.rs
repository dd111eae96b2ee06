//! Requeues pairs after changes of settings or inputs, or on request.

use std::collections::BTreeMap;

use serde_json::json;

use crate::db::conn::{Conn, Work};
use crate::db::query::{query, query_as, query_scalar};
use crate::db::rows::json_array;
use crate::jobs::fingerprint::{FingerprintChains, Fingerprints, current_json};
use crate::jobs::plan::StaleReason;
use crate::jobs::staleness::{
    PAGE, RerunPolicy, StaleJob, clear_dirty, decide, groups, inspect, inspect_marked,
};
use crate::queue::counters::{CounterKey, Cursor, Deltas, KeyedJob, cursor};
use crate::queue::kind::{JobKind, StoredKind, Template};
use crate::queue::lease::SEND_BACK;
use crate::queue::pair_job::PairJob;
use crate::queue::selection::{PairSelection, unknown_names};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{FailureClass, JobStatus, Stage};

/// Which failed pairs or blocks to requeue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RetrySelection<K: JobKind = PairJob> {
    /// These, if they failed or back off.
    Names(Vec<K::Name>),
    /// All that failed or back off with this class.
    Class(FailureClass),
    /// All that failed or back off.
    All,
}

/// Resets jobs to a stage, with no attempts or crashes. Skips leased jobs.
pub(crate) static REQUEUE: Template = Template::new(
    "
UPDATE {job} SET stage = [1], status = 0, run_at = NULL, attempt = 0, crashes = 0{and_requeue}
FROM json_each(?1) AS item WHERE {job}.{unit} = [0] AND {job}.status <> 1
RETURNING {unit} AS unit, stage, status, coalesce({fingerprint}, 0) AS fingerprint",
);

/// Adds the jobs that are missing. Retired pairs get none.
static NEW_JOBS: Template = Template::new(
    "
INSERT INTO {job} ({unit}, stage, status)
SELECT [0], 0, 0 FROM json_each(?1) AS item WHERE NOT EXISTS (SELECT 1 FROM {job} WHERE {unit} = [0]){and_not_retired}",
);

/// Selects jobs, and locks them in PostgreSQL, always in the order of ids.
static LOCK_JOBS: Template = Template::new(
    "
SELECT {unit} AS unit, stage, status, coalesce({fingerprint}, 0) AS fingerprint FROM {job}
WHERE {unit} IN (SELECT CAST(atom AS bigint) FROM json_each(?1)) ORDER BY {unit} FOR UPDATE",
);

/// Selects one page of the clean jobs with one stage, status and fingerprint, sorted by pair.
pub(crate) const MEMBERS: &str = "
SELECT pair FROM job WHERE pair > ?1 AND stage = ?2 AND status = ?3 AND fingerprint IS NOT DISTINCT FROM ?4 AND dirty = 0
ORDER BY pair LIMIT ?5";

static CLEAR_FAILURES: Template =
    Template::new("DELETE FROM {failure} WHERE {unit} IN (SELECT [0] FROM json_each(?1) AS item)");

/// Selects the jobs that failed or back off, of one failure class or of all.
static FAILED_JOBS: Template = Template::new(
    "
SELECT j.{unit} AS unit, j.stage, j.status, coalesce({fingerprint}, 0) AS fingerprint FROM {job} AS j
WHERE j.status IN (2, 4)
    AND (?1 IS NULL OR EXISTS (SELECT 1 FROM {failure} AS f WHERE f.{unit} = j.{unit} AND f.class = ?1))",
);

static FAILED_NAMED: Template = Template::new(
    "
SELECT j.{unit} AS unit, j.stage, j.status, coalesce({fingerprint}, 0) AS fingerprint
FROM {unit} AS named CROSS JOIN {job} AS j ON j.{unit} = named.id
WHERE named.name IN (SELECT atom FROM json_each(?1)) AND j.status IN (2, 4) ORDER BY j.{unit}",
);

impl Catalog {
    /// Requeues pairs whose settings or inputs changed, and pairs that `policy` selects. If `selection` is given, considers
    /// only its pairs. Returns the number of requeued pairs.
    ///
    /// # Errors
    /// Returns an error if the counters do not add up to the number of jobs, or if a database operation fails.
    pub async fn requeue_stale(
        &self,
        fingerprints: &Fingerprints,
        selection: Option<&PairSelection>,
        policy: RerunPolicy,
    ) -> Result<u64> {
        let mut conn = self.snapshot().await?;
        let current = current_json(&mut conn, fingerprints).await?;
        let mut moves = Vec::new();
        if selection.is_none() {
            // Jobs without the dirty mark are requeued in groups. Dirty and quarantined jobs are inspected below.
            let chains = FingerprintChains::load(&mut conn, fingerprints).await?;
            let groups = groups(&mut conn, &chains).await?;
            assert_complete(&mut conn, &groups).await?;
            let unmarked = groups.iter().map(|(group, _)| group);
            let unmarked = unmarked.filter(|group| group.key.status != JobStatus::Quarantined);
            moves.extend(unmarked.filter_map(|group| Some((group.key, target(group, policy)?))));
        }
        drop(conn);
        let mut requeued = 0;
        for (key, to) in moves {
            requeued += self
                .requeue_pages(move |conn, after| Box::pin(requeue_group(conn, key, to, after)))
                .await?;
        }
        let selection = selection.cloned();
        requeued += self
            .requeue_pages(move |conn, after| {
                let (current, selection) = (current.clone(), selection.clone());
                Box::pin(requeue_inspected(conn, current, selection, policy, after))
            })
            .await?;
        Ok(requeued)
    }

    /// Requeues jobs page by page, and returns their number. Each page is a separate transaction, so that other writes
    /// can run in between. `page` requeues the pairs after a given pair, and returns the number of jobs and the last
    /// pair of the page.
    async fn requeue_pages<F>(&self, page: F) -> Result<u64>
    where
        F: for<'c> Fn(&'c mut Conn, i64) -> Work<'c, Result<(u64, Option<i64>)>>
            + Clone
            + Send
            + 'static,
    {
        let (mut requeued, mut after) = (0, Some(0));
        while let Some(from) = after {
            let page = page.clone();
            let moved;
            (moved, after) = self.in_transaction(move |conn| page(conn, from)).await?;
            requeued += moved;
        }
        Ok(requeued)
    }
}

/// Requeues the selected pairs that failed or back off, and returns their number.
///
/// # Errors
/// Returns an error if a named pair does not exist, or if a database operation fails.
pub(crate) async fn retry_pairs(conn: &mut Conn, selection: &RetrySelection) -> Result<u64> {
    if let RetrySelection::Names(names) = selection
        && let Some(unknown) = unknown_names(conn, names).await?.into_iter().next()
    {
        return Err(CatalogError::UnknownPair(unknown));
    }
    let mut deltas = Deltas::default();
    let retried = retry(conn, selection, &mut deltas).await?;
    deltas.apply(conn).await?;
    Ok(retried)
}

/// Requeues the selected jobs that failed or back off at the stage that failed, and returns their number. Unknown names are
/// left out.
pub(crate) async fn retry<K: StoredKind>(
    conn: &mut Conn,
    selection: &RetrySelection<K>,
    deltas: &mut Deltas,
) -> Result<u64> {
    let failed = match selection {
        RetrySelection::All => query_as(FAILED_JOBS.of::<K>()).bind(None::<&str>),
        RetrySelection::Class(class) => query_as(FAILED_JOBS.of::<K>()).bind(class.name()),
        RetrySelection::Names(names) => {
            let names = json_array(names.iter().map(K::text));
            query_as(FAILED_NAMED.of::<K>()).bind(names)
        }
    };
    let failed: Vec<KeyedJob> = failed.fetch_all(&mut *conn).await?;
    let same_stage = failed.iter().map(|job| (*job, job.key.cursor));
    requeue::<K>(conn, &same_stage.collect::<Vec<_>>(), deltas).await
}

/// Returns an error unless the groups contain all jobs. A wrong counter could hide stale jobs.
async fn assert_complete(conn: &mut Conn, groups: &[(StaleJob, u64)]) -> Result<()> {
    let jobs: i64 = query_scalar("SELECT count(*) FROM job")
        .fetch_one(conn)
        .await?;
    let (jobs, counted) = (jobs.unsigned_abs(), groups.iter().map(|(_, n)| n).sum());
    if counted == jobs {
        Ok(())
    } else {
        Err(CatalogError::WrongCounters { counted, jobs })
    }
}

/// Returns the stage that a job is requeued at, or `None` if it needs no requeue.
fn target(job: &StaleJob, policy: RerunPolicy) -> Option<Stage> {
    let (to, reason) = decide(job, policy)?;
    let waits = matches!(
        reason,
        StaleReason::New | StaleReason::Unfinished | StaleReason::BackingOff
    );
    (!waits).then_some(to)
}

/// Requeues one page of a group: jobs whose pairs follow `after`. Returns their number, and the last pair of the page.
async fn requeue_group(
    conn: &mut Conn,
    key: CounterKey,
    to: Stage,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let pairs: Vec<i64> = query_scalar(MEMBERS)
        .bind(after)
        .bind(key.cursor)
        .bind(key.status.code())
        .bind((key.fingerprint != 0).then_some(key.fingerprint))
        .bind(PAGE as i64)
        .fetch_all(&mut *conn)
        .await?;
    let jobs = pairs
        .iter()
        .map(|pair| (KeyedJob { unit: *pair, key }, cursor(to)));
    let moved = requeue_counted(conn, &jobs.collect::<Vec<_>>()).await?;
    Ok((moved, pairs.last().copied()))
}

/// Inspects one page of jobs whose pairs follow `after`, and requeues the stale ones. Returns their number, and the
/// last pair of the page. If `selection` is `None`, inspects dirty and quarantined jobs, and unmarks jobs that are
/// consistent again.
async fn requeue_inspected(
    conn: &mut Conn,
    current: String,
    selection: Option<PairSelection>,
    policy: RerunPolicy,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let (jobs, last) = match &selection {
        None => inspect_marked(conn, &current, after).await?,
        Some(selection) => {
            let jobs = inspect(conn, &current, after, selection).await?;
            let last = jobs.last().map(|(pair, _)| *pair);
            (jobs, last)
        }
    };
    let stale = jobs.into_iter().filter_map(|(pair, job)| {
        let to = target(&job, policy)?;
        let key = job.key;
        Some((KeyedJob { unit: pair, key }, cursor(to)))
    });
    let moved = requeue_counted(conn, &stale.collect::<Vec<_>>()).await?;
    if let (None, Some(last)) = (selection, last) {
        clear_dirty(conn, after, last).await?;
    }
    Ok((moved, last))
}

/// Returns the jobs whose key is still the given one, and locks them until the end of the transaction. In SQLite, no job
/// changes during a transaction.
async fn unchanged<K: StoredKind>(
    conn: &mut Conn,
    jobs: &[(KeyedJob, Cursor)],
) -> Result<Vec<(KeyedJob, Cursor)>> {
    if matches!(conn, Conn::Sqlite(_)) {
        return Ok(jobs.to_vec());
    }
    let units = json_array(jobs.iter().map(|(job, _)| job.unit));
    let locked = query_as(LOCK_JOBS.of::<K>()).bind(units);
    let locked: Vec<KeyedJob> = locked.fetch_all(conn).await?;
    let locked: BTreeMap<i64, CounterKey> = locked.iter().map(|job| (job.unit, job.key)).collect();
    let mut unchanged = jobs.to_vec();
    unchanged.retain(|(job, _)| locked.get(&job.unit) == Some(&job.key));
    Ok(unchanged)
}

/// Requeues jobs of pairs, and counts them.
async fn requeue_counted(conn: &mut Conn, jobs: &[(KeyedJob, Cursor)]) -> Result<u64> {
    let mut deltas = Deltas::default();
    let moved = requeue::<PairJob>(conn, jobs, &mut deltas).await?;
    deltas.apply(conn).await?;
    Ok(moved)
}

/// Resets each job to the given stage, except leased jobs. Returns the number of changed jobs.
pub(crate) async fn requeue<K: StoredKind>(
    conn: &mut Conn,
    jobs: &[(KeyedJob, Cursor)],
    deltas: &mut Deltas,
) -> Result<u64> {
    if jobs.is_empty() {
        return Ok(0);
    }
    let unchanged = unchanged::<K>(conn, jobs).await?;
    let items = json_array(unchanged.iter().map(|(job, to)| json!([job.unit, to])));
    let moved = query_as(REQUEUE.of::<K>()).bind(&items);
    let moved: Vec<KeyedJob> = moved.fetch_all(&mut *conn).await?;
    let clear = query(CLEAR_FAILURES.of::<K>()).bind(&items);
    clear.execute(conn).await?;
    let from: BTreeMap<i64, CounterKey> = jobs.iter().map(|(job, _)| (job.unit, job.key)).collect();
    for job in &moved {
        if let Some(from) = from.get(&job.unit) {
            deltas.move_job(*from, job.key);
        }
    }
    Ok(moved.len() as u64)
}

/// Sends jobs back to a stage, never forward, and ends their leases. Adds missing jobs, except for retired pairs, and removes
/// the failures.
pub(crate) async fn send_back<K: StoredKind>(
    conn: &mut Conn,
    jobs: impl Iterator<Item = (K::Unit, K::Stage)> + Clone,
    deltas: &mut Deltas,
) -> Result<()> {
    let units = json_array(jobs.clone().map(|(unit, _)| K::id(unit)));
    let items = json_array(jobs.map(|(unit, to)| json!([K::id(unit), K::index(to)])));
    let before = query_as(LOCK_JOBS.of::<K>()).bind(units);
    let before: Vec<KeyedJob> = before.fetch_all(&mut *conn).await?;
    query(NEW_JOBS.of::<K>()).bind(&items).execute(conn).await?;
    let after = query_as(SEND_BACK.of::<K>()).bind(&items);
    let after: Vec<KeyedJob> = after.fetch_all(&mut *conn).await?;
    let clear = query(CLEAR_FAILURES.of::<K>()).bind(&items);
    clear.execute(conn).await?;
    for job in before {
        deltas.add(job.key, -1);
    }
    for job in after {
        deltas.add(job.key, 1);
    }
    Ok(())
}
