//! Stores finished stages in PostgreSQL. One statement advances the jobs and stores their results, so a checkpoint takes
//! one round trip and commits by itself.

use std::sync::LazyLock;

use sqlx::postgres::PgArguments;
use sqlx::{AssertSqlSafe, PgConnection};

use crate::db::column_arrays::{ArrayParameters, column_arrays};
use crate::db::error::Result;
use crate::db::error_kind::CatalogErrorKind;
use crate::db::query::limited;
use crate::db::row::{FromRow as _, Row};
use crate::queue::checkpoint::AdvancedJob;
use crate::queue::lease::{ADVANCED_ON_SERVER, FencedRow, LeasedCheckpoints};
use crate::queue::stage_record::{MetricResult, StageCheckpoint};
use mocban_core::domain::{ContentHash, InputVersion};
use mocban_system::failpoint::{self, Point};

column_arrays! {
    /// A job to advance.
    JobRow,
    /// Jobs to advance.
    JobRows<'i>:
    // From 1.
    position: "bigint" = i64,
    pair: "bigint" = i64,
    worker: "bigint" = i64,
    token: "bigint" = i64,
    stage: "bigint" = i64,
    counted_fingerprint: "bigint" = i64,
    next: "bigint" = i64,
    status: "bigint" = i64,
    fingerprint: "bigint" = i64,
    first: "bigint" = Option<i64>,
    mixed: "bigint" = i64,
    low_confidence: "bigint" = i64,
    deadline: "bigint" = Option<i64>,
    alive_since: "bigint" = i64,
    has_failure: "boolean" = bool,
    // Names of the stored metrics, separated by commas. NULL without the last stage.
    metrics: "text" = Option<String>,
    mesh_hash: "bytea" = Option<&'i [u8]>,
    mesh_stat: "text" = Option<&'i str>,
    print_hash: "bytea" = Option<&'i [u8]>,
    print_stat: "text" = Option<&'i str>,
}

column_arrays! {
    /// A result of a stage.
    ResultRow,
    /// Results of stages.
    ResultRows<'i>:
    // Position of the job.
    position: "bigint" = i64,
    pair: "bigint" = i64,
    stage: "bigint" = i64,
    worker: "bigint" = i64,
    fingerprint: "bigint" = i64,
    mesh_hash: "bytea" = Option<&'i [u8]>,
    print_hash: "bytea" = Option<&'i [u8]>,
    attributes: "text" = &'i str,
    outcome: "text" = &'i str,
    files: "text" = String,
    result_hash: "bytea" = &'i [u8],
    ms: "bigint" = i64,
    at: "bigint" = i64,
    // Whether the stage was not computed again under the same lease.
    is_last: "boolean" = bool,
}

column_arrays! {
    /// The hash of a metric's result, and the numbers by which lists are sorted.
    MetricRow,
    /// Rows of metrics.
    MetricRows<'i>:
    position: "bigint" = i64,
    pair: "bigint" = i64,
    metric: "text" = &'static str,
    result_hash: "bytea" = &'i [u8],
    confidence: "double precision" = Option<f64>,
    iou: "double precision" = f64,
}

/// Columns of an attempt.
const ATTEMPT: [&str; 6] = ["position", "pair", "stage", "worker", "ms", "at"];

/// Stores checkpoints of jobs that may have earlier results or a failure.
static STORE: LazyLock<String> = LazyLock::new(|| statement(false));

/// Stores checkpoints of jobs without them, in less time. The server refuses it if there are earlier results.
static STORE_FIRST: LazyLock<String> = LazyLock::new(|| statement(true));

