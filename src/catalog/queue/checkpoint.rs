//! Statements that store finished stages, fenced by the lease.

use serde::Serialize;
use serde_json::json;

use crate::catalog::db::error::Result;
use crate::catalog::db::script::{Script, Statement};
use crate::catalog::queue::counters::{CounterKey, Cursor, DONE, Deltas, cursor};
use crate::catalog::queue::lease::{
    FencedRow, FingerprintId, InputVersions, Lease, StageCheckpoint,
};
use crate::domain::{ContentHash, JobStatus, MetricOutcome, PairId, Stage, UnixMillis};
use crate::failpoint::{self, Point};

/// A lease and the stages to be stored under it, in the order they were computed.
pub(crate) type LeasedCheckpoints = (Lease, Vec<StageCheckpoint>);

/// Advances jobs whose lease still holds and whose worker is alive. A stage that succeeds clears the suspicion that the
/// pair kills workers. A result that does not follow on the one before marks the job dirty.
pub(crate) const ADVANCE: &str = "
UPDATE job SET stage = item.value ->> 'next', status = item.value ->> 'status',
    worker = iif(item.value ->> 'next' = 4, NULL, worker), deadline = item.value ->> 'deadline',
    attempt = 1, crashes = 0, exclusive = 0, low_confidence = item.value ->> 'low_confidence',
    fingerprint = item.value ->> 'fingerprint',
    dirty = dirty OR item.value ->> 'mixed' OR ((item.value ->> 'first') IS NOT NULL
        AND job.fingerprint IS NOT (SELECT upstream FROM fingerprint WHERE id = item.value ->> 'first'))
FROM jsonb_each(?) AS item
WHERE job.pair = item.value ->> 'pair' AND job.worker = item.value ->> 'worker'
    AND job.token = item.value ->> 'token' AND job.status = 1 AND EXISTS (
        SELECT 1 FROM worker AS w
        WHERE w.id = job.worker AND w.ended IS NULL AND w.heartbeat >= item.value ->> 'alive_since')
RETURNING pair, token";

const RESULT: &str = "
INSERT INTO stage_result
    (pair, stage, fingerprint, mesh_hash, print_hash, attributes, outcome, files, result_hash, ms, worker, at)
SELECT value ->> 'pair', value ->> 'stage', value ->> 'fingerprint', unhex(value ->> 'mesh_hash'),
    unhex(value ->> 'print_hash'), value ->> 'attributes', value ->> 'outcome', value ->> 'files',
    unhex(value ->> 'result_hash'), value ->> 'ms', value ->> 'worker', value ->> 'at'
FROM jsonb_each(?) WHERE true
ON CONFLICT (pair, stage) DO UPDATE SET fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash,
    print_hash = excluded.print_hash, attributes = excluded.attributes, outcome = excluded.outcome, files = excluded.files,
    result_hash = excluded.result_hash, ms = excluded.ms, worker = excluded.worker, at = excluded.at";

/// Removes old metrics first: another method may return fewer.
const CLEAR_METRICS: &str = "
DELETE FROM metric_result WHERE pair IN (SELECT value ->> 0 FROM jsonb_each(?))";

const METRICS: &str = "
INSERT INTO metric_result
    (pair, metric, threshold_level, threshold_depth, print_from_depth, angle_deg, scale, shift_x_px, shift_y_px,
     ssim, nl_ssim, iou, iou_box, dice, density_print, density_depth, margin, confidence, at_bound, result_hash)
SELECT value ->> 'pair', value ->> '$.row.metric', value ->> '$.row.threshold_level',
    value ->> '$.row.threshold_depth', value -> '$.row.print_from_depth', value ->> '$.row.angle_deg',
    value ->> '$.row.scale', value ->> '$.row.shift_px[0]', value ->> '$.row.shift_px[1]',
    value ->> '$.row.scores.ssim', value ->> '$.row.scores.nl_ssim', value ->> '$.row.scores.iou',
    value ->> '$.row.scores.iou_box', value ->> '$.row.scores.dice', value ->> '$.row.scores.density_print',
    value ->> '$.row.scores.density_depth', value ->> '$.row.margin', value ->> '$.row.confidence',
    value ->> '$.row.at_bound', unhex(value ->> 'result_hash')
FROM jsonb_each(?)";

const ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, ms, at)
SELECT value ->> 0, value ->> 1, value ->> 2, value ->> 3, value ->> 4 FROM jsonb_each(?)";

