//! Finds the pairs that must run again because their settings or inputs changed, and the reasons.
//!
//! A job stores the fingerprint of the result before its cursor. The fingerprint covers the settings of that stage and
//! of all earlier stages. Therefore one comparison of fingerprints decides for many jobs.
//!
//! Jobs with the `dirty` mark or in quarantine are inspected one by one. The results of a dirty job may disagree with
//! each other or with the inputs. A quarantined job's failure stores the settings and inputs of the failed stage.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::{query, query_scalar};
use crate::db::row::{FromRow as _, Row};
use crate::jobs::fingerprint::FingerprintChains;
use crate::jobs::plan::StaleReason;
use crate::queue::counters::{CounterKey, Cursor, counters};
use crate::queue::fragments::inconsistent;
use crate::queue::selection::PairSelection;
use mocban_core::domain::{JobStatus, PairId, Stage};

/// Jobs inspected in one statement.
pub(crate) const PAGE: usize = 10_000;

/// Which pairs to run again besides the stale ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RerunPolicy {
    /// None.
    Changed,
    /// Pairs that failed.
    Failed,
    /// Every pair, from this stage on.
    All(Stage),
}

/// Selects the hash of an input file of the pair `p` with the job `j`, which the stages `$readers` read. `NULL` while the
/// file is missing and one of these stages is next: the stage cannot run, so the stored results count as unchanged.
macro_rules! input_hash {
    ($file:literal, $readers:literal) => {
        concat!(
            "CASE WHEN j.stage IN (",
            $readers,
            ") AND p.",
            $file,
            "_stat = 'gone' THEN NULL ELSE p.",
            $file,
            "_hash END"
        )
    };
}

/// Returns the hash of the mesh, which `fit` and `depth` read.
macro_rules! mesh_hash {
    () => {
        input_hash!("mesh", "0, 1")
    };
}

/// Returns the hash of the print, which `fit` and `normalize` read.
macro_rules! print_hash {
    () => {
        input_hash!("print", "0, 2")
    };
}

/// Returns whether a result `r` differs from the current settings in `?1` or from the pair's inputs.
macro_rules! is_outdated {
    () => {
        concat!(
            "(
            r.fingerprint <> CAST(?1 ->> r.stage AS bigint) OR r.attributes <> p.attributes OR r.mesh_hash <> ",
            mesh_hash!(),
            " OR r.print_hash <> ",
            print_hash!(),
            ")"
        )
    };
}

/// Selects jobs, each with its first outdated result. A result is outdated if its settings or inputs have changed.
pub(crate) const INSPECT: &str = concat!(
    "
WITH found AS (
    SELECT j.pair, j.stage, j.status, j.fingerprint, p.attributes, ",
    mesh_hash!(),
    " AS mesh_hash, ",
    print_hash!(),
    " AS print_hash, (
        SELECT min(r.stage) FROM stage_result AS r WHERE r.pair = j.pair AND r.stage < j.stage AND ",
    is_outdated!(),
    ") AS first
    FROM (SELECT atom FROM json_each(?4)) AS wanted CROSS JOIN job AS j ON j.pair = CAST(wanted.atom AS bigint)
        JOIN pair AS p ON p.id = j.pair WHERE j.pair > ?2 ORDER BY j.pair LIMIT ?3)
SELECT found.pair, found.stage, found.status, coalesce(found.fingerprint, 0) AS fingerprint, found.first, r.fingerprint AS old,
    coalesce(r.mesh_hash <> found.mesh_hash, false) AS mesh, coalesce(r.print_hash <> found.print_hash, false) AS print,
    coalesce(r.attributes <> found.attributes, false) AS attributes,
    coalesce(f.fingerprint <> CAST(?1 ->> f.stage AS bigint), false) OR coalesce(f.mesh_hash <> found.mesh_hash, false)
        OR coalesce(f.print_hash <> found.print_hash, false) OR coalesce(f.attributes <> found.attributes, false)
        AS failure_is_outdated
FROM found LEFT JOIN stage_result AS r ON r.pair = found.pair AND r.stage = found.first
    LEFT JOIN failure AS f ON f.pair = found.pair ORDER BY found.pair"
);

/// Selects one page of the dirty and quarantined jobs, sorted by pair.
pub(crate) const MARKED: &str = "
SELECT pair FROM job WHERE dirty = 1 AND pair > ?1 UNION SELECT pair FROM job WHERE status = 4 AND pair > ?1
ORDER BY 1 LIMIT ?2";

