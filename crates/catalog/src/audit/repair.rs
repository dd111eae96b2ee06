//! Repairs damage that a check found, while no run is active. Never changes verdicts.

use serde_json::json;
use sqlx::AssertSqlSafe;

use crate::audit::integrity::integrity;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::query;
use crate::db::rows::json_array;
use crate::db::schema::{self, SchemaDifference, wanted_objects};
use crate::db::transaction::in_transaction;
use crate::jobs::job_counts::count_jobs;
use crate::jobs::requeue::send_back;
use crate::queue::counters::Deltas;
use crate::queue::fragments::{fingerprint_before, inconsistent};
use crate::queue::pair_job::PairJob;
use crate::{Catalog, Result};
use mocban_core::domain::{PairId, Stage};

/// Removes the results of the stages that are to run again, because their values may be invalid.
const REMOVE_RESULTS: &str = "
DELETE FROM stage_result WHERE (pair, stage) IN (
    SELECT CAST(item.value ->> 0 AS bigint), later.stage FROM json_each(?1) AS item,
        (SELECT 0 AS stage UNION ALL SELECT 1 UNION ALL SELECT 2 UNION ALL SELECT 3) AS later
    WHERE later.stage >= CAST(item.value ->> 1 AS bigint))";

/// Keeps heartbeats, which move counters to other rows without the catalog's lock, out until the end of the transaction.
const LOCK_COUNTERS: &str = "LOCK TABLE counter_part IN SHARE ROW EXCLUSIVE MODE";

/// Recreates every counter with the value 0.
const RESET_COUNTERS: [Sql; 3] = [
    Sql::pair("DELETE FROM counter", "DELETE FROM counter_part"),
    Sql::pair(
        "INSERT INTO counter (stage, status, fingerprint, n) SELECT 0, value, 0, 0 FROM json_each('[0,1,2,3,4]')",
        "INSERT INTO counter_part (slot, stage, status, fingerprint, n)
        SELECT 0, 0, status, 0, 0 FROM generate_series(0, 4) AS status",
    ),
    Sql::pair(
        "INSERT INTO counter (stage, status, fingerprint, n)
        SELECT f.stage + 1, s.value, f.id, 0 FROM fingerprint AS f, json_each('[0,1,2,3,4]') AS s",
        "INSERT INTO counter_part (slot, stage, status, fingerprint, n)
        SELECT 0, f.stage + 1, status, f.id, 0 FROM fingerprint AS f, generate_series(0, 4) AS status",
    ),
];

const FIX_FINGERPRINTS: &str = concat!(
    "UPDATE job SET fingerprint = ",
    fingerprint_before!("job.stage"),
    " WHERE fingerprint IS DISTINCT FROM ",
    fingerprint_before!("job.stage")
);

const MARK_DIRTY: &str = concat!(
    "UPDATE job SET dirty = 1 WHERE dirty = 0 AND EXISTS (",
    inconsistent!(),
    ")"
);

impl Catalog {
    /// Sends each pair back to the given stage, removes its results from there on, and adds missing jobs. The counters
    /// must be correct: see [`Catalog::rebuild_counters`].
    ///
    /// # Errors
    /// Returns an error if a database operation fails. In that case nothing is changed.
    pub async fn restore(&self, pairs: Vec<(PairId, Stage)>) -> Result<()> {
        in_transaction!(self, |conn| { restore(conn, &pairs).await })
    }

    /// Corrects the fingerprint of each job, marks jobs with inconsistent results dirty, and recounts all counters.
    pub async fn rebuild_counters(&self) -> Result<()> {
        in_transaction!(self, |conn| {
            // Before the jobs are changed, so that heartbeats wait.
            lock_counters(conn).await?;
            for sql in [FIX_FINGERPRINTS, MARK_DIRTY] {
                query(sql).execute(&mut *conn).await?;
            }
            recount(conn).await
        })
    }

    /// Rebuilds every index from its table. Returns the faults that SQLite's integrity check finds afterwards.
    pub async fn rebuild_indexes(&self) -> Result<Vec<String>> {
        in_transaction!(self, |conn| {
            let Conn::Sqlite(conn) = conn else {
                return Ok(Vec::new());
            };
            sqlx::query("REINDEX").execute(&mut **conn).await?;
            integrity(conn, false).await
        })
    }

    /// Recreates missing indexes and triggers. Does not change tables.
    pub async fn restore_schema(&self) -> Result<()> {
        let wanted = wanted_objects().await?;
        in_transaction!(self, |conn| {
            let Conn::Sqlite(conn) = conn else {
                return Ok(());
            };
            for found in schema::differences(conn, wanted).await? {
                let SchemaDifference::Missing(name) = found else {
                    continue;
                };
                if let Some(sql) = wanted.get(&name).filter(|_| !name.starts_with("table ")) {
                    // SQL of our own migrations.
                    let sql = AssertSqlSafe(sql.as_str());
                    sqlx::query(sql).execute(&mut **conn).await?;
                }
            }
            Ok(())
        })
    }
}

async fn lock_counters(conn: &mut Conn) -> Result<()> {
    match conn {
        Conn::Postgres(_) => query(LOCK_COUNTERS).execute(conn).await,
        Conn::Sqlite(_) => Ok(()),
    }
}

/// Recounts all counters in an open transaction.
pub(crate) async fn recount(conn: &mut Conn) -> Result<()> {
    lock_counters(conn).await?;
    for sql in RESET_COUNTERS {
        query(sql).execute(&mut *conn).await?;
    }
    let mut deltas = Deltas::default();
    for (key, jobs) in count_jobs(conn).await? {
        deltas.add(key, jobs.cast_signed());
    }
    deltas.apply(conn).await
}

async fn restore(conn: &mut Conn, pairs: &[(PairId, Stage)]) -> Result<()> {
    let items = pairs.iter();
    let items = items.map(|(pair, stage)| json!([pair.0, stage.index()]));
    let mut deltas = Deltas::default();
    send_back::<PairJob>(conn, pairs.iter().copied(), &mut deltas).await?;
    let remove = query(REMOVE_RESULTS).bind(json_array(items));
    remove.execute(&mut *conn).await?;
    deltas.apply(conn).await
}