/// Returns a statement that advances jobs whose lease is valid, and stores their results, metrics, attempts, input versions
/// and counters. It returns the advanced jobs.
fn statement(is_first: bool) -> String {
    let jobs = ArrayParameters {
        columns: JobRows::COLUMNS,
        first: 1,
    };
    let results = ArrayParameters {
        columns: ResultRows::COLUMNS,
        first: jobs.end(),
    };
    let metrics = ArrayParameters {
        columns: MetricRows::COLUMNS,
        first: results.end(),
    };
    let result_columns = stored_columns(results);
    let metric_columns = stored_columns(metrics);
    let is_advanced = "row.position = ANY (ARRAY(SELECT position FROM advanced))";
    let [replace_result, replace_metric, remove_earlier] = if is_first {
        [const { String::new() }; 3]
    } else {
        [
            replace(["pair", "stage"], &result_columns),
            replace(["pair", "metric"], &metric_columns),
            REMOVE_EARLIER.to_owned(),
        ]
    };
    format!(
        "
WITH item AS {jobs},{ADVANCED_ON_SERVER},
result AS (
    INSERT INTO stage_result ({result_columns})
    SELECT {result_columns}
    FROM {results} AS row WHERE is_last AND {is_advanced}{replace_result}),
attempted AS (
    INSERT INTO attempt (pair, stage, worker, ms, at)
    SELECT pair, stage, worker, ms, at FROM {attempts} AS row WHERE {is_advanced}),
metric AS (
    INSERT INTO metric_result ({metric_columns})
    SELECT {metric_columns} FROM {metrics} AS row WHERE {is_advanced}{replace_metric}),{remove_earlier}
input AS (
    UPDATE pair SET mesh_hash = coalesce(new.mesh_hash, pair.mesh_hash),
        mesh_stat = coalesce(new.mesh_stat, pair.mesh_stat), print_hash = coalesce(new.print_hash, pair.print_hash),
        print_stat = coalesce(new.print_stat, pair.print_stat)
    FROM advanced AS new
    WHERE pair.id = new.pair AND (new.mesh_hash <> coalesce(pair.mesh_hash, '') OR new.mesh_stat <> coalesce(pair.mesh_stat, '')
        OR new.print_hash <> coalesce(pair.print_hash, '') OR new.print_stat <> coalesce(pair.print_stat, ''))),
counted AS (
    INSERT INTO counter_part (stage, status, fingerprint, n)
    SELECT moved.stage, moved.status, moved.fingerprint, sum(moved.n)
    FROM advanced AS a CROSS JOIN LATERAL (VALUES
        (a.stage, 1, a.counted_fingerprint, -1), (a.next, a.status, a.fingerprint, 1)) AS moved (stage, status, fingerprint, n)
    GROUP BY 1, 2, 3 ORDER BY 1, 2, 3
    ON CONFLICT (slot, stage, status, fingerprint) DO UPDATE SET n = counter_part.n + excluded.n)
SELECT pair AS unit, token FROM advanced",
        jobs = jobs.rows(),
        results = results.rows(),
        result_columns = result_columns.join(", "),
        attempts = results.rows_of(&ATTEMPT),
        metrics = metrics.rows(),
        metric_columns = metric_columns.join(", "),
    )
}

/// Returns the columns of a table among those of its rows.
fn stored_columns(rows: ArrayParameters) -> Vec<&'static str> {
    let names = rows.columns.iter().map(|(name, _)| *name);
    names
        .filter(|name| !["position", "is_last"].contains(name))
        .collect()
}

/// Removes metrics that the new method does not compute, and the last failure.
const REMOVE_EARLIER: &str = "
removed AS (
    DELETE FROM metric_result AS old USING advanced
    WHERE old.pair = advanced.pair AND old.metric <> ALL (string_to_array(advanced.metrics, ','))),
unfailed AS (
    DELETE FROM failure USING advanced WHERE failure.pair = advanced.pair AND advanced.has_failure),";

/// Returns the end of an `INSERT` that replaces rows with the same key.
fn replace(key: [&str; 2], columns: &[&str]) -> String {
    let others = columns.iter().filter(|column| !key.contains(column));
    let set: Vec<_> = others
        .map(|column| format!("{column} = excluded.{column}"))
        .collect();
    let (key, set) = (key.join(", "), set.join(", "));
    format!("\n    ON CONFLICT ({key}) DO UPDATE SET {set}")
}

/// Returns the statements that store checkpoints.
#[cfg(test)]
pub(crate) fn texts() -> [String; 2] {
    [false, true].map(statement)
}

/// Stores finished stages of several jobs. Jobs without a valid lease are skipped, with all their results. Returns the
/// other jobs.
///
/// # Errors
/// Returns an error if a database operation fails. Then nothing is stored.
pub(crate) async fn store(
    conn: &mut PgConnection,
    checkpoints: &[&LeasedCheckpoints],
) -> Result<Vec<FencedRow>> {
    if checkpoints.iter().all(|checkpoint| is_first(checkpoint)) {
        match store_with(conn, &STORE_FIRST, checkpoints).await {
            Err(error) if error.kind() == Some(CatalogErrorKind::Contradiction) => {}
            stored => return stored,
        }
    }
    store_with(conn, &STORE, checkpoints).await
}

/// Returns whether the pair should have no results of these stages and no failure. This is its first lease, under which a
/// stage is stored twice only if it was computed again, and a failure ends a lease.
fn is_first((lease, stages): &LeasedCheckpoints) -> bool {
    lease.token == 1
        && stages
            .first()
            .is_none_or(|first| first.stage >= lease.cursor)
        && stages.windows(2).all(|two| two[0].stage < two[1].stage)
}