/// Updates the input files of pairs.
pub(crate) const UPDATE_INPUTS: &str = "
UPDATE pair SET mesh_hash = coalesce(unhex(item.value ->> 'mesh_hash'), mesh_hash),
    mesh_stat = coalesce(item.value ->> 'mesh_stat', mesh_stat),
    print_hash = coalesce(unhex(item.value ->> 'print_hash'), print_hash),
    print_stat = coalesce(item.value ->> 'print_stat', print_stat)
FROM jsonb_each(?) AS item WHERE pair.id = item.value ->> 'pair' AND (
    pair.mesh_hash IS NOT unhex(item.value ->> 'mesh_hash') OR pair.mesh_stat IS NOT item.value ->> 'mesh_stat'
    OR pair.print_hash IS NOT unhex(item.value ->> 'print_hash') OR pair.print_stat IS NOT item.value ->> 'print_stat')";

const CLEAR_FAILURE: &str =
    "DELETE FROM failure WHERE pair IN (SELECT value ->> 0 FROM jsonb_each(?))";

/// The statements of [`add_results`].
#[cfg(test)]
pub(crate) const ROWS: [&str; 6] = [
    RESULT,
    CLEAR_METRICS,
    METRICS,
    ATTEMPT,
    UPDATE_INPUTS,
    CLEAR_FAILURE,
];

/// Adds the advance of jobs to a script; it returns those whose lease still held.
pub(crate) fn add_advance<'i>(
    script: &mut Script,
    checkpoints: impl Iterator<Item = &'i LeasedCheckpoints>,
) -> Result<Option<Statement<FencedRow>>> {
    script.add_over(ADVANCE, checkpoints.filter_map(advanced_job))
}

/// Adds the results of jobs that advanced to a script.
pub(crate) fn add_results(
    script: &mut Script,
    advanced: &[&LeasedCheckpoints],
    deltas: &mut Deltas,
) -> Result<()> {
    for (lease, stages) in advanced.iter().map(|stored| &**stored) {
        for one in stages {
            failpoint::hit(one.stage, Point::Recorded, None);
        }
        if let Some(last) = stages.last() {
            deltas.move_job(lease.counter_key(), key_after(last));
        }
    }
    let each = || advanced.iter().flat_map(|stored| each_stage(stored));
    script.execute_over(RESULT, each().map(result_row))?;
    script.execute_over(ATTEMPT, each().map(attempt_row))?;
    let uncleared = advanced.iter().filter(|(lease, _)| !lease.cleared);
    let uncleared = uncleared.map(|(lease, _)| [lease.pair.0]);
    script.execute_over(CLEAR_FAILURE, uncleared)?;
    let metrics = || each().flat_map(metric_rows);
    script.execute_over(CLEAR_METRICS, metrics().map(|row| [row.pair]))?;
    script.execute_over(METRICS, metrics())?;
    let inputs = advanced.iter().filter_map(|(lease, stages)| {
        // The last stage that names inputs names all that earlier ones did.
        let mut inputs = stages.iter().rev().map(|one| &one.inputs);
        Some((lease.pair, inputs.find(|inputs| !inputs.is_empty())?))
    });
    add_inputs(script, inputs)
}

/// Pairs each stage with its lease.
fn each_stage(
    (lease, done): &LeasedCheckpoints,
) -> impl Iterator<Item = (&Lease, &StageCheckpoint)> {
    done.iter().map(move |one| (lease, one))
}

/// Returns where a job is counted when a stage is stored.
fn key_after(stage: &StageCheckpoint) -> CounterKey {
    let (cursor, status) = match stage.stage.next() {
        Some(next) => (cursor(next), JobStatus::Leased),
        None => (DONE, JobStatus::Done),
    };
    CounterKey::new(cursor, status, Some(stage.fingerprint.0))
}

/// One item of [`ADVANCE`].
#[derive(Serialize)]
struct AdvancedJob {
    pair: i64,
    worker: i64,
    token: i64,
    next: Cursor,
    status: i64,
    /// Fingerprint of the last result.
    fingerprint: i64,
    /// The fingerprint whose upstream must be that of the result before; `None` where there is no result before.
    first: Option<i64>,
    /// Whether the stages do not follow on each other.
    mixed: i64,
    low_confidence: i64,
    deadline: Option<UnixMillis>,
    alive_since: UnixMillis,
}

