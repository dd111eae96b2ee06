//! Checks the catalog with SQLite's own checks. Compares its schema, counters and dirty marks with the expected ones.

use std::collections::{BTreeMap, BTreeSet};

use sqlx::SqliteConnection;

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::error_kind::CatalogErrorKind;
use crate::db::query::{query_as, query_scalar};
use crate::db::schema;
use crate::jobs::job_counts::count_jobs;
use crate::queue::counters::{CounterKey, JobGroup};
use crate::queue::fragments::inconsistent;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::JobStatus;

/// Largest number of broken references that a check lists.
const LINES: usize = 50;

/// Derived values that disagree with the rows they are derived from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Drift {
    /// Wrong counters.
    pub counters: Vec<CounterDrift>,
    /// Messages, each with the number of jobs whose fingerprint or dirty mark is wrong.
    pub marks: Vec<String>,
}

/// A wrong counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CounterDrift {
    /// Index of the next stage, 0 to 4.
    pub cursor: i64,
    /// The status.
    pub status: JobStatus,
    /// Value of the counter. `None` if its row is missing.
    pub kept: Option<u64>,
    /// The number of jobs.
    pub counted: u64,
}

const REFERENCES: Sql = Sql::pair(
    "
SELECT \"table\" || coalesce(' row ' || rowid, '') || ' names a ' || parent || ' that is not there'
FROM pragma_foreign_key_check WHERE \"table\" <> 'checksum' LIMIT ?1",
    "
SELECT what FROM (
    SELECT 'stage_result of pair ' || r.pair || ' names a pair that is not there' AS what
    FROM stage_result AS r WHERE NOT EXISTS (SELECT 1 FROM pair AS p WHERE p.id = r.pair)
    UNION ALL SELECT 'stage_result of pair ' || r.pair || ' names a fingerprint that is not there'
    FROM stage_result AS r WHERE NOT EXISTS (SELECT 1 FROM fingerprint AS f WHERE f.id = r.fingerprint)
    UNION ALL SELECT 'stage_result of pair ' || r.pair || ' names a worker that is not there'
    FROM stage_result AS r WHERE NOT EXISTS (SELECT 1 FROM worker AS w WHERE w.id = r.worker)
    UNION ALL SELECT 'metric_result of pair ' || m.pair || ' names a pair that is not there'
    FROM metric_result AS m WHERE NOT EXISTS (SELECT 1 FROM pair AS p WHERE p.id = m.pair)
    UNION ALL SELECT 'attempt row ' || a.id || ' names a pair that is not there'
    FROM attempt AS a WHERE NOT EXISTS (SELECT 1 FROM pair AS p WHERE p.id = a.pair)
    UNION ALL SELECT 'job row ' || j.pair || ' names a pair that is not there' FROM job AS j
    WHERE NOT EXISTS (SELECT 1 FROM pair AS p WHERE p.id = j.pair)
    UNION ALL SELECT 'job row ' || j.pair || ' names a fingerprint that is not there' FROM job AS j
    WHERE j.fingerprint IS NOT NULL AND NOT EXISTS (SELECT 1 FROM fingerprint AS f WHERE f.id = j.fingerprint)
    UNION ALL SELECT 'job row ' || j.pair || ' names a worker that is not there' FROM job AS j
    WHERE j.worker IS NOT NULL AND NOT EXISTS (SELECT 1 FROM worker AS w WHERE w.id = j.worker)) AS broken LIMIT ?1",
);

/// Selects triggers and rules of PostgreSQL that could change rows besides those of this program, and triggers that are
/// missing or switched off.
const SERVER_OBJECTS: &str = "
WITH wanted AS (
    SELECT name, name || '_append_only' AS trigger FROM (VALUES ('review_act'), ('verdict'), ('verdict_undo'),
        ('attention_check_answer'), ('attention_check_undo'), ('manual_alignment'), ('manual_alignment_undo')) AS log (name)
    UNION ALL SELECT 'pair', 'pair_changed'),
