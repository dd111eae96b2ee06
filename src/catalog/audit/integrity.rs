//! Checks the catalog with SQLite's own checks. Compares its schema, counters and dirty marks with the expected ones.

use std::collections::{BTreeMap, BTreeSet};

use sqlx::sqlite::{SqliteConnectOptions, SqliteRow};
use sqlx::{ConnectOptions as _, FromRow as _, Row as _, SqliteConnection};

use crate::catalog::db::error_kind::CatalogErrorKind;
use crate::catalog::db::open;
use crate::catalog::db::rows::json_array;
use crate::catalog::queue::counters::{CounterKey, JobGroup};
use crate::catalog::queue::fragments::inconsistent;
use crate::catalog::queue::job_counts::count_jobs;
use crate::catalog::queue::lease::MetricResult;
use crate::catalog::records::model::PairAttributes;
use crate::catalog::records::pair_work::{self, KnownInputs};
use crate::catalog::{Catalog, CatalogError, Result};
use crate::domain::{
    ContentHash, JobStatus, MetricOutcome, PairId, PairName, Scores, Stage, ThresholdMetric,
};

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

/// A pair as stored, with unparsed results.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditedPair {
    /// The user's id.
    pub name: PairName,
    /// Id of the pair, with the paths and hashes of its input files as last read.
    pub inputs: KnownInputs,
    /// Status and cursor of the pair's job. `None` if there is no job.
    pub job: Option<(JobStatus, i64)>,
    /// Whether a failure is stored.
    pub has_failure: bool,
    /// Every stored result, also of stages that are to run again. Results with invalid values are left out.
    pub results: BTreeMap<Stage, AuditedResult>,
    /// The rows of the metrics. Rows with invalid values are left out.
    pub metrics: BTreeMap<ThresholdMetric, MetricResult>,
}

/// Pairs that a check has read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AuditPage {
    /// The pairs, sorted by id.
    pub pairs: Vec<AuditedPair>,
    /// Pairs with an invalid value, and messages.
    pub unreadable: Vec<(PairId, String)>,
    /// Id of the last pair. `None` if there are no more pairs.
    pub last: Option<PairId>,
}

/// A stored result, left unparsed so that a check can also read invalid values.
#[derive(Debug, Clone, PartialEq, Eq, sqlx_macros::FromRow)]
pub struct AuditedResult {
    /// The outcome as JSON text.
    pub outcome: String,
    /// The artifacts as JSON text.
    pub files: String,
    /// Stored hash of the outcome and the artifacts.
    pub result_hash: ContentHash,
}

const REFERENCES: &str = "
SELECT \"table\" || coalesce(' row ' || rowid, '') || ' names a ' || parent || ' that is not there'
FROM pragma_foreign_key_check LIMIT ?1";

const OBJECTS: &str = "
SELECT type || ' ' || name, sql FROM sqlite_schema
WHERE sql IS NOT NULL AND name NOT LIKE 'sqlite%' AND name NOT IN ('_sqlx_migrations', 'backup_settings')
ORDER BY 1";

const COUNTERS: &str = "SELECT stage, status, fingerprint, n FROM counter";

/// Selects each fingerprint with the cursor that follows its stage. Jobs without results have cursor 0 and fingerprint
/// 0.
const FINGERPRINTS: &str =
    "SELECT 0 AS cursor, 0 AS id UNION ALL SELECT stage + 1, id FROM fingerprint";

const WRONG_FINGERPRINTS: &str = "
SELECT count(*) FROM job AS j JOIN stage_result AS r ON r.pair = j.pair AND r.stage = j.stage - 1
WHERE r.fingerprint IS NOT j.fingerprint";

const UNMARKED: &str = concat!(
    "SELECT count(*) FROM job WHERE dirty = 0 AND EXISTS (",
    inconsistent!(),
    ")"
);

pub(crate) const PAGE: &str = "
SELECT p.id, p.name, p.mesh_path, p.mesh_hash, p.mesh_stat, p.print_path, p.print_hash, p.print_stat,
    p.unit, p.scanned_face_down, p.character, p.block, p.meta,
    j.stage, j.status, f.pair IS NOT NULL AS has_failure