/// Combines all stages that are stored at once; `None` for no stage.
fn advanced_job((lease, stages): &LeasedCheckpoints) -> Option<AdvancedJob> {
    let last = stages.last()?;
    let after = key_after(last);
    let metrics = &mut last.metrics.iter();
    let (first, follow) = chain(stages);
    Some(AdvancedJob {
        pair: lease.pair.0,
        worker: lease.worker.0,
        token: lease.token,
        next: after.cursor,
        status: after.status.code(),
        fingerprint: after.fingerprint,
        first: first.map(|FingerprintId(id)| id),
        mixed: i64::from(!follow),
        low_confidence: i64::from(metrics.any(|metric| metric.outcome.is_low_confidence())),
        deadline: (after.status == JobStatus::Leased).then_some(last.next_deadline),
        alive_since: last.alive_since,
    })
}

/// Returns the fingerprint of the first stage, `None` if that is the first stage of all, and whether the stages follow
/// on each other.
fn chain(stages: &[StageCheckpoint]) -> (Option<FingerprintId>, bool) {
    let restart = stages.iter().rposition(|one| one.stage == Stage::Fit);
    let chain = &stages[restart.unwrap_or(0)..];
    let follow = |two: &[StageCheckpoint]| two[0].stage.next() == Some(two[1].stage);
    let first = restart.is_none().then(|| chain.first()).flatten();
    (
        first.map(|one| one.fingerprint),
        chain.windows(2).all(follow),
    )
}

/// One item of [`RESULT`].
#[derive(Serialize)]
struct ResultRow<'d> {
    pair: i64,
    stage: usize,
    fingerprint: i64,
    mesh_hash: ContentHash,
    print_hash: Option<ContentHash>,
    attributes: &'d str,
    outcome: &'d str,
    files: String,
    result_hash: ContentHash,
    ms: u64,
    worker: i64,
    at: UnixMillis,
}

fn result_row<'d>((lease, done): (&Lease, &'d StageCheckpoint)) -> ResultRow<'d> {
    ResultRow {
        pair: lease.pair.0,
        stage: done.stage.index(),
        fingerprint: done.fingerprint.0,
        mesh_hash: done.mesh_hash,
        print_hash: done.print_hash,
        attributes: &done.attributes,
        outcome: &done.outcome,
        files: json!(done.files).to_string(),
        result_hash: done.result_hash,
        ms: done.ms,
        worker: lease.worker.0,
        at: done.at,
    }
}

/// One item of [`ATTEMPT`]: pair, stage, worker, milliseconds, time.
type Attempt = (i64, usize, i64, u64, UnixMillis);

const fn attempt_row((lease, done): (&Lease, &StageCheckpoint)) -> Attempt {
    let stage = done.stage.index();
    (lease.pair.0, stage, lease.worker.0, done.ms, done.at)
}

/// One item of [`METRICS`].
#[derive(Serialize)]
struct MetricResultRow<'d> {
    pair: i64,
    row: &'d MetricOutcome,
    result_hash: ContentHash,
}

fn metric_rows<'d>(
    (lease, done): (&'d Lease, &'d StageCheckpoint),
) -> impl Iterator<Item = MetricResultRow<'d>> {
    done.metrics.iter().map(|metric| MetricResultRow {
        pair: lease.pair.0,
        row: &metric.outcome,
        result_hash: metric.result_hash,
    })
}

/// Adds the input files of pairs as they were read to a script.
pub(crate) fn add_inputs<'a>(
    script: &mut Script,
    inputs: impl Iterator<Item = (PairId, &'a InputVersions)>,
) -> Result<()> {
    let items = inputs.filter(|(_, inputs)| !inputs.is_empty());
    script.execute_over(
        UPDATE_INPUTS,
        items.map(|(pair, inputs)| input_row(pair, inputs)),
    )
}

/// One item of [`UPDATE_INPUTS`].
#[derive(Serialize)]
pub(crate) struct InputRow<'s> {
    pair: i64,
    mesh_hash: Option<ContentHash>,
    mesh_stat: Option<&'s str>,
    print_hash: Option<ContentHash>,
    print_stat: Option<&'s str>,
}

pub(crate) fn input_row(PairId(pair): PairId, seen: &InputVersions) -> InputRow<'_> {
    let (mesh, print) = (seen.mesh.as_ref(), seen.print.as_ref());
    InputRow {
        pair,
        mesh_hash: mesh.map(|seen| seen.hash),
        mesh_stat: mesh.map(|seen| seen.stat.as_str()),
        print_hash: print.map(|seen| seen.hash),
        print_stat: print.map(|seen| seen.stat.as_str()),
    }
}