found AS (
    SELECT CAST(c.relname AS text) AS name, CAST(t.tgname AS text) AS trigger, t.tgenabled <> 'D' AS is_on
    FROM pg_trigger AS t JOIN pg_class AS c ON c.oid = t.tgrelid
    WHERE c.relnamespace = CAST(current_schema() AS regnamespace) AND NOT t.tgisinternal)
SELECT what FROM (
    SELECT 'trigger ' || f.trigger || ' on ' || f.name || ' does not belong to this program' AS what
    FROM found AS f WHERE NOT EXISTS (SELECT 1 FROM wanted AS w WHERE w.name = f.name AND w.trigger = f.trigger)
    UNION ALL
    SELECT 'trigger ' || w.trigger || ' is missing or switched off'
    FROM wanted AS w WHERE NOT EXISTS (
        SELECT 1 FROM found AS f WHERE w.name = f.name AND w.trigger = f.trigger AND f.is_on)
    UNION ALL
    SELECT 'rule ' || r.rulename || ' on ' || c.relname || ' does not belong to this program'
    FROM pg_rewrite AS r JOIN pg_class AS c ON c.oid = r.ev_class
    WHERE c.relnamespace = CAST(current_schema() AS regnamespace) AND c.relkind = 'r') AS difference ORDER BY what";

const COUNTERS: &str = "SELECT stage, status, fingerprint, n FROM counter";

/// Selects each fingerprint with the cursor that follows its stage. Jobs without results have cursor 0 and fingerprint
/// 0.
const FINGERPRINTS: &str =
    "SELECT 0 AS cursor, 0 AS id UNION ALL SELECT stage + 1, id FROM fingerprint";

const WRONG_FINGERPRINTS: &str = "
SELECT count(*) FROM job AS j JOIN stage_result AS r ON r.pair = j.pair AND r.stage = j.stage - 1
WHERE r.fingerprint IS DISTINCT FROM j.fingerprint";

const UNMARKED: &str = concat!(
    "SELECT count(*) FROM job WHERE dirty = 0 AND EXISTS (",
    inconsistent!(),
    ")"
);

impl Catalog {
    /// Runs SQLite's integrity check. Returns at most 50 faults, or none if the file is sound. With `quick`, does not
    /// compare indexes with their tables.
    ///
    /// # Errors
    /// Returns an error if the disk fails to read part of the file, or if SQLite reports an error other than damage.
    pub async fn integrity(&self, quick: bool) -> Result<Vec<String>> {
        // The server of PostgreSQL checks its own files.
        let Conn::Sqlite(mut conn) = self.read_conn().await? else {
            return Ok(Vec::new());
        };
        match integrity(&mut conn, quick).await {
            Ok(lines) if lines.iter().any(|line| is_unread(line)) => {
                Err(CatalogError::Unread(self.path.to_path_buf()))
            }
            Err(error) => match error.kind() {
                Some(
                    CatalogErrorKind::Damaged
                    | CatalogErrorKind::NotADatabase
                    | CatalogErrorKind::Statement,
                ) => Ok(vec![error.to_string()]),
                _ => Err(error),
            },
            lines => lines,
        }
    }

    /// Describes at most 50 rows that reference a missing row.
    pub async fn broken_references(&self) -> Result<Vec<String>> {
        let mut conn = self.read_conn().await?;
        let lines = query_scalar(REFERENCES).bind(LINES as i64);
        lines.fetch_all(&mut conn).await
    }

    /// Compares the tables, indexes and triggers with the schema of this program, in PostgreSQL only the triggers and rules.
    /// Returns one line for each difference.
    pub async fn schema_differences(&self) -> Result<Vec<String>> {
        let mut conn = match self.read_conn().await? {
            Conn::Sqlite(conn) => conn,
            mut conn @ Conn::Postgres(_) => {
                return query_scalar(SERVER_OBJECTS).fetch_all(&mut conn).await;
            }
        };
        let wanted = schema::wanted_objects().await?;
        let found = schema::differences(&mut conn, wanted).await?;
        Ok(found.iter().map(ToString::to_string).collect())
    }