async fn store_with(
    conn: &mut PgConnection,
    statement: &'static str,
    checkpoints: &[&LeasedCheckpoints],
) -> Result<Vec<FencedRow>> {
    let (mut jobs, mut results, mut metrics) = (
        JobRows::default(),
        ResultRows::default(),
        MetricRows::default(),
    );
    for checkpoint in checkpoints {
        let Some(job) = AdvancedJob::of(checkpoint) else {
            continue;
        };
        let position = jobs.pair.len() as i64 + 1;
        let (lease, stages) = checkpoint;
        jobs.push(job_row(position, job, checkpoint));
        for (at, one) in stages.iter().enumerate() {
            failpoint::hit(one.stage, Point::Recorded, None);
            let is_last = !stages[at + 1..]
                .iter()
                .any(|later| later.stage == one.stage);
            results.push(result_row(position, job, one, is_last)?);
            let metrics_of_last = one.metrics.iter().filter(|_| is_last);
            for metric in metrics_of_last {
                metrics.push(metric_row(position, lease.unit.0, metric));
            }
        }
    }
    let mut arguments = PgArguments::default();
    jobs.bind(&mut arguments)?;
    results.bind(&mut arguments)?;
    metrics.bind(&mut arguments)?;
    let query = sqlx::query_with(AssertSqlSafe(statement), arguments);
    let rows = limited(query.fetch_all(conn)).await?.into_iter();
    rows.map(|row| FencedRow::from_row(&Row::Postgres(row)))
        .collect()
}

fn job_row<'i>(
    position: i64,
    job: AdvancedJob,
    (lease, stages): &'i LeasedCheckpoints,
) -> JobRow<'i> {
    let mut metrics = stages.iter().rev().map(|one| &one.metrics);
    let metrics = metrics.find(|metrics| !metrics.is_empty());
    let names = |metrics: &Vec<MetricResult>| {
        let names = metrics.iter().map(|metric| metric.outcome.metric.name());
        names.collect::<Vec<_>>().join(",")
    };
    // The last stage with inputs also lists the inputs of all earlier stages.
    let mut inputs = stages.iter().rev().map(|one| &one.inputs);
    let inputs = inputs.find(|inputs| !inputs.is_empty());
    let mesh = inputs.and_then(|inputs| inputs.mesh.as_ref());
    let print = inputs.and_then(|inputs| inputs.print.as_ref());
    let hash = |version: &'i InputVersion| version.hash.as_bytes().as_slice();
    JobRow {
        position,
        pair: job.unit,
        worker: job.worker,
        token: job.token,
        stage: job.stage,
        counted_fingerprint: lease.counter_key().fingerprint,
        next: job.next,
        status: job.status,
        fingerprint: job.fingerprint,
        first: job.first,
        mixed: job.mixed,
        low_confidence: job.low_confidence,
        deadline: job.deadline,
        alive_since: job.alive_since,
        has_failure: !lease.cleared,
        metrics: metrics.map(names),
        mesh_hash: mesh.map(hash),
        mesh_stat: mesh.map(|version| version.stat.as_str()),
        print_hash: print.map(hash),
        print_stat: print.map(|version| version.stat.as_str()),
    }
}

fn result_row(
    position: i64,
    job: AdvancedJob,
    one: &StageCheckpoint,
    is_last: bool,
) -> Result<ResultRow<'_>> {
    Ok(ResultRow {
        position,
        pair: job.unit,
        stage: one.stage.index() as i64,
        worker: job.worker,
        fingerprint: one.provenance.fingerprint.0,
        mesh_hash: bytes(one.provenance.mesh_hash.as_ref()),
        print_hash: bytes(one.provenance.print_hash.as_ref()),
        attributes: &one.provenance.attributes,
        outcome: &one.outcome,
        files: serde_json::to_string(&one.files)?,
        result_hash: one.result_hash.as_bytes(),
        ms: one.ms as i64,
        at: one.at,
        is_last,
    })
}

fn bytes(hash: Option<&ContentHash>) -> Option<&[u8]> {
    hash.map(|hash| hash.as_bytes().as_slice())
}

fn metric_row(position: i64, pair: i64, result: &MetricResult) -> MetricRow<'_> {
    MetricRow {
        position,
        pair,
        metric: result.outcome.metric.name(),
        result_hash: result.result_hash.as_bytes(),
        confidence: result.outcome.confidence,
        iou: result.outcome.scores.iou,
    }
}
