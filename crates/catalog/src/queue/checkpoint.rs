//! Statements that store the finished and failed stages of jobs that `ADVANCE` and `FAIL` in `lease.rs` have changed. In
//! PostgreSQL, the finished stages of pairs have a statement of their own: see `server_checkpoint.rs`.

use serde::Serialize;
use serde_json::{Value, json};

#[cfg(test)]
use crate::db::dialect::Sql;
use crate::db::error::Result;
use crate::db::row::from_row;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{CounterKey, Cursor, Deltas};
use crate::queue::kind::{JobKind, StoredKind, Template};
use crate::queue::lease::{
    ADVANCE, FAIL, FencedRow, Lease, LeasedCheckpoints, key_after, position,
};
use crate::queue::pair_job::PairJob;
#[cfg(test)]
use crate::queue::pair_job::UPDATE_INPUTS;
use crate::queue::provenance::FingerprintId;
use crate::queue::stage_record::{FailureAction, StageCheckpoint, StageFailure};
use mocban_core::domain::{
    ArtifactSet, ContentHash, JobStatus, ThresholdMetric, UnixMillis, WorkerId,
};
use mocban_system::failpoint::{self, Point};

/// Number of attempts kept per pair or block. Older ones are deleted.
const ATTEMPTS_KEPT: i64 = 64;

/// Items: [`ResultItem`].
static RESULT: Template = Template::new(
    "
INSERT INTO {result} ({unit}, stage, worker, {provenance}, outcome, files, result_hash, ms, at)
SELECT [unit], [stage], [worker], {provenance_values}, item.value ->> 'outcome', CAST(item.value -> 'files' AS text),
    unhex(item.value ->> 'result_hash'), [ms], [at]
FROM jsonb_each(?) AS item WHERE true
ON CONFLICT ({unit}, stage) DO UPDATE SET {provenance_updates}, outcome = excluded.outcome, files = excluded.files,
    result_hash = excluded.result_hash, ms = excluded.ms, worker = excluded.worker, at = excluded.at",
);

/// Removes the old metrics, because the new method may compute fewer.
const CLEAR_METRICS: &str = "
DELETE FROM metric_result WHERE pair IN (SELECT value ->> 0 FROM jsonb_each(?))";

/// Items: pair, metric, hash of its result, confidence, intersection over union.
const METRICS: &str = "
INSERT INTO metric_result (pair, metric, result_hash, confidence, iou)
SELECT value ->> 0, value ->> 1, unhex(value ->> 2), value ->> 3, value ->> 4 FROM jsonb_each(?)";

/// Items: unit, index of the stage, worker, milliseconds, time.
static ATTEMPT: Template = Template::new(
    "
INSERT INTO {attempt} ({unit}, stage, worker, ms, at) SELECT [0], [1], [2], [3], [4] FROM jsonb_each(?) AS item",
);

static CLEAR_FAILURE: Template =
    Template::new("DELETE FROM {failure} WHERE {unit} IN (SELECT [0] FROM jsonb_each(?) AS item)");

/// Stores why a job backs off or is quarantined. Items: see [`failure_item`].
static FAILURE: Template = Template::new(
    "
INSERT INTO {failure} ({unit}, stage, class, message, {provenance}, at)
SELECT [unit], [stage], item.value ->> 'class', item.value ->> 'message', {provenance_values}, [at]
FROM jsonb_each(?) AS item WHERE [status] <> 0
ON CONFLICT ({unit}) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    {provenance_updates}, at = excluded.at",
);

static FAILED_ATTEMPT: Template = Template::new(
    "
INSERT INTO {attempt} ({unit}, stage, worker, class, message, ms, at)
SELECT [unit], [stage], [worker], item.value ->> 'class', item.value ->> 'message', [ms], [at] FROM jsonb_each(?) AS item",
);

static PRUNE: Template = Template::new(
    "
DELETE FROM {attempt} WHERE id IN (
    SELECT old.id FROM jsonb_each(?) AS item JOIN {attempt} AS old ON old.{unit} = [unit]
    WHERE old.id <= (SELECT id FROM {attempt} WHERE {unit} = [unit] ORDER BY id DESC LIMIT 1 OFFSET ?))",
);

/// Returns the statements of [`add_results`] for pairs.
#[cfg(test)]
pub(crate) fn rows() -> [Sql; 6] {
    [
        RESULT.of::<PairJob>(),
        CLEAR_METRICS.into(),
        METRICS.into(),
        ATTEMPT.of::<PairJob>(),
        UPDATE_INPUTS,
        CLEAR_FAILURE.of::<PairJob>(),
    ]
}

