//! Recovers the block leases of workers that died or hang, and quarantines blocks that kill workers.

use serde_json::Value;

use crate::Result;
use crate::blocks::checkpoint::{self, BlockAttempt};
use crate::blocks::model::{BlockAttributes, MadeWith};
use crate::blocks::records::{BLOCK, control_points, input_versions};
use crate::db::conn::Conn;
use crate::db::query::{query, query_as};
use crate::db::row::{FromRow as _, from_row};
use mocban_core::domain::{
    BlockId, BlockStage, CRASH_LIMIT, FailureClass, UnixMillis, WorkerId, is_poisoned,
};

/// Selects leased blocks of the given workers. `died` is 1 if the worker did not end properly, `pairs` is the number of
/// pairs that it holds too.
const LEFT_BY: &str = "
SELECT j.block, j.stage, j.crashes, j.worker, w.ended IS NULL AS died, j.deadline < w.heartbeat - ?2 AS overdue,
    (SELECT count(*) FROM job AS p WHERE p.worker = j.worker AND p.status = 1) AS pairs
FROM block_job AS j JOIN worker AS w ON w.id = j.worker
WHERE j.status = 1 AND j.worker IN (SELECT CAST(atom AS bigint) FROM json_each(?1)) ORDER BY j.block";

/// Makes a block ready. The interrupted attempt is not counted.
const READY: &str = "
UPDATE block_job SET status = 0, worker = NULL, deadline = NULL, token = token + 1, crashes = ?2,
    attempt = max(attempt - 1, 0) WHERE block = ?1";

/// Quarantines a block that killed too many workers, with the inputs as last read.
const POISONED: &str = "
UPDATE block_job SET status = 4, worker = NULL, deadline = NULL, token = token + 1, crashes = ?2,
    attempt = max(attempt - 1, 0), class = ?3, message = ?4, failed_stage = stage, failed_at = ?5, failed_with = ?6
WHERE block = ?1";

/// A block whose lease may be recovered.
struct LeftBlock {
    block: BlockId,
    stage: BlockStage,
    crashes: u32,
    worker: WorkerId,
    died: bool,
    overdue: bool,
    pairs: u64,
}

from_row! { LeftBlock { block, stage, crashes, worker, died, overdue, pairs } }

/// Recovers the block leases of dead workers, given as a JSON array. `deaths` is the number of recent deaths. A block
/// is blamed for a death if its worker held no pairs. Returns how many blocks are ready again.
pub(crate) async fn recover(
    conn: &mut Conn,
    workers: &str,
    deaths: u32,
    now: UnixMillis,
) -> Result<u64> {
    let mut ready = 0;
    for left in left_by(conn, workers, 0).await? {
        let is_blamed = left.died && left.pairs == 0;
        let crashes = left.crashes + u32::from(is_blamed);
        let is_over = is_blamed && is_poisoned(crashes, deaths);
        end_lease(conn, &left, crashes, is_over, now).await?;
        ready += u64::from(!is_over);
    }
    Ok(ready)
}

/// Recovers the overdue block leases of living workers: the last heartbeat is more than `margin_ms` after the
/// deadline. Returns how many blocks are ready again.
pub(crate) async fn recover_overdue(
    conn: &mut Conn,
    workers: &str,
    margin_ms: i64,
    now: UnixMillis,
) -> Result<u64> {
    let mut ready = 0;
    for left in left_by(conn, workers, margin_ms).await? {
        if left.overdue {
            let crashes = left.crashes + 1;
            let is_over = crashes >= CRASH_LIMIT;
            end_lease(conn, &left, crashes, is_over, now).await?;
            ready += u64::from(!is_over);
        }
    }
    Ok(ready)
}

async fn left_by(conn: &mut Conn, workers: &str, margin_ms: i64) -> Result<Vec<LeftBlock>> {
    let left = query_as(LEFT_BY).bind(workers).bind(margin_ms);
    left.fetch_all(conn).await
}

/// Makes a block ready again, or quarantines it.
async fn end_lease(
    conn: &mut Conn,
    left: &LeftBlock,
    crashes: u32,
    is_poisoned: bool,
    now: UnixMillis,
) -> Result<()> {
    if !is_poisoned {
        let ready = query(READY).bind(left.block.0).bind(crashes);
        return ready.execute(conn).await;
    }
    let (class, stage) = (FailureClass::Resource.name(), left.stage);
    let message = format!("{crashes} workers died or hung over it at {stage}");
    let row = query(BLOCK)
        .bind(left.block.0)
        .fetch_one(&mut *conn)
        .await?;
    let (attributes, inputs) = (BlockAttributes::from_row(&row)?, input_versions(&row)?);
    let points = control_points(&row)?;
    // The settings of the dead worker are unknown, so only changed inputs make this failure outdated.
    let failed_with = MadeWith::new(stage, &Value::Null, &attributes, &inputs, points.as_ref());
    query(POISONED)
        .bind(left.block.0)
        .bind(crashes)
        .bind(class)
        .bind(&message)
        .bind(now)
        .bind(serde_json::to_string(&failed_with)?)
        .execute(&mut *conn)
        .await?;
    let attempt = BlockAttempt {
        stage,
        failure: Some((class, &message)),
        ms: None,
        at: now,
    };
    checkpoint::add_attempt(conn, left.block, left.worker, &attempt).await
}
