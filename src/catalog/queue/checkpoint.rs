//! Storing a finished stage: the job's step and the results, fenced by the lease.

use serde::Serialize;
use serde_json::json;

use crate::catalog::db::error::Result;
use crate::catalog::db::group_commit::Request;
use crate::catalog::db::script::Script;
use crate::catalog::db::writer::Message;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::counters::{Cursor, DONE, Deltas, cursor};
use crate::catalog::queue::lease::{
    CheckpointOutcome, FingerprintId, InputVersions, Lease, StageCheckpoint,
};
use crate::domain::{ContentHash, JobStatus, MetricOutcome, PairId, Stage, UnixMillis};
use crate::failpoint::{self, Point};

/// A lease and the stages to be stored under it, in the order they were computed.
pub(crate) type Steps = (Lease, Vec<StageCheckpoint>);

/// The job's step; only where the lease still holds and its worker has given a sign of life lately. Progress clears the pair of suspicion.
pub(crate) const STEP: &str = "
UPDATE job SET stage = item.value ->> 'next', status = item.value ->> 'status',
    worker = iif(item.value ->> 'next' = 4, NULL, worker), deadline = item.value ->> 'deadline',
    attempt = 1, crashes = 0, exclusive = 0, low_confidence = item.value ->> 'low_confidence',
    made = iif((item.value ->> 'first') IS NULL
        OR made = (SELECT upstream FROM fingerprint WHERE id = item.value ->> 'first'), item.value ->> 'made', NULL)
FROM jsonb_each(?1) AS item
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
FROM jsonb_each(?1) WHERE true
ON CONFLICT (pair, stage) DO UPDATE SET fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash,
    print_hash = excluded.print_hash, attributes = excluded.attributes, outcome = excluded.outcome, files = excluded.files,
    result_hash = excluded.result_hash, ms = excluded.ms, worker = excluded.worker, at = excluded.at";

/// A method may give fewer metrics than the one before; what it does not give is no result any more.
const CLEAR_METRICS: &str = "
DELETE FROM metric_result WHERE pair IN (SELECT value ->> 'pair' FROM jsonb_each(?1))";

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
FROM jsonb_each(?1)";

const ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, ms, at)
SELECT value ->> 0, value ->> 1, value ->> 2, value ->> 3, value ->> 4 FROM jsonb_each(?1)";

/// What is known of the input files of pairs.
pub(crate) const SEEN: &str = "
UPDATE pair SET mesh_hash = coalesce(unhex(item.value ->> 'mesh_hash'), mesh_hash),
    mesh_stat = coalesce(item.value ->> 'mesh_stat', mesh_stat),
    print_hash = coalesce(unhex(item.value ->> 'print_hash'), print_hash),
    print_stat = coalesce(item.value ->> 'print_stat', print_stat)
FROM jsonb_each(?1) AS item WHERE pair.id = item.value ->> 'pair' AND (
    pair.mesh_hash IS NOT unhex(item.value ->> 'mesh_hash') OR pair.mesh_stat IS NOT item.value ->> 'mesh_stat'
    OR pair.print_hash IS NOT unhex(item.value ->> 'print_hash') OR pair.print_stat IS NOT item.value ->> 'print_stat')";

const CLEAR_FAILURE: &str =
    "DELETE FROM failure WHERE pair IN (SELECT value ->> 0 FROM jsonb_each(?1))";

/// What is written beside the job.
#[cfg(test)]
pub(crate) const ROWS: [&str; 6] = [RESULT, CLEAR_METRICS, METRICS, ATTEMPT, SEEN, CLEAR_FAILURE];

/// Adds the steps of jobs to a script; those whose leases no longer hold stay where they are.
pub(crate) fn step<'i>(script: &mut Script, done: impl Iterator<Item = &'i Steps>) -> Result<()> {
    over(script, &[STEP], done.filter_map(job))
}

