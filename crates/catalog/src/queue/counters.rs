//! Numbers of jobs by cursor, status and fingerprint. They change in the same transaction as the jobs.

use std::collections::BTreeMap;

use serde_json::json;

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::error::Result;
use crate::db::query::{query, query_as};
use crate::db::row::from_row;
use crate::db::script::Script;
use mocban_core::domain::{JobStatus, Stage};

const CHANGE: Sql = Sql::pair(
    "
UPDATE counter SET n = n + CAST(d.value ->> 3 AS bigint) FROM jsonb_each(?) AS d
WHERE counter.stage = CAST(d.value ->> 0 AS bigint) AND counter.status = CAST(d.value ->> 1 AS bigint) AND counter.fingerprint = CAST(d.value ->> 2 AS bigint)",
    "
INSERT INTO counter_part (stage, status, fingerprint, n)
SELECT CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), CAST(value ->> 2 AS bigint),
    CAST(value ->> 3 AS bigint) FROM json_array_elements(CAST(? AS json))
ON CONFLICT (slot, stage, status, fingerprint) DO UPDATE SET n = counter_part.n + excluded.n",
);

/// Adds the counters of earlier slots to slot 0, in PostgreSQL. Rows that another process has locked are left for the
/// next time. `?1` is how many intervals before this one to consider.
const FOLD: &str = "
WITH earlier AS (
    DELETE FROM counter_part WHERE ctid = ANY (ARRAY(
        SELECT ctid FROM counter_part
        WHERE slot > 0 AND slot >= (CAST(extract(epoch FROM now()) AS bigint) / 10 - ?1) * 256
            AND slot < (CAST(extract(epoch FROM now()) AS bigint) / 10 - 1) * 256
        FOR UPDATE SKIP LOCKED))
    RETURNING stage, status, fingerprint, n)
INSERT INTO counter_part (slot, stage, status, fingerprint, n)
SELECT 0, stage, status, fingerprint, sum(n) FROM earlier GROUP BY 2, 3, 4 ORDER BY 2, 3, 4
ON CONFLICT (slot, stage, status, fingerprint) DO UPDATE SET n = counter_part.n + excluded.n";
/// The intervals of the last minute.
const LAST_INTERVALS: i64 = 6;
/// More intervals than since 1970.
const ALL_INTERVALS: i64 = 1 << 32;

/// Counters that are not 0.
const COUNTERS: &str = "SELECT stage, status, fingerprint, n FROM counter WHERE n <> 0";

/// Position of a job: the index of its next stage, or the number of stages of its kind if the job is done.
pub(crate) type Cursor = i64;

/// Returns the position of a job with this next stage.
pub(crate) const fn cursor(stage: Stage) -> Cursor {
    stage.index() as Cursor
}

/// Key of a counter. Jobs with the same key are counted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct CounterKey {
    pub(crate) cursor: Cursor,
    pub(crate) status: JobStatus,
    /// Fingerprint of the result before the cursor, or 0 if there is none.
    pub(crate) fingerprint: i64,
}

from_row! { CounterKey { cursor: "stage", status, fingerprint } }

impl CounterKey {
    /// The key of a new job.
    pub(crate) const NEW: Self = Self {
        cursor: 0,
        status: JobStatus::Ready,
        fingerprint: 0,
    };

    /// Makes a key from columns of `job`.
    pub(crate) fn new(cursor: Cursor, status: JobStatus, fingerprint: Option<i64>) -> Self {
        Self {
            cursor,
            status,
            fingerprint: fingerprint.unwrap_or(0),
        }
    }

    /// Returns the next stage, or `None` at the end.
    pub(crate) fn stage(self) -> Option<Stage> {
        usize::try_from(self.cursor)
            .ok()
            .and_then(Stage::from_index)
    }

    /// Returns the key of the same job with another status.
    pub(crate) const fn with_status(self, status: JobStatus) -> Self {
        Self { status, ..self }
    }
}

/// A job with its counter key.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KeyedJob {
    pub(crate) unit: i64,
    pub(crate) key: CounterKey,
}

from_row! { KeyedJob { unit, key in row } }

/// A number of jobs that are counted together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JobGroup {
    pub(crate) key: CounterKey,
    pub(crate) n: u64,
}

from_row! { JobGroup { key in row, n } }

/// Changes of the counters, collected over a transaction.
#[derive(Debug, Default)]
pub(crate) struct Deltas(BTreeMap<CounterKey, i64>);

impl Deltas {
    /// Moves a job from one counter to another.
    pub(crate) fn move_job(&mut self, from: CounterKey, to: CounterKey) {
        self.add(from, -1);
        self.add(to, 1);
    }

    /// Adds to a counter.
    pub(crate) fn add(&mut self, key: CounterKey, n: i64) {
        *self.0.entry(key).or_default() += n;
    }

    /// Stores the changes.
    pub(crate) async fn apply(&self, conn: &mut Conn) -> Result<()> {
        let mut script = Script::default();
        self.add_to(&mut script)?;
        script.run(conn).await?;
        Ok(())
    }

    /// Adds the statement that stores the changes to a script.
    pub(crate) fn add_to(&self, script: &mut Script) -> Result<()> {
        let changes = self.0.iter().filter(|(_, n)| **n != 0);
        let changes =
            changes.map(|(key, n)| json!([key.cursor, key.status.code(), key.fingerprint, n]));
        script.execute_over(CHANGE, changes)
    }
}

/// Numbers of jobs by cursor and status, without zeros.
pub type JobCounts = BTreeMap<(i64, JobStatus), u64>;

/// Reads the counters that are not 0.
pub(crate) async fn counters(conn: &mut Conn) -> Result<BTreeMap<CounterKey, u64>> {
    let found: Vec<JobGroup> = query_as(COUNTERS).fetch_all(conn).await?;
    Ok(found
        .into_iter()
        .map(|group| (group.key, group.n))
        .collect())
}

/// Adds the counters of earlier slots to slot 0, in PostgreSQL, so that few rows remain. Considers those of the last minute,
/// or `all`, which takes longer while a session holds a snapshot.
pub(crate) async fn fold(conn: &mut Conn, all: bool) -> Result<()> {
    let Conn::Postgres(_) = conn else {
        return Ok(());
    };
    let intervals = if all { ALL_INTERVALS } else { LAST_INTERVALS };
    query(FOLD).bind(intervals).execute(conn).await?;
    Ok(())
}

/// Adds up numbers of jobs by cursor and status.
pub(crate) fn by_status(counted: impl IntoIterator<Item = (CounterKey, u64)>) -> JobCounts {
    let mut counts = JobCounts::new();
    for (key, n) in counted {
        *counts.entry((key.cursor, key.status)).or_default() += n;
    }
    counts
}
