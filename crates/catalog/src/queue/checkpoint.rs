//! Statements that store finished stages in SQLite if the lease is still valid, and what they share with those for
//! PostgreSQL.

use serde::Serialize;
use serde_json::{Value, json};

use crate::db::dialect::Sql;
use crate::db::error::Result;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{CounterKey, Cursor, DONE, Deltas, cursor};
use crate::queue::lease::{FencedRow, FingerprintId, InputVersions, Lease, StageCheckpoint};
use mocban_core::domain::{
    ContentHash, JobStatus, MetricOutcome, PairId, Stage, ThresholdMetric, UnixMillis, WorkerId,
};
use mocban_system::failpoint::{self, Point};

/// A lease, and the finished stages to store under it, in the order they were computed.
pub(crate) type LeasedCheckpoints = (Lease, Vec<StageCheckpoint>);

/// Advances jobs. Skips a job if its lease was lost or its worker counts as dead. Resets the pair's crash count. Marks
/// a job dirty if the new results do not build on the stored ones: see [`AdvancedJob`].
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

/// Items: [`ResultItem`].
const RESULT: &str = "
INSERT INTO stage_result
    (pair, stage, worker, fingerprint, mesh_hash, print_hash, attributes, outcome, files, result_hash, ms, at)
SELECT value ->> 'pair', value ->> 'index', value ->> 'worker', value ->> 'fingerprint', unhex(value ->> 'mesh_hash'),
    unhex(value ->> 'print_hash'), value ->> 'attributes', value ->> 'outcome', value -> 'files',
    unhex(value ->> 'result_hash'), value ->> 'ms', value ->> 'at'
FROM jsonb_each(?) WHERE true
ON CONFLICT (pair, stage) DO UPDATE SET fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash,
    print_hash = excluded.print_hash, attributes = excluded.attributes, outcome = excluded.outcome, files = excluded.files,
    result_hash = excluded.result_hash, ms = excluded.ms, worker = excluded.worker, at = excluded.at";

/// Removes the old metrics, because the new method may compute fewer.
const CLEAR_METRICS: &str = "
DELETE FROM metric_result WHERE pair IN (SELECT value ->> 0 FROM jsonb_each(?))";

/// Items: [`MetricItem`].
const METRICS: &str = "
INSERT INTO metric_result
    (pair, metric, threshold_level, threshold_depth, print_from_depth, angle_deg, scale, shift_x_px, shift_y_px,
     ssim, nl_ssim, iou, iou_box, dice, density_print, density_depth, disagreements, missing_ink,
     missing_wood, margin, confidence, at_bound, result_hash)
SELECT value ->> 'pair', value ->> 'metric', value ->> 'threshold_level',
    value ->> 'threshold_depth', value -> 'print_from_depth', value ->> 'angle_deg',
    value ->> 'scale', value ->> '$.shift_px[0]', value ->> '$.shift_px[1]',
    value ->> '$.scores.ssim', value ->> '$.scores.nl_ssim', value ->> '$.scores.iou',
    value ->> '$.scores.iou_box', value ->> '$.scores.dice', value ->> '$.scores.density_print',
    value ->> '$.scores.density_depth', value ->> '$.disagreement.pieces',
    value ->> '$.disagreement.missing_ink', value ->> '$.disagreement.missing_wood',
    value ->> 'margin', value ->> 'confidence', value ->> 'at_bound', unhex(value ->> 'hash')
FROM jsonb_each(?)";

/// Items: pair, index of the stage, worker, milliseconds, time.
const ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, ms, at)
SELECT value ->> 0, value ->> 1, value ->> 2, value ->> 3, value ->> 4 FROM jsonb_each(?)";