/// Adds what is stored beside steps that were made.
pub(crate) fn store(script: &mut Script, made: &[&Steps], deltas: &mut Deltas) -> Result<()> {
    for (lease, done) in made.iter().map(|steps| &**steps) {
        for one in done {
            failpoint::hit(one.stage, Point::Recorded, None);
        }
        if let Some(last) = done.last() {
            deltas.moved((cursor(lease.cursor), JobStatus::Leased), after(last.stage));
        }
    }
    let each = || made.iter().flat_map(|steps| each(steps));
    over(script, &[RESULT], each().map(result))?;
    over(script, &[ATTEMPT], each().map(attempt))?;
    let suspects = made.iter().filter(|(lease, _)| !lease.cleared);
    let suspects = suspects.map(|(lease, _)| [lease.pair.0]);
    over(script, &[CLEAR_FAILURE], suspects)?;
    over(script, &[CLEAR_METRICS, METRICS], each().flat_map(metrics))?;
    let seen = made.iter().filter_map(|(lease, done)| {
        // The last one tells all that those before it told.
        let mut told = done.iter().rev().map(|one| &one.inputs);
        Some((lease, told.find(|inputs| inputs.is_told())?))
    });
    store_seen(script, seen)
}

/// Each stage with its lease.
fn each((lease, done): &Steps) -> impl Iterator<Item = (&Lease, &StageCheckpoint)> {
    done.iter().map(move |one| (lease, one))
}

/// Where a job stands when a stage is stored.
fn after(stage: Stage) -> (Cursor, JobStatus) {
    match stage.next() {
        Some(next) => (cursor(next), JobStatus::Leased),
        None => (DONE, JobStatus::Done),
    }
}

/// One item of [`STEP`].
#[derive(Serialize)]
struct Job {
    pair: i64,
    worker: i64,
    token: i64,
    next: Cursor,
    status: i64,
    /// The fingerprint whose upstream must be that of the result before; none where there is none before.
    first: Option<i64>,
    /// The fingerprint of the last result; none where the results do not follow on each other.
    made: Option<i64>,
    low_confidence: i64,
    deadline: Option<UnixMillis>,
    alive_since: UnixMillis,
}

/// The step over all stages that are stored at once; none for no stage.
fn job((lease, done): &Steps) -> Option<Job> {
    let last = done.last()?;
    let (next, status) = after(last.stage);
    let metrics = &mut last.metrics.iter();
    let (first, made) = chain(done);
    Some(Job {
        pair: lease.pair.0,
        worker: lease.worker.0,
        token: lease.token,
        next,
        status: status.code(),
        first: first.map(|fingerprint| fingerprint.0),
        made: made.map(|fingerprint| fingerprint.0),
        low_confidence: i64::from(metrics.any(|metric| metric.outcome.is_low_confidence())),
        deadline: (status == JobStatus::Leased).then_some(last.next_deadline),
        alive_since: last.alive_since,
    })
}

/// The fingerprints of the first and the last of the results that follow on each other up to the last; no first where that
/// is the first stage of all. No last where some do not.
fn chain(done: &[StageCheckpoint]) -> (Option<FingerprintId>, Option<FingerprintId>) {
    let fresh = done.iter().rposition(|one| one.stage == Stage::Fit);
    let chain = &done[fresh.unwrap_or(0)..];
    let follows = |two: &[StageCheckpoint]| two[0].stage.next() == Some(two[1].stage);
    let whole = chain.windows(2).all(follows);
    let first = fresh.is_none().then(|| chain.first()).flatten();
    let last = chain.last().filter(|_| whole);
    (
        first.map(|one| one.fingerprint),
        last.map(|one| one.fingerprint),
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

fn result<'d>((lease, done): (&Lease, &'d StageCheckpoint)) -> ResultRow<'d> {
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

const fn attempt((lease, done): (&Lease, &StageCheckpoint)) -> Attempt {
    let stage = done.stage.index();
    (lease.pair.0, stage, lease.worker.0, done.ms, done.at)
}

/// One item of [`METRICS`].
#[derive(Serialize)]
struct MetricRow<'d> {
    pair: i64,
    row: &'d MetricOutcome,
    result_hash: ContentHash,
}

