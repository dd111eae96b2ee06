//! Mending what a check found. Only while no run goes on; verdicts and the history of results are never touched.

use serde_json::json;
use sqlx::{AssertSqlSafe, Row as _, SqliteConnection};

use crate::catalog::audit::integrity::{integrity, objects, wanted_objects};
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::db::rows::array;
use crate::catalog::db::script::Script;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::alike::{made, misremembered, unnoted};
use crate::catalog::queue::counters::{Deltas, cursor, standings};
use crate::catalog::queue::job_counts::{self, by_fingerprint, by_status, census};
use crate::domain::{JobStatus, PairId, Stage};

const STANDING: &str = "
SELECT item.value ->> 0 AS pair, item.value ->> 1 AS to_stage, j.stage, j.status
FROM json_each(?1) AS item LEFT JOIN job AS j ON j.pair = item.value ->> 0";

const NEW_JOBS: &str = "
INSERT INTO job (pair, stage, status)
SELECT value ->> 0, 0, 0 FROM json_each(?1) WHERE NOT EXISTS (SELECT 1 FROM job WHERE pair = value ->> 0)";

/// Back to a stage and never forward. A lease is no hindrance: no process lives that could hold it, and the new token
/// shuts out one that does.
pub(crate) const RESTORE: &str = concat!(
    "
UPDATE job SET stage = min(stage, item.value ->> 1), status = 0, run_at = NULL, prio = 0,
    attempt = 0, crashes = 0, exclusive = 0, worker = NULL, deadline = NULL, token = token + 1,
    made = ",
    made!("min(job.stage, item.value ->> 1)"),
    "
FROM json_each(?1) AS item WHERE job.pair = item.value ->> 0"
);

const FORGET: &str = "DELETE FROM failure WHERE pair IN (SELECT value ->> 0 FROM json_each(?1))";

const RECOUNT: &str = "
INSERT INTO counter (stage, status, n) SELECT value ->> 0, value ->> 1, value ->> 2 FROM json_each(?1)
WHERE true ON CONFLICT (stage, status) DO UPDATE SET n = excluded.n";

const REMAKE: &str = concat!(
    "UPDATE job SET made = ",
    made!("job.stage"),
    " WHERE ",
    misremembered!()
);

/// The trigger counts along, and what was off is off still.
const RECOUNT_MADE: [&str; 2] = [
    "DELETE FROM made",
    "INSERT INTO made SELECT value ->> 0, value ->> 1 FROM json_each(?1)",
];

/// One too many does no harm: a run takes out those that it has looked after.
const NOTE_MOVED: &str = concat!("INSERT INTO moved ", unnoted!());

impl Catalog {
    /// Puts pairs back to be done, each from a stage on; a pair without a job gets one. The counters must be right
    /// already: see [`Catalog::rebuild_counters`].
    ///
    /// # Errors
    /// When the database refuses; then nothing is changed.
    pub async fn restore(&self, pairs: Vec<(PairId, Stage)>) -> Result<()> {
        self.in_transaction(move |conn| Box::pin(async move { restore(conn, &pairs).await }))
            .await
    }

    /// Sets every counter to the number of jobs there are, and makes anew what jobs keep of their results.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn rebuild_counters(&self) -> Result<()> {
        self.in_transaction(|conn| {
            Box::pin(async move {
                sqlx::query(REMAKE).execute(&mut *conn).await?;
                let counted = census(conn, job_counts::ALL).await?;
                let by_status = by_status(&counted)?;
                let counters = standings().map(|(cursor, status)| {
                    let jobs = by_status.get(&(cursor, status)).copied().unwrap_or(0);
                    json!([cursor, status.code(), jobs])
                });
                let made = by_fingerprint(&counted).into_iter();
                let made = made.map(|(fingerprint, jobs)| json!([fingerprint, jobs]));
                let mut script = Script::default();
                script.add(&[RECOUNT]).bind(array(counters).to_string())?;
                script.add(&RECOUNT_MADE).bind(array(made).to_string())?;
                script.add(&[NOTE_MOVED]);
                script.run(conn).await?;
                Ok(())
            })
        })
        .await
    }

    /// Makes every index anew from its table; says what SQLite finds wrong afterwards.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn rebuild_indexes(&self) -> Result<Vec<String>> {
        self.in_transaction(|conn| {
            Box::pin(async move {
                sqlx::query("REINDEX").execute(&mut *conn).await?;
                integrity(conn, false).await
            })
        })
        .await
    }

    /// Makes indexes and triggers that are gone. Tables are left as they are.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn restore_schema(&self) -> Result<()> {
        let wanted = wanted_objects().await?;
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let found = objects(conn).await?;
                for (name, sql) in wanted {
                    if !name.starts_with("table ") && !found.contains_key(&name) {
                        // From our own migrations.
                        sqlx::query(AssertSqlSafe(sql)).execute(&mut *conn).await?;
                    }
                }
                Ok(())
            })
        })
        .await
    }
}

async fn restore(conn: &mut SqliteConnection, pairs: &[(PairId, Stage)]) -> Result<()> {
    let items = pairs.iter();
    let items = array(items.map(|(pair, stage)| json!([pair.0, stage.index()]))).to_string();
    let standing = sqlx::query(STANDING)
        .bind(&items)
        .fetch_all(&mut *conn)
        .await?;
    for sql in [NEW_JOBS, RESTORE, FORGET] {
        sqlx::query(sql).bind(&items).execute(&mut *conn).await?;
    }
    let mut deltas = Deltas::default();
    for row in &standing {
        let (to, at): (i64, Option<i64>) = (row.try_get("to_stage")?, row.try_get("stage")?);
        let status: Option<i64> = row.try_get("status")?;
        match (at, status.map(rows::status).transpose()?) {
            (Some(at), Some(status)) => {
                deltas.moved((at, status), (at.min(to), JobStatus::Ready));
            }
            _ => deltas.add((cursor(Stage::Fit), JobStatus::Ready), 1),
        }
    }
    deltas.apply(conn).await
}
