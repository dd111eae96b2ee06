//! What workers register with, due back-offs and open work.

use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::db::transaction::in_transaction;
use crate::jobs::block_settings::BlockSettings;
use crate::jobs::fingerprint::FingerprintIds;
use crate::queue::claim::release_due;
use crate::queue::counters::{Cursor, Deltas, cursor};
use crate::queue::pair_job::PairJob;
use crate::queue::selection::PairSelection;
use crate::{Catalog, Result};
use mocban_core::domain::{JobStatus, Stage, UnixMillis};

/// The process a worker runs in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerInfo {
    /// Host name.
    pub host: String,
    /// Process id.
    pub pid: u32,
    /// Boot id of the machine, if known.
    pub boot_id: Option<String>,
}

/// The settings that a worker uses.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkerSettings {
    /// Fingerprints of the settings of pairs.
    pub fingerprints: FingerprintIds,
    /// Settings of the stages of blocks.
    pub blocks: BlockSettings,
}

/// Numbers of pairs that have a stage to run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Outstanding {
    /// Pairs that are ready.
    pub ready: u64,
    /// Pairs leased by any worker.
    pub leased: u64,
    /// Pairs that back off.
    pub backoff: u64,
    /// Time at which the first back-off ends.
    pub next_due: Option<UnixMillis>,
}

from_row! { Outstanding { ready, leased, backoff, next_due } }

/// Numbers of stages that are still to run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WorkLeft {
    /// Pairs with stages to run, without quarantined pairs.
    pub pairs: u64,
    /// Number of pairs that have yet to run each stage.
    pub by_stage: [u64; Stage::COUNT],
    /// Quarantined pairs.
    pub quarantined: u64,
}

pub(crate) const LEFT_ALL: &str = "
SELECT
    (SELECT count(*) FROM (SELECT 1 FROM job WHERE status = 0 AND stage <= ?1 LIMIT 1000) AS first) AS ready,
    (SELECT count(*) FROM job WHERE status = 1 AND stage <= ?1) AS leased,
    (SELECT count(*) FROM job WHERE status = 2 AND stage <= ?1) AS backoff,
    (SELECT min(run_at) FROM job WHERE status = 2 AND stage <= ?1) AS next_due";

const LEFT_AMONG: &str = "
SELECT count(*) FILTER (WHERE j.status = 0) AS ready, count(*) FILTER (WHERE j.status = 1) AS leased,
    count(*) FILTER (WHERE j.status = 2) AS backoff, min(j.run_at) AS next_due
FROM json_each(?2) AS wanted CROSS JOIN job AS j ON j.pair = CAST(wanted.atom AS bigint) WHERE j.stage <= ?1";

const COUNT_ALL: &str =
    "SELECT stage, status, CAST(sum(n) AS bigint) FROM counter GROUP BY stage, status";

const COUNT_AMONG: &str = "
SELECT j.stage, j.status, count(*) FROM json_each(?1) AS wanted CROSS JOIN job AS j ON j.pair = CAST(wanted.atom AS bigint)
GROUP BY j.stage, j.status";

impl Catalog {
    /// Ends the back-offs that are due, and returns the number of pairs made ready. Also ends back-offs with more than
    /// `longest` milliseconds left, which only a clock jump can cause.
    pub async fn release_due_backoffs(&self, now: UnixMillis, longest: i64) -> Result<u64> {
        in_transaction!(self, |conn| {
            let mut deltas = Deltas::default();
            let due = release_due::<PairJob>(conn, now, longest, &mut deltas).await?;
            deltas.apply(conn).await?;
            Ok(due)
        })
    }

    /// Counts the ready, leased and backing-off pairs whose next stage is `until` or earlier. Without `selection`, counts
    /// all pairs, but at most 1000 ready ones.
    pub async fn outstanding(
        &self,
        until: Stage,
        selection: Option<&PairSelection>,
    ) -> Result<Outstanding> {
        let mut conn = self.read_conn().await?;
        let query = match selection {
            None => query_as(LEFT_ALL).bind(cursor(until)),
            Some(selection) => query_as(LEFT_AMONG)
                .bind(cursor(until))
                .bind(&selection.json),
        };
        query.fetch_one(&mut conn).await
    }

    /// Counts the stages up to `until` that pairs have yet to run. Without `selection`, reads the counters, not the jobs.
    pub async fn work_left(
        &self,
        until: Stage,
        selection: Option<&PairSelection>,
    ) -> Result<WorkLeft> {
        let mut conn = self.read_conn().await?;
        let query = match selection {
            None => query_as(COUNT_ALL),
            Some(selection) => query_as(COUNT_AMONG).bind(&selection.json),
        };
        let counted: Vec<(Cursor, JobStatus, u64)> = query.fetch_all(&mut conn).await?;
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
