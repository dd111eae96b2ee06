//! Statements that store the failed stage of jobs that `FAIL` in `lease.rs` has changed.

use serde_json::{Value, json};

use crate::db::error::Result;
use crate::db::row::from_row;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{CounterKey, Deltas};
use crate::queue::kind::{JobKind, StoredKind, Template};
use crate::queue::lease::{FAIL, Lease};
use crate::queue::pair_job::PairJob;
use crate::queue::stage_record::{FailureAction, StageFailure};
use mocban_core::domain::JobStatus;
use mocban_system::failpoint::{self, Point};

/// Number of attempts kept per pair or block. Older ones are deleted.
const ATTEMPTS_KEPT: i64 = 64;

/// Stores why a job backs off or is quarantined. Items: see [`item`].
static FAILURE: Template = Template::new(
    "
INSERT INTO {failure} ({unit}, stage, class, message, {provenance}, at)
SELECT [unit], [stage], item.value ->> 'class', item.value ->> 'message', {provenance_values}, [at]
FROM jsonb_each(?) AS item WHERE [status] <> 0
ON CONFLICT ({unit}) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    {provenance_updates}, at = excluded.at",
);

static ATTEMPT: Template = Template::new(
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
pub(crate) fn row_of<'r, K: JobKind>(
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
    let items: Vec<Value> = failures.map(item).collect::<Result<_>>()?;
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
    let items = failed.iter().map(|(one, _)| item(one));
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
    for statement in [&FAILURE, &ATTEMPT] {
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
fn item<K: StoredKind>((lease, failed): &LeasedFailure<K>) -> Result<Value> {
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