FROM pair AS p LEFT JOIN job AS j ON j.pair = p.id LEFT JOIN failure AS f ON f.pair = p.id
WHERE p.id > ?1 ORDER BY p.id LIMIT ?2";

pub(crate) const RESULTS: &str = "
SELECT r.pair, r.stage, r.outcome, r.files, r.result_hash
FROM json_each(?1) AS wanted CROSS JOIN stage_result AS r ON r.pair = wanted.value";

const METRICS: &str = "
SELECT m.* FROM json_each(?1) AS wanted CROSS JOIN metric_result AS m ON m.pair = wanted.value";

impl Catalog {
    /// Runs SQLite's integrity check. Returns at most 50 faults, or none if the file is sound. With `quick`, does not
    /// compare indexes with their tables.
    ///
    /// # Errors
    /// Returns an error if the disk fails to read part of the file, or if SQLite reports an error other than damage.
    pub async fn integrity(&self, quick: bool) -> Result<Vec<String>> {
        let mut conn = self.read_conn().await?;
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
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn broken_references(&self) -> Result<Vec<String>> {
        let mut conn = self.read_conn().await?;
        let lines = sqlx::query_scalar(REFERENCES).bind(LINES as i64);
        Ok(lines.fetch_all(&mut *conn).await?)
    }

    /// Compares the tables, indexes and triggers with the schema of this program. Returns one line for each difference.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn schema_differences(&self) -> Result<Vec<String>> {
        let mut conn = self.read_conn().await?;
        let found = objects(&mut conn).await?;
        let wanted = wanted_objects().await?;
        let gone = wanted.keys().filter(|name| !found.contains_key(*name));
        let gone = gone.map(|name| format!("{name} is missing"));
        let other = found
            .iter()
            .filter_map(|(name, sql)| match wanted.get(name) {
                None => Some(format!("{name} does not belong to this program")),
                Some(wanted) if wanted != sql => {
                    Some(format!("{name} differs from its definition"))
                }
                Some(_) => None,
            });
        Ok(gone.chain(other).collect())
    }

    /// Compares the counters, and the fingerprint and dirty mark of each job, with the rows they are derived from. With
    /// `quick`, checks only the counters, because the other checks read all results.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
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
            let pairs: i64 = sqlx::query_scalar(sql).fetch_one(&mut *conn).await?;
            if pairs > 0 {
                marks.push(format!("{pairs} pairs {what}"));
            }
        }
        Ok(Drift { counters, marks })
    }

    /// Reads up to `limit` pairs with ids above `after`.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn audit_page(&self, after: Option<PairId>, limit: usize) -> Result<AuditPage> {
        let mut conn = self.snapshot().await?;
        let query = sqlx::query(PAGE).bind(after.map_or(0, |pair| pair.0));
        let found = query.bind(limit as i64).fetch_all(&mut *conn).await?;
        let mut page = AuditPage::default();
        for row in &found {
            let id = PairId(row.try_get("id")?);
            page.last = Some(id);
            match pair(row) {
                Ok(pair) => page.pairs.push(pair),
                Err(error) => page.unreadable.push((id, error.to_string())),
            }
        }
        let ids = json_array(page.pairs.iter().map(|pair| pair.inputs.pair.0));
        let mut results = stored_results(&mut conn, &ids).await?;
        let mut metrics = stored_metrics(&mut conn, &ids).await?;
        for pair in &mut page.pairs {
            let id = pair.inputs.pair.0;
            pair.results = results.remove(&id).unwrap_or_default();
            pair.metrics = metrics.remove(&id).unwrap_or_default();
        }
        Ok(page)
    }
}