/// Adds the statement `ADVANCE` to a script. The statement returns one row for each job that it changed.
pub(crate) fn add_advance<'i, K: StoredKind>(
    script: &mut Script,
    checkpoints: impl Iterator<Item = &'i LeasedCheckpoints<K>>,
) -> Result<Option<Statement<FencedRow>>> {
    script.add_over(ADVANCE.of::<K>(), checkpoints.filter_map(AdvancedJob::of))
}

/// Adds the statements that store the results of advanced jobs to a script.
pub(crate) fn add_results<K: StoredKind>(
    script: &mut Script,
    advanced: &[&LeasedCheckpoints<K>],
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
    let mut results = Vec::new();
    for (lease, one) in each() {
        results.push(ResultItem::of(lease, one)?);
    }
    let attempts = results.iter();
    let attempts = attempts.map(|row| (row.unit, row.stage, row.worker, row.ms, row.at));
    script.execute_over(RESULT.of::<K>(), results.iter())?;
    script.execute_over(ATTEMPT.of::<K>(), attempts)?;
    let uncleared = advanced.iter().filter(|(lease, _)| !lease.cleared);
    let uncleared = uncleared.map(|(lease, _)| [lease.id()]);
    script.execute_over(CLEAR_FAILURE.of::<K>(), uncleared)?;
    let metrics = || {
        each().flat_map(|(lease, one)| {
            let metrics = one.metrics.iter();
            metrics.map(|result| {
                let outcome = &result.outcome;
                let (confidence, iou) = (outcome.confidence, outcome.scores.iou);
                let metric = outcome.metric.name();
                (lease.id(), metric, result.result_hash, confidence, iou)
            })
        })
    };
    script.execute_over(CLEAR_METRICS, metrics().map(|(pair, ..)| [pair]))?;
    script.execute_over(METRICS, metrics())?;
    let inputs = advanced.iter().filter_map(|(lease, stages)| {
        // The last stage with inputs also lists the inputs of all earlier stages.
        let mut inputs = stages.iter().rev().map(|one| &one.inputs);
        Some((lease.unit, inputs.find(|inputs| K::are_known(inputs))?))
    });
    K::add_inputs(script, inputs)
}

/// An item of [`RESULT`].
#[derive(Serialize)]
struct ResultItem<'i, P> {
    unit: i64,
    stage: usize,
    worker: WorkerId,
    #[serde(flatten)]
    provenance: P,
    outcome: &'i str,
    files: &'i ArtifactSet,
    result_hash: ContentHash,
    ms: u64,
    at: UnixMillis,
}

impl<'i> ResultItem<'i, ()> {
    fn of<K: StoredKind>(
        lease: &Lease<K>,
        result: &'i StageCheckpoint<K>,
    ) -> Result<ResultItem<'i, impl Serialize + use<'i, K>>> {
        Ok(ResultItem {
            unit: lease.id(),
            stage: K::index(result.stage),
            worker: lease.worker,
            provenance: K::provenance(&result.provenance)?,
            outcome: &result.outcome,
            files: &result.files,
            result_hash: result.result_hash,
            ms: result.ms,
            at: result.at,
        })
    }
}

/// A job to advance, and its state afterwards. An item of [`ADVANCE`].
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct AdvancedJob {
    pub(crate) unit: i64,
    pub(crate) worker: i64,
    pub(crate) token: i64,
    /// Position under the lease.
    pub(crate) stage: Cursor,
    pub(crate) next: Cursor,
    pub(crate) status: i64,
    /// The job of a pair becomes dirty if the upstream of `first` is not its fingerprint, or if `mixed` is 1, because
    /// the stages are not consecutive.
    pub(crate) fingerprint: i64,
    pub(crate) first: Option<i64>,
    pub(crate) mixed: i64,
    pub(crate) low_confidence: i64,
    pub(crate) deadline: Option<UnixMillis>,
    pub(crate) alive_since: UnixMillis,
}

