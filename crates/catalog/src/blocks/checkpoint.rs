//! Stores finished stages of blocks if the lease is still valid.

use crate::blocks::model::{BlockCheckpoint, BlockInputVersions, BlockLease};
use crate::db::conn::Conn;
use crate::db::query::{query, query_scalar};
use crate::queue::lease::was_written_long_ago;
use crate::{Catalog, Result};
use mocban_core::domain::{BlockId, BlockStage, UnixMillis, WorkerId};
use mocban_system::failpoint::{self, Point};

/// Number of attempts kept per block. Older ones are deleted.
const ATTEMPTS_KEPT: i64 = 64;

/// The condition under which a statement may change a block's job: the lease of block `?1`, worker `?2` and token `?3`
/// is valid, and the worker's last heartbeat is not before `?4`.
macro_rules! fenced {
    () => {
        "block = ?1 AND worker = ?2 AND token = ?3 AND status = 1 AND EXISTS (
        SELECT 1 FROM worker AS w WHERE w.id = ?2 AND w.ended IS NULL AND w.heartbeat >= ?4)"
    };
}
pub(crate) use fenced;

/// Advances a job to stage `?6`, or sends it back if an earlier stage was computed again. The lease ends after the last
/// stage.
const ADVANCE: &str = concat!(
    "
UPDATE block_job SET stage = ?6, status = CASE WHEN ?6 = 4 THEN 3 ELSE 1 END,
    worker = CASE WHEN ?6 = 4 THEN NULL ELSE worker END, deadline = CASE WHEN ?6 = 4 THEN NULL ELSE ?7 END,
    attempt = 1, crashes = 0, class = NULL, message = NULL, failed_stage = NULL, failed_at = NULL, failed_with = NULL
WHERE stage >= ?5 AND ",
    fenced!(),
    " RETURNING block"
);

/// Finds out whether a stage was stored already under the same lease, although its reply was lost.
const IS_STORED: &str = "
SELECT 1 FROM block_job AS j JOIN block_result AS r ON r.block = j.block AND r.stage = ?3
WHERE j.block = ?1 AND j.token = ?2 AND j.stage = ?3 + 1 AND r.result_hash = ?4 AND r.worker = ?5";

const RESULT: &str = "
INSERT INTO block_result (block, stage, made_with, outcome, files, result_hash, ms, worker, at)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)
ON CONFLICT (block, stage) DO UPDATE SET made_with = excluded.made_with, outcome = excluded.outcome, files = excluded.files,
    result_hash = excluded.result_hash, ms = excluded.ms, worker = excluded.worker, at = excluded.at";

const ATTEMPT: &str = "
INSERT INTO block_attempt (block, stage, worker, class, message, ms, at) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";

const PRUNE: &str = "
DELETE FROM block_attempt WHERE block = ?1 AND id <= (
    SELECT id FROM block_attempt WHERE block = ?1 ORDER BY id DESC LIMIT 1 OFFSET ?2)";

/// Stores the versions of input files. A file that was not read keeps its version.
const UPDATE_INPUTS: &str = "
UPDATE block SET mesh_hash = coalesce(?2, mesh_hash), mesh_stat = coalesce(?3, mesh_stat),
    page_hash = coalesce(?4, page_hash), page_stat = coalesce(?5, page_stat),
    labels_hash = coalesce(?6, labels_hash), labels_stat = coalesce(?7, labels_stat) WHERE id = ?1";

/// An attempt of a stage of a block.
#[derive(Debug)]
pub(crate) struct BlockAttempt<'a> {
    pub(crate) stage: BlockStage,
    /// Class and message of a failure.
    pub(crate) failure: Option<(&'static str, &'a str)>,
    pub(crate) ms: Option<u64>,
    pub(crate) at: UnixMillis,
}

