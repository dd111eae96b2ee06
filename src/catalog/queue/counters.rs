//! Counts of jobs by cursor and status, moved in the same transaction as the jobs.

use std::collections::BTreeMap;

use serde_json::json;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::db::script::Script;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::job_counts::{self, by_status, census};
use crate::domain::{JobStatus, Stage};

const CHANGE: &str = "
UPDATE counter SET n = n + (d.value ->> 2) FROM jsonb_each(?1) AS d
WHERE counter.stage = d.value ->> 0 AND counter.status = d.value ->> 1";

/// The counts as kept, for [`counts`].
pub(crate) const KEPT: &str = "SELECT stage, status, n FROM counter WHERE n <> 0";

/// Cursor of a job: its next stage 0..4, or 4 when done.
pub(crate) type Cursor = i64;

/// Cursor of a job that is done.
pub(crate) const DONE: Cursor = Stage::ALL.len() as Cursor;

/// Cursor of a job whose next stage this is.
pub(crate) const fn cursor(stage: Stage) -> Cursor {
    stage.index() as Cursor
}

/// How the counts change, gathered over a batch.
#[derive(Debug, Default)]
pub(crate) struct Deltas(BTreeMap<(Cursor, JobStatus), i64>);

impl Deltas {
    /// A job goes from one place to another.
    pub(crate) fn moved(&mut self, from: (Cursor, JobStatus), to: (Cursor, JobStatus)) {
        self.add(from, -1);
        self.add(to, 1);
    }

    /// So many jobs appear at a place, or leave it.
    pub(crate) fn add(&mut self, at: (Cursor, JobStatus), n: i64) {
        *self.0.entry(at).or_default() += n;
    }

    /// Writes the changes.
    pub(crate) async fn apply(&self, conn: &mut SqliteConnection) -> Result<()> {
        let mut script = Script::default();
        self.write(&mut script)?;
        script.run(conn).await?;
        Ok(())
    }

    /// Adds the changes to a script.
    pub(crate) fn write(&self, script: &mut Script) -> Result<()> {
        let rows: Vec<_> = self
            .0
            .iter()
            .filter(|(_, n)| **n != 0)
            .map(|((stage, status), n)| json!([stage, status.code(), n]))
            .collect();
        if rows.is_empty() {
            return Ok(());
        }
        let changes = serde_json::Value::from(rows).to_string();
        script.add(&[CHANGE]).bind(changes)?;
        Ok(())
    }
}

/// Every place that has a counter.
pub(crate) fn standings() -> impl Iterator<Item = (Cursor, JobStatus)> {
    (0..=DONE).flat_map(|cursor| JobStatus::ALL.map(|status| (cursor, status)))
}

/// Jobs by cursor and status; only what is not 0.
pub type JobCounts = BTreeMap<(i64, JobStatus), u64>;

impl Catalog {
    /// The counts as kept.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn counters(&self) -> Result<JobCounts> {
        let mut conn = self.read_conn().await?;
        counts(&mut conn, KEPT).await
    }

    /// The counts as they are when every job is counted: equal to [`Catalog::counters`], or the catalog is damaged.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn recount(&self) -> Result<JobCounts> {
        let mut conn = self.snapshot().await?;
        by_status(&census(&mut conn, job_counts::ALL).await?)
    }
}

/// Counts from a query of cursor, status and number.
pub(crate) async fn counts(conn: &mut SqliteConnection, sql: &'static str) -> Result<JobCounts> {
    let rows = sqlx::query(sql).fetch_all(conn).await?;
    rows.iter()
        .map(|row| {
            let status = rows::status(row.try_get(1)?)?;
            let n: i64 = row.try_get(2)?;
            Ok(((row.try_get(0)?, status), n.unsigned_abs()))
        })
        .collect()
}
