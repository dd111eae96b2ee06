//! The counts of the whole project.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::db::query::{query_as, query_scalar};
use crate::jobs::fingerprint::{Fingerprints, current_json};
use crate::jobs::retired::RETIRED_COUNT;
use crate::jobs::staleness::count_stale;
use crate::queue::counters::{JobCounts, by_status, counters};
use crate::records::model::{StageCounts, StatusCounts};
use crate::records::reviewer_names::Spellings;
use crate::{Catalog, Result};
use mocban_core::domain::{JobStatus, Stage, Verdict};

/// Returns the name of the reviewer of a verdict in its one spelling.
macro_rules! person {
    ($verdict:literal) => {
        concat!(
            "coalesce((SELECT value ->> 1 FROM json_each(?1) WHERE value ->> 0 = ",
            $verdict,
            ".reviewer), ",
            $verdict,
            ".reviewer)"
        )
    };
}

/// Returns the condition that nobody has undone a verdict or set it apart.
macro_rules! in_force {
    ($verdict:literal) => {
        concat!(
            "NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = ",
            $verdict,
            ".act)
        AND ",
            $verdict,
            ".id NOT IN (SELECT s.row FROM set_apart AS s WHERE s.record = 2)"
        )
    };
}

/// Returns the condition that a verdict `v` is the newest one in force of its reviewer on a metric of a pair, among the
/// verdicts `n` with a further condition. `?1` has the stored spellings of names that are not the spelling of the name.
macro_rules! newest_verdict {
    ($condition:literal) => {
        concat!(
            "v.id = (
    SELECT max(n.id) FROM verdict AS n
    WHERE n.pair = v.pair AND n.metric = v.metric AND ",
            $crate::records::status::person!("n"),
            " = ",
            $crate::records::status::person!("v"),
            $condition,
            "
        AND ",
            $crate::records::status::in_force!("n"),
            ")"
        )
    };
}

/// Selects verdicts `v` on current results of pairs that are done, as a report counts them. Only the newest verdict of each
/// reviewer on a result counts. Leaves out the verdicts that the owner has set apart; damaged ones that nobody knows of yet are
/// found by a check or a report. `?1` is as in `newest_verdict`.
macro_rules! from_current_verdicts {
    () => {
        concat!(
            "FROM verdict AS v
    JOIN metric_result AS m ON m.pair = v.pair AND m.metric = v.metric AND m.result_hash = v.result_hash
WHERE ",
            $crate::records::status::newest_verdict!(" AND n.result_hash = v.result_hash"),
            "
    AND EXISTS (SELECT 1 FROM job AS done WHERE done.pair = v.pair AND done.status = 3)"
        )
    };
}
pub(crate) use {from_current_verdicts, in_force, newest_verdict, person};

/// Counts verdicts on current results.
const VERDICTS: &str = concat!(
    "
SELECT v.verdict, count(*) ",
    from_current_verdicts!(),
    "
GROUP BY v.verdict"
);

/// Counts verdicts on pairs that wait or run, whose results are not known yet. Only the newest verdict of each reviewer on a metric
/// counts.
const WAITING_VERDICTS: &str = concat!(
    "
SELECT count(*) FROM job AS j JOIN verdict AS v ON v.pair = j.pair
WHERE j.status < 3 AND ",
    newest_verdict!("")
);

/// Completed pairs whose result of the default metric has a low confidence.
pub(crate) const LOW_CONFIDENCE: &str =
    "SELECT count(*) FROM job WHERE low_confidence = 1 AND status = 3";

/// Completed pairs of which an import changed the path of a file, which no run has read since.
pub(crate) const OTHER_FILES: &str = "
SELECT count(*) FROM job AS j CROSS JOIN pair AS p ON p.id = j.pair
WHERE j.dirty = 1 AND j.status = 3 AND (p.mesh_stat = '' OR p.print_stat = '')";

impl Catalog {
    /// Returns the number of verdicts on pairs that wait or run. They count again once the same results are there.
    pub async fn waiting_verdicts(&self) -> Result<u64> {
        let mut conn = self.read_conn().await?;
        let renamed = Spellings::read(&mut conn).await?.renamed();
        let waiting = query_scalar(WAITING_VERDICTS).bind(renamed);
        waiting.fetch_one(&mut conn).await
    }

    /// Returns the counts of the `status` command. Results count as stale if their fingerprint is not among
    /// `fingerprints`, or if their inputs have changed.
    pub async fn status(&self, fingerprints: &Fingerprints) -> Result<StatusCounts> {
        let mut conn = self.snapshot().await?;
        let counted = by_status(counters(&mut conn).await?);
        let current = current_json(&mut conn, fingerprints).await?;
        Ok(StatusCounts {
            schema: 1,
            pairs: counted.values().sum(),
            retired: query_scalar(RETIRED_COUNT).fetch_one(&mut conn).await?,
            jobs: jobs_by_status(&counted),
            stages: by_stage(&counted),
            stale: count_stale(&mut conn, &current).await?,
            other_files: query_scalar(OTHER_FILES).fetch_one(&mut conn).await?,
            low_confidence: query_scalar(LOW_CONFIDENCE).fetch_one(&mut conn).await?,
            verdicts: verdicts(&mut conn).await?,
        })
    }
}

/// Adds up the numbers of jobs by status. Statuses without jobs are included.
fn jobs_by_status(counts: &JobCounts) -> BTreeMap<JobStatus, u64> {
    let mut jobs: BTreeMap<_, _> = JobStatus::ALL.map(|status| (status, 0)).into();
    for ((_, status), n) in counts {
        *jobs.entry(*status).or_default() += n;
    }
    jobs
}

/// Counts the done, pending and failed pairs of each stage. A pair that failed is pending at the later stages.
fn by_stage(counted: &JobCounts) -> BTreeMap<Stage, StageCounts> {
    let mut stages: BTreeMap<_, _> = Stage::ALL
        .map(|stage| (stage, StageCounts::default()))
        .into();
    for ((cursor, status), n) in counted {
        for (stage, count) in &mut stages {
            let index = stage.index() as i64;
            if *cursor > index {
                count.done += n;
            } else if *cursor == index && *status == JobStatus::Quarantined {
                count.failed += n;
            } else {
                count.pending += n;
            }
        }
    }
    stages
}

async fn verdicts(conn: &mut Conn) -> Result<BTreeMap<Verdict, u64>> {
    let mut counts: BTreeMap<_, _> = Verdict::ALL.map(|verdict| (verdict, 0)).into();
    let renamed = Spellings::read(conn).await?.renamed();
    let found: Vec<(Verdict, u64)> = query_as(VERDICTS).bind(renamed).fetch_all(conn).await?;
    counts.extend(found);
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::by_stage;
    use crate::StageCounts;
    use mocban_core::domain::{JobStatus, Stage};

    #[test]
    fn every_pair_is_counted_once_at_every_stage() {
        let counted = [
            ((0, JobStatus::Ready), 5),
            ((2, JobStatus::Quarantined), 3),
            ((4, JobStatus::Done), 7),
        ];
        let stages = by_stage(&counted.into_iter().collect());
        for count in stages.values() {
            assert_eq!(count.done + count.pending + count.failed, 15);
        }
        let expected = StageCounts {
            done: 7,
            pending: 5,
            failed: 3,
        };
        assert_eq!(stages[&Stage::Normalize], expected);
    }
}