/// Compares the counters with the jobs.
async fn counter_drift(conn: &mut SqliteConnection) -> Result<Vec<CounterDrift>> {
    let stored: Vec<JobGroup> = sqlx::query_as(COUNTERS).fetch_all(&mut *conn).await?;
    let stored: BTreeMap<_, _> = stored.iter().map(|group| (group.key, group.n)).collect();
    let counted = count_jobs(conn).await?;
    let fingerprints: Vec<(i64, i64)> = sqlx::query_as(FINGERPRINTS).fetch_all(conn).await?;
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

/// Returns tables, indexes and triggers by kind and name, with their SQL.
pub(crate) async fn objects(conn: &mut SqliteConnection) -> Result<BTreeMap<String, String>> {
    let found: Vec<(String, String)> = sqlx::query_as(OBJECTS).fetch_all(conn).await?;
    Ok(found.into_iter().collect())
}

/// Returns the [`objects`] of a new catalog.
pub(crate) async fn wanted_objects() -> Result<BTreeMap<String, String>> {
    let options = SqliteConnectOptions::new().in_memory(true);
    let mut conn = options.connect().await?;
    open::MIGRATOR.run(&mut conn).await?;
    objects(&mut conn).await
}

fn pair(row: &SqliteRow) -> Result<AuditedPair> {
    // Every column must be readable, also those that are not checked otherwise.
    PairAttributes::from_row(row)?;
    let status: Option<JobStatus> = row.try_get("status")?;
    Ok(AuditedPair {
        name: row.try_get("name")?,
        inputs: pair_work::known_inputs(row)?,
        job: status.zip(row.try_get("stage")?),
        has_failure: row.try_get("has_failure")?,
        results: BTreeMap::new(),
        metrics: BTreeMap::new(),
    })
}

/// Returns the results by pair and stage. Leaves out rows with invalid values.
async fn stored_results(
    conn: &mut SqliteConnection,
    pairs: &str,
) -> Result<BTreeMap<i64, BTreeMap<Stage, AuditedResult>>> {
    let query = sqlx::query(RESULTS).bind(pairs);
    let mut results: BTreeMap<i64, BTreeMap<_, _>> = BTreeMap::new();
    for row in &query.fetch_all(conn).await? {
        if let (Ok(stage), Ok(result)) = (row.try_get("stage"), AuditedResult::from_row(row)) {
            let of_pair = results.entry(row.try_get("pair")?).or_default();
            of_pair.insert(stage, result);
        }
    }
    Ok(results)
}

/// Returns the rows of the metrics by pair. Leaves out rows with invalid values.
async fn stored_metrics(
    conn: &mut SqliteConnection,
    pairs: &str,
) -> Result<BTreeMap<i64, BTreeMap<ThresholdMetric, MetricResult>>> {
    let query = sqlx::query(METRICS).bind(pairs);
    let mut metrics: BTreeMap<i64, BTreeMap<_, _>> = BTreeMap::new();
    for row in &query.fetch_all(conn).await? {
        if let Ok(result) = metric(row) {
            let of_pair = metrics.entry(row.try_get("pair")?).or_default();
            of_pair.insert(result.outcome.metric, result);
        }
    }
    Ok(metrics)
}

fn metric(row: &SqliteRow) -> Result<MetricResult> {
    Ok(MetricResult {
        outcome: MetricOutcome {
            metric: row.try_get("metric")?,
            threshold_level: row.try_get("threshold_level")?,
            threshold_depth: row.try_get("threshold_depth")?,
            print_from_depth: row.try_get("print_from_depth")?,
            angle_deg: row.try_get("angle_deg")?,
            scale: row.try_get("scale")?,
            shift_px: [row.try_get("shift_x_px")?, row.try_get("shift_y_px")?],
            scores: Scores {
                ssim: row.try_get("ssim")?,
                nl_ssim: row.try_get("nl_ssim")?,
                iou: row.try_get("iou")?,
                iou_box: row.try_get("iou_box")?,
                dice: row.try_get("dice")?,
                density_print: row.try_get("density_print")?,
                density_depth: row.try_get("density_depth")?,
            },
            margin: row.try_get("margin")?,
            confidence: row.try_get("confidence")?,
            at_bound: row.try_get("at_bound")?,
        },
        result_hash: row.try_get("result_hash")?,
    })
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