impl AdvancedJob {
    /// Describes a job after its checkpoint, or returns `None` if there are no stages.
    pub(crate) fn of<K: JobKind>((lease, stages): &LeasedCheckpoints<K>) -> Option<Self> {
        let last = stages.last()?;
        let after = key_after(last);
        let low_confidence = last.metrics.iter().any(|metric| {
            metric.outcome.metric == ThresholdMetric::DEFAULT && metric.outcome.is_low_confidence()
        });
        let (first, follow) = chain(stages);
        Some(Self {
            unit: lease.id(),
            worker: lease.worker.0,
            token: lease.token,
            stage: position::<K>(lease.cursor),
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
/// last one with index 0, which begins a new chain. If the chain begins there, no fingerprint is returned.
fn chain<K: JobKind>(stages: &[StageCheckpoint<K>]) -> (Option<FingerprintId>, bool) {
    let restart = stages.iter().rposition(|one| K::index(one.stage) == 0);
    let chain = &stages[restart.unwrap_or(0)..];
    let follow = |two: &[StageCheckpoint<K>]| K::next(two[0].stage) == Some(two[1].stage);
    let first = restart.is_none().then(|| chain.first()).flatten();
    (
        first.and_then(|one| K::fingerprint(&one.provenance)),
        chain.windows(2).all(follow),
    )
}

/// A row of [`FAIL`]: a job with its token and new counter key.
pub(crate) struct FailedRow {
    pub(crate) unit: i64,
    pub(crate) token: i64,
    key: CounterKey,
}

from_row! { FailedRow { unit, token, key in row } }

/// A lease, and the failure to store under it.
pub(crate) type LeasedFailure<K = PairJob> = (Lease<K>, StageFailure<K>);

/// Returns the row for a lease, or `None` if the lease was lost.
pub(crate) fn failed_row<'r, K: JobKind>(
    lease: &Lease<K>,
    rows: &'r [FailedRow],
) -> Option<&'r FailedRow> {
    let id = lease.id();
    rows.iter()
        .find(|row| (row.unit, row.token) == (id, lease.token))
}

/// Adds the statement `FAIL` to a script. The statement returns one row for each job that it changed.
pub(crate) fn add_failures<'i, K: StoredKind>(
    script: &mut Script,
    failures: impl Iterator<Item = &'i LeasedFailure<K>>,
) -> Result<Option<Statement<FailedRow>>> {
    let items: Vec<Value> = failures.map(failure_item).collect::<Result<_>>()?;
    script.add_over(FAIL.of::<K>(), items.iter())
}

/// Adds the statements that store failures and attempts to a script.
pub(crate) fn add_failure_records<K: StoredKind>(
    script: &mut Script,
    failed: &[(&LeasedFailure<K>, &FailedRow)],
    deltas: &mut Deltas,
) -> Result<()> {
    if failed.is_empty() {
        return Ok(());
    }
    let items = failed.iter().map(|(one, _)| failure_item(one));
    add_records::<K>(script, &items.collect::<Result<Vec<_>>>()?)?;
    let inputs = failed.iter().map(|(item, _)| (item.0.unit, &item.1.inputs));
    K::add_inputs(script, inputs)?;
    for ((lease, failed), row) in failed {
        failpoint::hit(failed.stage, Point::Recorded, None);
        deltas.move_job(lease.counter_key(), row.key);
    }
    Ok(())
}

/// Adds the statements that store failures, and attempts with those, to a script.
pub(crate) fn add_records<K: StoredKind>(script: &mut Script, items: &[Value]) -> Result<()> {
    for statement in [&FAILURE, &FAILED_ATTEMPT] {
        script.execute_over(statement.of::<K>(), items.iter())?;
    }
    script.execute_over(PRUNE.of::<K>(), items.iter())?;
    script.bind(ATTEMPTS_KEPT);
    Ok(())
}

const fn status(action: FailureAction) -> JobStatus {
    match action {
        FailureAction::BackOff { .. } => JobStatus::Backoff,
        FailureAction::RetryExclusive => JobStatus::Ready,
        FailureAction::Quarantine => JobStatus::Quarantined,
    }
}

/// Builds an item of the statements of a failure.
fn failure_item<K: StoredKind>((lease, failed): &LeasedFailure<K>) -> Result<Value> {
    let run_at = match failed.action {
        FailureAction::BackOff { run_at } => Some(run_at),
        FailureAction::RetryExclusive | FailureAction::Quarantine => None,
    };
    let fields = json!({
        "unit": lease.id(), "worker": lease.worker.0, "token": lease.token, "stage": K::index(failed.stage),
        "status": status(failed.action).code(), "run_at": run_at,
        "exclusive": i64::from(failed.action == FailureAction::RetryExclusive),
        "class": failed.failure.class, "message": failed.failure.message, "ms": failed.ms, "at": failed.at,
        "alive_since": failed.alive_since,
    });
    let provenance = serde_json::to_value(K::provenance(&failed.provenance)?)?;
    Ok(merged(fields, provenance))
}

/// Returns an object with the fields of two.
pub(crate) fn merged(mut fields: Value, more: Value) -> Value {
    if let (Value::Object(fields), Value::Object(more)) = (&mut fields, more) {
        fields.extend(more);
    }
    fields
}
