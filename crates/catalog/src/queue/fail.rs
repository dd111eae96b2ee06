//! Statements that store a failed stage if the lease is still valid.

use serde_json::{Value, json};

use crate::db::error::Result;
use crate::db::row::from_row;
use crate::db::script::{Script, Statement};
use crate::queue::checkpoint::add_inputs;
use crate::queue::counters::{CounterKey, Deltas};
use crate::queue::fragments::fingerprint_before;
use crate::queue::lease::{FailureAction, Lease, StageFailure};
use mocban_core::domain::JobStatus;

/// Number of attempts kept per pair. Older ones are deleted.
const ATTEMPTS_KEPT: i64 = 64;

/// Updates failed jobs. Skips a job if its lease was lost or its worker counts as dead. `job.status + 0` keeps the
/// planner of PostgreSQL from the index of leases, which contains all leases that ended while a snapshot is held.
pub(crate) const FAIL: &str = concat!(
    "
UPDATE job SET stage = min(job.stage, CAST(item.value ->> 'stage' AS bigint)), status = CAST(item.value ->> 'status' AS bigint),
    run_at = CAST(item.value ->> 'run_at' AS bigint), exclusive = max(exclusive, CAST(item.value ->> 'exclusive' AS bigint)),
    worker = NULL, deadline = NULL, fingerprint = ",
    fingerprint_before!("min(job.stage, CAST(item.value ->> 'stage' AS bigint))"),
    "
FROM jsonb_each(?) AS item
WHERE job.pair = CAST(item.value ->> 'pair' AS bigint) AND job.worker = CAST(item.value ->> 'worker' AS bigint)
    AND job.token = CAST(item.value ->> 'token' AS bigint) AND job.status + 0 = 1 AND EXISTS (
        SELECT 1 FROM worker AS w
        WHERE w.id = job.worker AND w.ended IS NULL AND w.heartbeat >= CAST(item.value ->> 'alive_since' AS bigint))
RETURNING pair, token, stage, status, coalesce(fingerprint, 0) AS fingerprint"
);

const FAILURE: &str = "
INSERT INTO failure (pair, stage, class, message, fingerprint, mesh_hash, print_hash, attributes, at)
SELECT CAST(value ->> 'pair' AS bigint), CAST(value ->> 'stage' AS bigint), value ->> 'class', value ->> 'message', CAST(value ->> 'fingerprint' AS bigint),
    unhex(value ->> 'mesh_hash'), unhex(value ->> 'print_hash'), value ->> 'attributes', CAST(value ->> 'at' AS bigint)
FROM jsonb_each(?) WHERE CAST(value ->> 'status' AS bigint) <> 0
ON CONFLICT (pair) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash, print_hash = excluded.print_hash,
    attributes = excluded.attributes, at = excluded.at";

const ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, class, message, ms, at)
SELECT CAST(value ->> 'pair' AS bigint), CAST(value ->> 'stage' AS bigint), CAST(value ->> 'worker' AS bigint), value ->> 'class', value ->> 'message',
    CAST(value ->> 'ms' AS bigint), CAST(value ->> 'at' AS bigint)
FROM jsonb_each(?)";

const PRUNE: &str = "
DELETE FROM attempt WHERE id IN (
    SELECT old.id FROM jsonb_each(?) AS item JOIN attempt AS old ON old.pair = CAST(item.value ->> 'pair' AS bigint)
    WHERE old.id <= (SELECT id FROM attempt WHERE pair = CAST(item.value ->> 'pair' AS bigint) ORDER BY id DESC LIMIT 1 OFFSET ?))";

/// A row of [`FAIL`]: a job with its token and new counter key.
pub(crate) struct FailedRow {
    pub(crate) pair: i64,
    pub(crate) token: i64,
    key: CounterKey,
}

from_row! { FailedRow { pair, token, key in row } }

/// Returns the row for a lease, or `None` if the lease was lost.
pub(crate) fn row_of<'r>(lease: &Lease, rows: &'r [FailedRow]) -> Option<&'r FailedRow> {
    rows.iter()
        .find(|row| (row.pair, row.token) == (lease.pair.0, lease.token))
}

/// Adds the statement `FAIL` to a script. The statement returns one row for each job that it changed.
pub(crate) fn add_failures<'i>(
    script: &mut Script,
    failures: impl Iterator<Item = &'i (Lease, StageFailure)>,
) -> Result<Option<Statement<FailedRow>>> {
    script.add_over(FAIL, failures.map(json_of))
}

/// Adds the statements that store failures and attempts to a script.
pub(crate) fn add_failure_records(
    script: &mut Script,
    failed: &[(&(Lease, StageFailure), &FailedRow)],
    deltas: &mut Deltas,
) -> Result<()> {
    if failed.is_empty() {
        return Ok(());
    }
    let items = || failed.iter().map(|(item, _)| json_of(item));
    script.execute_over(FAILURE, items())?;
    script.execute_over(ATTEMPT, items())?;
    script.execute_over(PRUNE, items())?;
    script.bind(ATTEMPTS_KEPT);
    let inputs = failed.iter().map(|(item, _)| (item.0.pair, &item.1.inputs));
    add_inputs(script, inputs)?;
    for ((lease, _), row) in failed {
        deltas.move_job(lease.counter_key(), row.key);
    }
    Ok(())
}

const fn status(action: FailureAction) -> JobStatus {
    match action {
        FailureAction::BackOff { .. } => JobStatus::Backoff,
        FailureAction::RetryExclusive => JobStatus::Ready,
        FailureAction::Quarantine => JobStatus::Quarantined,
    }
}

fn json_of((lease, failed): &(Lease, StageFailure)) -> Value {
    let run_at = match failed.action {
        FailureAction::BackOff { run_at } => Some(run_at),
        FailureAction::RetryExclusive | FailureAction::Quarantine => None,
    };
    json!({
        "pair": lease.pair.0, "worker": lease.worker.0, "token": lease.token, "stage": failed.stage.index(),
        "status": status(failed.action).code(), "run_at": run_at,
        "exclusive": i64::from(failed.action == FailureAction::RetryExclusive),
        "class": failed.failure.class, "message": failed.failure.message, "fingerprint": failed.fingerprint.0,
        "mesh_hash": failed.inputs.mesh.as_ref().map(|seen| seen.hash),
        "print_hash": failed.inputs.print.as_ref().map(|seen| seen.hash),
        "attributes": failed.attributes, "ms": failed.ms, "at": failed.at, "alive_since": failed.alive_since,
    })
}