    /// Compares the counters, and the fingerprint and dirty mark of each job, with the rows they are derived from. With
    /// `quick`, checks only the counters, because the other checks read all results.
    pub async fn drift(&self, quick: bool) -> Result<Drift> {
        // Read in one transaction, so that the writes of a concurrent run do not look like drift.
        let mut conn = self.snapshot().await?;
        let counters = counter_drift(&mut conn).await?;
        let mut marks = Vec::new();
        let checks = [
            (
                WRONG_FINGERPRINTS,
                "have another fingerprint than their last result",
            ),
            (
                UNMARKED,
                "are not marked dirty, although their inputs or settings changed",
            ),
        ];
        for (sql, what) in checks.into_iter().filter(|_| !quick) {
            let pairs: i64 = query_scalar(sql).fetch_one(&mut conn).await?;
            if pairs > 0 {
                marks.push(format!("{pairs} pairs {what}"));
            }
        }
        Ok(Drift { counters, marks })
    }
}

/// Compares the counters with the jobs.
async fn counter_drift(conn: &mut Conn) -> Result<Vec<CounterDrift>> {
    let stored: Vec<JobGroup> = query_as(COUNTERS).fetch_all(&mut *conn).await?;
    let stored: BTreeMap<_, _> = stored.iter().map(|group| (group.key, group.n)).collect();
    let counted = count_jobs(conn).await?;
    let fingerprints: Vec<(i64, i64)> = query_as(FINGERPRINTS).fetch_all(conn).await?;
    let needed = fingerprints.into_iter().flat_map(|(cursor, fingerprint)| {
        JobStatus::ALL.map(|status| CounterKey::new(cursor, status, Some(fingerprint)))
    });
    let keys: BTreeSet<_> = needed.chain(counted.keys().copied()).collect();
    let drift = keys.into_iter().filter_map(|key| {
        let counted = counted.get(&key).copied().unwrap_or(0);
        let kept = stored.get(&key).copied();
        (kept != Some(counted)).then_some(CounterDrift {
            cursor: key.cursor,
            status: key.status,
            kept,
            counted,
        })
    });
    Ok(drift.collect())
}

/// Runs SQLite's integrity check; see [`Catalog::integrity`].
pub(crate) async fn integrity(conn: &mut SqliteConnection, quick: bool) -> Result<Vec<String>> {
    let sql = if quick {
        "PRAGMA quick_check(50)"
    } else {
        "PRAGMA integrity_check(50)"
    };
    let mut lines: Vec<String> = sqlx::query_scalar(sql).fetch_all(conn).await?;
    lines.retain(|line| line != "ok");
    Ok(lines)
}

/// Returns whether a line of SQLite's check reports an I/O error rather than damage.
fn is_unread(line: &str) -> bool {
    let code = line.rsplit_once("error code=").map(|(_, code)| code.trim());
    let code: Option<i64> = code.and_then(|code| code.parse().ok());
    code.and_then(CatalogErrorKind::of_code) == Some(CatalogErrorKind::Disk)
}

#[cfg(test)]
mod tests {
    use super::is_unread;

    #[test]
    fn a_page_that_the_disk_does_not_give_is_told_from_one_that_is_wrong() {
        // SQLITE_IOERR_READ and SQLITE_CORRUPT.
        assert!(is_unread(
            "Tree 5 page 7: unable to get the page. error code=266"
        ));
        assert!(!is_unread(
            "Tree 5 page 7: unable to get the page. error code=11"
        ));
        assert!(!is_unread(
            "Tree 5 page 7: btreeInitPage() returns error code 11"
        ));
    }
}
