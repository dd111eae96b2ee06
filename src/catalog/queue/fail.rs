//! Storing a failed stage: what it means for the job, why, and the attempt.

use serde_json::{Value, json};

use crate::catalog::db::error::Result;
use crate::catalog::db::group_commit::Request;
use crate::catalog::db::rows;
use crate::catalog::db::script::Script;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::alike::made;
use crate::catalog::queue::checkpoint::{over, store_seen};
use crate::catalog::queue::counters::{Deltas, cursor};
use crate::catalog::queue::lease::{FailureAction, Lease, StageFailure};
use crate::domain::JobStatus;

/// Attempts that are kept of a pair that fails again and again.
const ATTEMPTS_KEPT: i64 = 64;

/// The job's new state; only where the lease still holds.
pub(crate) const FAIL: &str = concat!(
    "
UPDATE job SET stage = min(job.stage, item.value ->> 'stage'), status = item.value ->> 'status',
    run_at = item.value ->> 'run_at', exclusive = max(exclusive, item.value ->> 'exclusive'),
    worker = NULL, deadline = NULL, made = ",
    made!("min(job.stage, item.value ->> 'stage')"),
    "
FROM jsonb_each(?1) AS item
WHERE job.pair = item.value ->> 'pair' AND job.worker = item.value ->> 'worker'
    AND job.token = item.value ->> 'token' AND job.status = 1 AND EXISTS (
        SELECT 1 FROM worker AS w
        WHERE w.id = job.worker AND w.ended IS NULL AND w.heartbeat >= item.value ->> 'alive_since')
RETURNING pair, token"
);

const FAILURE: &str = "
INSERT INTO failure (pair, stage, class, message, fingerprint, mesh_hash, print_hash, attributes, at)
SELECT value ->> 'pair', value ->> 'stage', value ->> 'class', value ->> 'message', value ->> 'fingerprint',
    unhex(value ->> 'mesh_hash'), unhex(value ->> 'print_hash'), value ->> 'attributes', value ->> 'at'
FROM jsonb_each(?1) WHERE value ->> 'status' <> 0
ON CONFLICT (pair) DO UPDATE SET stage = excluded.stage, class = excluded.class, message = excluded.message,
    fingerprint = excluded.fingerprint, mesh_hash = excluded.mesh_hash, print_hash = excluded.print_hash,
    attributes = excluded.attributes, at = excluded.at";

const ATTEMPT: &str = "
INSERT INTO attempt (pair, stage, worker, class, message, ms, at)
SELECT value ->> 'pair', value ->> 'stage', value ->> 'worker', value ->> 'class', value ->> 'message',
    value ->> 'ms', value ->> 'at'
FROM jsonb_each(?1)";

const PRUNE: &str = "
DELETE FROM attempt WHERE id IN (
    SELECT old.id FROM jsonb_each(?1) AS item JOIN attempt AS old ON old.pair = item.value ->> 'pair'
    WHERE old.id <= (SELECT id FROM attempt WHERE pair = item.value ->> 'pair' ORDER BY id DESC LIMIT 1 OFFSET ?2))";

/// Adds the new states of jobs that failed; those whose leases no longer hold stay as they are.
pub(crate) fn step<'i>(
    script: &mut Script,
    failed: impl Iterator<Item = &'i (Lease, StageFailure)>,
) -> Result<()> {
    over(script, &[FAIL], failed.map(json_of))
}

/// Adds what is stored beside failures that counted.
pub(crate) fn store(
    script: &mut Script,
    failed: &[&(Lease, StageFailure)],
    deltas: &mut Deltas,
) -> Result<()> {
    if failed.is_empty() {
        return Ok(());
    }
    let items = rows::array(failed.iter().map(|item| json_of(item)));
    let script = script
        .add(&[FAILURE, ATTEMPT, PRUNE])
        .bind(items.to_string())?;
    script.bind(ATTEMPTS_KEPT)?;
    let seen = failed.iter().map(|(lease, failed)| (lease, &failed.inputs));
    store_seen(script, seen)?;
    for (lease, failed) in failed.iter().map(|item| &**item) {
        let to = cursor(lease.cursor.min(failed.stage));
        let from = (cursor(lease.cursor), JobStatus::Leased);
        deltas.moved(from, (to, status(failed.action)));
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

impl Catalog {
    /// Stores a failed stage; `false` when the lease was lost and nothing was stored.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn fail(&self, lease: Lease, failed: StageFailure) -> Result<bool> {
        self.grouped(|reply| Request::Fail(Box::new((lease, failed)), reply))
            .await
    }
}