impl Catalog {
    /// Stores a finished stage and advances the job. Its artifacts must be on disk already. Returns the lease of the
    /// next stage, or `None` if the lease was lost, in which case nothing is stored. The last stage is stored with
    /// [`Catalog::finish_cut`].
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn checkpoint_block(
        &self,
        lease: BlockLease,
        stage: BlockCheckpoint,
    ) -> Result<Option<BlockLease>> {
        // An earlier stage than that of the lease may have been computed again.
        let next = stage.record.stage.next();
        let stored = self.in_transaction({
            let lease = lease.clone();
            move |conn| Box::pin(async move { store(conn, &lease, &stage).await })
        });
        Ok(match (stored.await?, next) {
            (Stored::Now | Stored::Before, Some(cursor)) => Some(BlockLease {
                cursor,
                attempt: 1,
                ..lease
            }),
            _ => None,
        })
    }
}

/// Whether a checkpoint was stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stored {
    /// By this call.
    Now,
    /// By an earlier call whose reply was lost.
    Before,
    /// Not at all: the lease was lost.
    LeaseLost,
}

/// Advances the job and stores the rows of a finished stage.
pub(crate) async fn store(
    conn: &mut Conn,
    lease: &BlockLease,
    stage: &BlockCheckpoint,
) -> Result<Stored> {
    let (record, index) = (&stage.record, stage.record.stage.index() as i64);
    let advance = query_scalar(ADVANCE)
        .bind(lease.block.0)
        .bind(lease.worker.0)
        .bind(lease.token)
        .bind(stage.alive_since)
        .bind(index)
        .bind(index + 1)
        .bind(stage.next_deadline);
    let advanced: Option<BlockId> = if was_written_long_ago(stage.written) {
        None
    } else {
        advance.fetch_optional(&mut *conn).await?
    };
    if advanced.is_none() {
        let stored = query_scalar(IS_STORED)
            .bind(lease.block.0)
            .bind(lease.token)
            .bind(index)
            .bind(&record.result_hash.as_bytes()[..])
            .bind(lease.worker.0);
        let stored: Option<i64> = stored.fetch_optional(conn).await?;
        return Ok(match stored {
            Some(_) => Stored::Before,
            None => Stored::LeaseLost,
        });
    }
    query(RESULT)
        .bind(lease.block.0)
        .bind(index)
        .bind(serde_json::to_string(&stage.made_with)?)
        .bind(&record.outcome)
        .bind(serde_json::to_string(&record.files)?)
        .bind(&record.result_hash.as_bytes()[..])
        .bind(stage.ms as i64)
        .bind(lease.worker.0)
        .bind(stage.at)
        .execute(&mut *conn)
        .await?;
    let attempt = BlockAttempt {
        stage: record.stage,
        failure: None,
        ms: Some(stage.ms),
        at: stage.at,
    };
    add_attempt(conn, lease.block, lease.worker, &attempt).await?;
    update_inputs(conn, lease.block, &stage.inputs).await?;
    failpoint::hit(record.stage, Point::Recorded, None);
    Ok(Stored::Now)
}

/// Adds an attempt to the history of a block, and deletes old ones.
pub(crate) async fn add_attempt(
    conn: &mut Conn,
    block: BlockId,
    worker: WorkerId,
    attempt: &BlockAttempt<'_>,
) -> Result<()> {
    query(ATTEMPT)
        .bind(block.0)
        .bind(attempt.stage.index() as i64)
        .bind(worker.0)
        .bind(attempt.failure.map(|(class, _)| class))
        .bind(attempt.failure.map(|(_, message)| message))
        .bind(attempt.ms.map(|ms| ms as i64))
        .bind(attempt.at)
        .execute(&mut *conn)
        .await?;
    let prune = query(PRUNE).bind(block.0).bind(ATTEMPTS_KEPT);
    prune.execute(conn).await
}

/// Stores the versions of input files.
pub(crate) async fn update_inputs(
    conn: &mut Conn,
    block: BlockId,
    inputs: &BlockInputVersions,
) -> Result<()> {
    let mut update = query(UPDATE_INPUTS).bind(block.0);
    for version in [&inputs.mesh, &inputs.page, &inputs.labels] {
        let version = version.as_ref();
        update = update
            .bind(version.map(|version| &version.hash.as_bytes()[..]))
            .bind(version.map(|version| &version.stat));
    }
    update.execute(conn).await
}