/// Counts the pairs that have a result with outdated settings or inputs.
pub(crate) const COUNT_STALE: &str = concat!(
    "
SELECT (SELECT coalesce(CAST(sum(n) AS bigint), 0) FROM counter
        WHERE fingerprint <> 0 AND fingerprint NOT IN (SELECT CAST(atom AS bigint) FROM json_each(?1))) + (
    SELECT count(*) FROM job AS j CROSS JOIN pair AS p ON p.id = j.pair
    WHERE j.dirty = 1 AND (j.fingerprint IS NULL OR j.fingerprint IN (SELECT CAST(atom AS bigint) FROM json_each(?1))) AND EXISTS (
        SELECT 1 FROM stage_result AS r WHERE r.pair = j.pair AND r.stage < j.stage AND ",
    is_outdated!(),
    "))"
);

/// Unmarks dirty jobs whose results are consistent again. Skips leased jobs, which may still get inconsistent results.
pub(crate) const CLEAR_DIRTY: &str = concat!(
    "
UPDATE job SET dirty = 0 WHERE dirty = 1 AND pair > ?1 AND pair <= ?2 AND status <> 1 AND NOT EXISTS (
    ",
    inconsistent!(),
    ")"
);

/// A job or a group of equal jobs, and what changed since the results were computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StaleJob {
    pub(crate) key: CounterKey,
    /// First stage with an outdated result, and what changed.
    pub(crate) change: Option<(Stage, StaleReason)>,
    /// Whether settings or inputs changed since the job failed.
    pub(crate) failure_is_outdated: bool,
}

/// Returns the first stage that a job must run, and why. Returns `None` if the job is leased or need not run.
pub(crate) fn decide(job: &StaleJob, policy: RerunPolicy) -> Option<(Stage, StaleReason)> {
    let CounterKey { cursor, status, .. } = job.key;
    let next = job.key.stage();
    if status == JobStatus::Leased {
        return None;
    }
    let requested = match policy {
        RerunPolicy::All(from) => {
            let start = next.map_or(from, |next| next.min(from));
            Some((start, StaleReason::Requested))
        }
        RerunPolicy::Failed if status == JobStatus::Quarantined => {
            next.map(|at| (at, StaleReason::Requested))
        }
        RerunPolicy::Failed | RerunPolicy::Changed => None,
    };
    // Use the earlier stage. If both stages are equal, report the change, which explains more than the request.
    match (job.change, requested) {
        (Some(changed), Some(requested)) if requested.0 < changed.0 => return Some(requested),
        (Some(changed), _) => return Some(changed),
        (None, Some(requested)) => return Some(requested),
        (None, None) => {}
    }
    let cause = match status {
        JobStatus::Ready if cursor == 0 => StaleReason::New,
        JobStatus::Ready => StaleReason::Unfinished,
        JobStatus::Backoff => StaleReason::BackingOff,
        JobStatus::Quarantined if job.failure_is_outdated => StaleReason::FailedBefore,
        JobStatus::Quarantined | JobStatus::Done | JobStatus::Leased => return None,
    };
    next.map(|at| (at, cause))
}

/// Inspects one page of selected jobs whose pairs follow `after`. Returns each job with its pair.
pub(crate) async fn inspect(
    conn: &mut Conn,
    current: &str,
    after: i64,
    selection: &PairSelection,
) -> Result<Vec<(i64, StaleJob)>> {
    let query = query(INSPECT).bind(current).bind(after);
    let query = query.bind(PAGE as i64).bind(&selection.json);
    query.fetch_all(conn).await?.iter().map(stale_job).collect()
}

fn stale_job(row: &Row) -> Result<(i64, StaleJob)> {
    let change = match row.get("first")? {
        Some(stage) => Some((stage, change(row, stage)?)),
        None => None,
    };
    let job = StaleJob {
        key: CounterKey::from_row(row)?,
        change,
        failure_is_outdated: row.get("failure_is_outdated")?,
    };
    Ok((row.get("pair")?, job))
}

/// Returns why the first outdated result is outdated. Changed inputs take precedence over changed settings.
fn change(row: &Row, stage: Stage) -> Result<StaleReason> {
    Ok(if row.get("mesh")? {
        StaleReason::Mesh
    } else if row.get("print")? {
        StaleReason::Print
    } else if row.get("attributes")? {
        StaleReason::Manifest
    } else {
        let old = row.get("old")?;
        StaleReason::Settings { stage, old }
    })
}

/// Inspects one page of dirty or quarantined jobs after a pair. Also returns the page's last pair, if any.
pub(crate) async fn inspect_marked(
    conn: &mut Conn,
    current: &str,
    after: i64,
) -> Result<(Vec<(i64, StaleJob)>, Option<i64>)> {
    let query = query_scalar(MARKED).bind(after).bind(PAGE as i64);
    let page: Vec<PairId> = query.fetch_all(&mut *conn).await?;
    let Some(last) = page.last() else {
        return Ok((Vec::new(), None));
    };
    let jobs = inspect(conn, current, after, &PairSelection::of(&page)).await?;
    Ok((jobs, Some(last.0)))
}

/// Groups all jobs by counter key, sorted by this key. Returns one state and the number of jobs of each group. The
/// number includes dirty and quarantined jobs, but the state may not apply to them: they are inspected one by one.
///
/// A requeued job moves to an earlier group, or stays in its group. Therefore a pass over the groups, each in the order
/// of pairs, handles each job only once.
pub(crate) async fn groups(
    conn: &mut Conn,
    chains: &FingerprintChains,
) -> Result<Vec<(StaleJob, u64)>> {
    let groups = counters(conn).await?.into_iter().map(|(key, jobs)| {
        let job = StaleJob {
            key,
            change: changed_settings(key, chains),
            failure_is_outdated: false,
        };
        (job, jobs)
    });
    Ok(groups.collect())
}

/// Returns the first stage before the cursor whose settings have changed.
fn changed_settings(key: CounterKey, chains: &FingerprintChains) -> Option<(Stage, StaleReason)> {
    let (stage, old) = chains.first_change(key.fingerprint)?;
    let is_before = (stage.index() as Cursor) < key.cursor;
    is_before.then_some((stage, StaleReason::Settings { stage, old }))
}

/// Passes every job to `each` exactly once, as a state and the number of jobs in that state.
pub(crate) async fn inspect_all(
    conn: &mut Conn,
    current: &str,
    chains: &FingerprintChains,
    mut each: impl FnMut(&StaleJob, u64),
) -> Result<()> {
    let mut marked: BTreeMap<CounterKey, u64> = BTreeMap::new();
    let mut after = Some(0);
    while let Some(from) = after {
        let (page, last) = inspect_marked(conn, current, from).await?;
        for (_, job) in &page {
            *marked.entry(job.key).or_default() += 1;
            each(job, 1);
        }
        after = last;
    }
    for (job, jobs) in groups(conn, chains).await? {
        let marked = marked.get(&job.key).copied().unwrap_or(0);
        let unmarked = jobs.saturating_sub(marked);
        if unmarked > 0 {
            each(&job, unmarked);
        }
    }
    Ok(())
}

/// Counts the pairs that have a result with outdated settings or inputs.
pub(crate) async fn count_stale(conn: &mut Conn, current: &str) -> Result<u64> {
    let query = query_scalar(COUNT_STALE).bind(current);
    query.fetch_one(conn).await
}

/// Unmarks dirty jobs whose results are consistent again, in a range of pairs.
pub(crate) async fn clear_dirty(conn: &mut Conn, after: i64, last: i64) -> Result<()> {
    let query = query(CLEAR_DIRTY).bind(after).bind(last);
    query.execute(conn).await?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{CounterKey, RerunPolicy, StaleJob, StaleReason, decide};
    use mocban_core::domain::{JobStatus, Stage};

    fn job(cursor: i64, status: JobStatus) -> StaleJob {
        StaleJob {
            key: CounterKey {
                cursor,
                status,
                fingerprint: 0,
            },
            change: None,
            failure_is_outdated: false,
        }
    }

    #[test]
    fn a_pair_that_is_done_and_unchanged_stays() {
        let done = job(4, JobStatus::Done);
        assert_eq!(decide(&done, RerunPolicy::Changed), None);
        assert_eq!(decide(&done, RerunPolicy::Failed), None);
        let all = decide(&done, RerunPolicy::All(Stage::Depth));
        assert_eq!(all, Some((Stage::Depth, StaleReason::Requested)));
    }

    #[test]
    fn the_first_changed_stage_is_where_it_starts() {
        let mut print_changed = job(4, JobStatus::Done);
        print_changed.change = Some((Stage::Normalize, StaleReason::Print));
        let found = decide(&print_changed, RerunPolicy::All(Stage::Register));
        assert_eq!(found, Some((Stage::Normalize, StaleReason::Print)));
    }

    #[test]
    fn a_failure_of_other_settings_is_no_failure_of_these() {
        let mut failed = job(1, JobStatus::Quarantined);
        assert_eq!(decide(&failed, RerunPolicy::Changed), None);
        failed.failure_is_outdated = true;
        let found = decide(&failed, RerunPolicy::Changed);
        assert_eq!(found, Some((Stage::Depth, StaleReason::FailedBefore)));
    }
}