/// Updates the input files of pairs. Items: see [`input_item`].
pub(crate) const UPDATE_INPUTS: Sql = Sql::pair(
    "
UPDATE pair SET mesh_hash = coalesce(new.mesh_hash, pair.mesh_hash), mesh_stat = coalesce(new.mesh_stat, pair.mesh_stat),
    print_hash = coalesce(new.print_hash, pair.print_hash), print_stat = coalesce(new.print_stat, pair.print_stat)
FROM (
    SELECT value ->> 'pair' AS id, unhex(value ->> 'mesh_hash') AS mesh_hash, value ->> 'mesh_stat' AS mesh_stat,
        unhex(value ->> 'print_hash') AS print_hash, value ->> 'print_stat' AS print_stat FROM jsonb_each(?)) AS new
WHERE pair.id = new.id AND (pair.mesh_hash IS NOT new.mesh_hash OR pair.mesh_stat IS NOT new.mesh_stat
    OR pair.print_hash IS NOT new.print_hash OR pair.print_stat IS NOT new.print_stat)",
    "
UPDATE pair SET mesh_hash = coalesce(new.mesh_hash, pair.mesh_hash), mesh_stat = coalesce(new.mesh_stat, pair.mesh_stat),
    print_hash = coalesce(new.print_hash, pair.print_hash), print_stat = coalesce(new.print_stat, pair.print_stat)
FROM (
    SELECT pair AS id, decode(mesh_hash, 'hex') AS mesh_hash, mesh_stat, decode(print_hash, 'hex') AS print_hash,
        print_stat
    FROM json_to_recordset(CAST(? AS json)) AS item (pair bigint, mesh_hash text, mesh_stat text, print_hash text,
        print_stat text)) AS new
WHERE pair.id = new.id AND (pair.mesh_hash IS DISTINCT FROM new.mesh_hash OR pair.mesh_stat IS DISTINCT FROM new.mesh_stat
    OR pair.print_hash IS DISTINCT FROM new.print_hash OR pair.print_stat IS DISTINCT FROM new.print_stat)",
);

const CLEAR_FAILURE: &str =
    "DELETE FROM failure WHERE pair IN (SELECT value ->> 0 FROM jsonb_each(?))";

/// The statements of [`add_results`].
#[cfg(test)]
pub(crate) const ROWS: [&str; 6] = [
    RESULT,
    CLEAR_METRICS,
    METRICS,
    ATTEMPT,
    UPDATE_INPUTS.sqlite,
    CLEAR_FAILURE,
];

/// Adds the statement `ADVANCE` to a script. The statement returns one row for each job that it changed.
pub(crate) fn add_advance<'i>(
    script: &mut Script,
    checkpoints: impl Iterator<Item = &'i LeasedCheckpoints>,
) -> Result<Option<Statement<FencedRow>>> {
    script.add_over(ADVANCE, checkpoints.filter_map(AdvancedJob::of))
}

/// Adds the statements that store the results of advanced jobs to a script.
pub(crate) fn add_results<'i>(
    script: &mut Script,
    advanced: &[&'i LeasedCheckpoints],
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
    let each = || {
        let stored = advanced.iter();
        stored.flat_map(|(lease, stages)| stages.iter().map(move |one| (lease, one)))
    };
    let rows = |(lease, one): (&Lease, &'i StageCheckpoint)| ResultItem {
        pair: lease.pair,
        index: one.stage.index(),
        worker: lease.worker,
        result: one,
    };
    script.execute_over(RESULT, each().map(rows))?;
    let attempts = each().map(rows);
    let attempts = attempts.map(|row| {
        (
            row.pair,
            row.index,
            row.worker,
            row.result.ms,
            row.result.at,
        )
    });
    script.execute_over(ATTEMPT, attempts)?;
    let uncleared = advanced.iter().filter(|(lease, _)| !lease.cleared);
    script.execute_over(CLEAR_FAILURE, uncleared.map(|(lease, _)| [lease.pair]))?;
    let metrics = || {
        each().flat_map(|(lease, one)| {
            let metrics = one.metrics.iter();
            metrics.map(|metric| MetricItem {
                pair: lease.pair,
                hash: metric.result_hash,
                outcome: &metric.outcome,
            })
        })
    };
    script.execute_over(CLEAR_METRICS, metrics().map(|metric| [metric.pair]))?;
    script.execute_over(METRICS, metrics())?;
    let inputs = advanced.iter().filter_map(|(lease, stages)| {
        // The last stage with inputs also lists the inputs of all earlier stages.
        let mut inputs = stages.iter().rev().map(|one| &one.inputs);
        Some((lease.pair, inputs.find(|inputs| !inputs.is_empty())?))
    });
    add_inputs(script, inputs)
}