fn metrics<'d>(
    (lease, done): (&'d Lease, &'d StageCheckpoint),
) -> impl Iterator<Item = MetricRow<'d>> {
    done.metrics.iter().map(|metric| MetricRow {
        pair: lease.pair.0,
        row: &metric.outcome,
        result_hash: metric.result_hash,
    })
}

/// Adds what is known of the input files of leased pairs.
pub(crate) fn store_seen<'a>(
    script: &mut Script,
    seen: impl Iterator<Item = (&'a Lease, &'a InputVersions)>,
) -> Result<()> {
    let items = seen.filter(|(_, seen)| seen.is_told());
    let items = items.map(|(lease, seen)| seen_row(lease.pair.0, seen));
    over(script, &[SEEN], items)
}

/// One item of [`SEEN`].
#[derive(Serialize)]
pub(crate) struct SeenRow<'s> {
    pair: i64,
    mesh_hash: Option<ContentHash>,
    mesh_stat: Option<&'s str>,
    print_hash: Option<ContentHash>,
    print_stat: Option<&'s str>,
}

pub(crate) fn seen_row(pair: i64, seen: &InputVersions) -> SeenRow<'_> {
    let (mesh, print) = (seen.mesh.as_ref(), seen.print.as_ref());
    SeenRow {
        pair,
        mesh_hash: mesh.map(|seen| seen.hash),
        mesh_stat: mesh.map(|seen| seen.stat.as_str()),
        print_hash: print.map(|seen| seen.hash),
        print_stat: print.map(|seen| seen.stat.as_str()),
    }
}

/// Adds what is known of input files.
pub(crate) fn store_inputs(script: &mut Script, seen: &[(PairId, InputVersions)]) -> Result<()> {
    let items = seen.iter().map(|(pair, seen)| seen_row(pair.0, seen));
    over(script, &[SEEN], items)
}

/// Adds statements over a JSON array, unless that is empty.
pub(crate) fn over(
    script: &mut Script,
    statements: &[&'static str],
    items: impl Iterator<Item = impl Serialize>,
) -> Result<()> {
    let mut array = String::new();
    for item in items {
        array.push(if array.is_empty() { '[' } else { ',' });
        array.push_str(&serde_json::to_string(&item)?);
    }
    if !array.is_empty() {
        array.push(']');
        script.add(statements).bind(array)?;
    }
    Ok(())
}

impl Catalog {
    /// Stores a finished stage in one transaction and moves the job on. The artifacts must be on disk already.
    ///
    /// # Errors
    /// When the database refuses; then nothing is stored and the lease stands until it is recovered.
    pub async fn checkpoint(
        &self,
        lease: Lease,
        done: StageCheckpoint,
    ) -> Result<CheckpointOutcome> {
        self.store(lease, vec![done], Message::Grouped).await
    }

    /// The same for stages in the order they were computed, but it may take some time longer, for others to share its
    /// commit; not while somebody is [`Catalog::waiting`].
    ///
    /// # Errors
    /// As there.
    pub async fn checkpoint_in_time(
        &self,
        lease: Lease,
        done: Vec<StageCheckpoint>,
    ) -> Result<CheckpointOutcome> {
        self.store(lease, done, Message::InTime).await
    }

    async fn store(
        &self,
        lease: Lease,
        done: Vec<StageCheckpoint>,
        message: fn(Request) -> Message,
    ) -> Result<CheckpointOutcome> {
        let Some(last) = done.last() else {
            return Ok(CheckpointOutcome::Lease(lease));
        };
        let next = last.stage.next();
        let moved = next.map(|cursor| Lease {
            cursor,
            attempt: 1,
            crashes: 0,
            cleared: true,
            ..copy(&lease)
        });
        let kept = self
            .answered(|reply| message(Request::Checkpoint(Box::new((lease, done)), reply)))
            .await?;
        Ok(match (kept, moved) {
            (false, _) => CheckpointOutcome::LeaseLost,
            (true, Some(lease)) => CheckpointOutcome::Lease(lease),
            (true, None) => CheckpointOutcome::Done,
        })
    }
}

/// The lease as it will be; the one given in is spent by the request.
const fn copy(lease: &Lease) -> Lease {
    Lease { ..*lease }
}