/// An item of [`RESULT`].
#[derive(Serialize)]
struct ResultItem<'i> {
    pair: PairId,
    index: usize,
    worker: WorkerId,
    #[serde(flatten)]
    result: &'i StageCheckpoint,
}

/// An item of [`METRICS`].
#[derive(Serialize)]
struct MetricItem<'i> {
    pair: PairId,
    hash: ContentHash,
    #[serde(flatten)]
    outcome: &'i MetricOutcome,
}

/// Builds an item of [`UPDATE_INPUTS`].
pub(crate) fn input_item((pair, inputs): (PairId, &InputVersions)) -> Value {
    let (mesh, print) = (inputs.mesh.as_ref(), inputs.print.as_ref());
    json!({
        "pair": pair, "mesh_hash": mesh.map(|seen| seen.hash), "mesh_stat": mesh.map(|seen| &seen.stat),
        "print_hash": print.map(|seen| seen.hash), "print_stat": print.map(|seen| &seen.stat),
    })
}

/// Returns the counter key of a job after a stage is stored.
fn key_after(stage: &StageCheckpoint) -> CounterKey {
    let (cursor, status) = match stage.stage.next() {
        Some(next) => (cursor(next), JobStatus::Leased),
        None => (DONE, JobStatus::Done),
    };
    CounterKey::new(cursor, status, Some(stage.fingerprint.0))
}

/// Returns the position and the status of a job after stages are stored, or `None` if there are none.
pub(crate) fn position_after(stages: &[StageCheckpoint]) -> Option<(Cursor, JobStatus)> {
    let after = key_after(stages.last()?);
    Some((after.cursor, after.status))
}

/// A job to advance, and its state afterwards. An item of [`ADVANCE`].
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct AdvancedJob {
    pub(crate) pair: i64,
    pub(crate) worker: i64,
    pub(crate) token: i64,
    /// Position under the lease.
    pub(crate) stage: Cursor,
    pub(crate) next: Cursor,
    pub(crate) status: i64,
    pub(crate) fingerprint: i64,
    /// The job becomes dirty if the upstream of this fingerprint is not the job's fingerprint.
    pub(crate) first: Option<i64>,
    /// The job becomes dirty if this is 1, because the stages are not consecutive.
    pub(crate) mixed: i64,
    pub(crate) low_confidence: i64,
    pub(crate) deadline: Option<UnixMillis>,
    pub(crate) alive_since: UnixMillis,
}

impl AdvancedJob {
    /// Describes a job after its checkpoint, or returns `None` if there are no stages.
    pub(crate) fn of((lease, stages): &LeasedCheckpoints) -> Option<Self> {
        let last = stages.last()?;
        let after = key_after(last);
        let low_confidence = last.metrics.iter().any(|metric| {
            metric.outcome.metric == ThresholdMetric::DEFAULT && metric.outcome.is_low_confidence()
        });
        let (first, follow) = chain(stages);
        Some(Self {
            pair: lease.pair.0,
            worker: lease.worker.0,
            token: lease.token,
            stage: cursor(lease.cursor),
            next: after.cursor,
            status: after.status.code(),
            fingerprint: after.fingerprint,
            first: first.map(|FingerprintId(id)| id),
            mixed: i64::from(!follow),
            low_confidence: i64::from(low_confidence),
            deadline: (after.status == JobStatus::Leased).then_some(last.next_deadline),
            alive_since: last.alive_since,
        })
    }
}

/// Returns the fingerprint of the first stage, and whether the stages are consecutive. Ignores the stages before the
/// last `Stage::Fit`, which begins a new chain. If the first stage is `Fit`, its fingerprint is returned as `None`.
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

/// Adds the statement that stores the input files of pairs to a script.
pub(crate) fn add_inputs<'a>(
    script: &mut Script,
    inputs: impl Iterator<Item = (PairId, &'a InputVersions)>,
) -> Result<()> {
    let known = inputs.filter(|(_, inputs)| !inputs.is_empty());
    script.execute_over(UPDATE_INPUTS, known.map(input_item))
}
