//! Stores a failed stage of a block if the lease is still valid, and lets failed blocks run again.

use crate::blocks::checkpoint::{self, BlockAttempt, fenced};
use crate::blocks::model::{BlockFailure, BlockFailureAction, BlockLease};
use crate::db::conn::Conn;
use crate::db::query::query_scalar;
use crate::queue::requeue::{RetrySelection, retry_pairs};
use crate::{Catalog, Result};
use mocban_core::domain::{BlockId, BlockName, FailureClass, JobStatus};
use mocban_system::failpoint::{self, Point};

const FAIL: &str = concat!(
    "
UPDATE block_job SET stage = min(stage, ?5), status = ?6, run_at = ?7, worker = NULL, deadline = NULL,
    class = ?8, message = ?9, failed_stage = ?5, failed_at = ?10, failed_with = ?11
WHERE ",
    fenced!(),
    " RETURNING block"
);

/// Makes failed blocks ready at their stage. Without `?1`, all; otherwise those with these names.
const RETRY: &str = "
UPDATE block_job SET status = 0, run_at = NULL, attempt = 0, crashes = 0, class = NULL, message = NULL, failed_stage = NULL,
    failed_at = NULL, failed_with = NULL
WHERE status IN (2, 4) AND (?2 IS NULL OR class = ?2) AND (?1 IS NULL OR block IN (
    SELECT id FROM block WHERE name IN (SELECT atom FROM json_each(?1)))) RETURNING block";

/// Which failed blocks to run again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BlockRetry {
    /// These blocks, if they failed or back off.
    Names(Vec<BlockName>),
    /// All blocks that failed or back off with this class.
    Class(FailureClass),
    /// All blocks that failed or back off.
    All,
}

impl Catalog {
    /// Stores a failed stage of a block. Returns `false`, and stores nothing, if the lease was lost.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn fail_block(&self, lease: BlockLease, failed: BlockFailure) -> Result<bool> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let (status, run_at) = match failed.action {
                    BlockFailureAction::BackOff { run_at } => (JobStatus::Backoff, Some(run_at)),
                    BlockFailureAction::Quarantine => (JobStatus::Quarantined, None),
                };
                let changed: Option<BlockId> = query_scalar(FAIL)
                    .bind(lease.block.0)
                    .bind(lease.worker.0)
                    .bind(lease.token)
                    .bind(failed.alive_since)
                    .bind(failed.stage.index() as i64)
                    .bind(status.code())
                    .bind(run_at)
                    .bind(failed.failure.class.name())
                    .bind(&failed.failure.message)
                    .bind(failed.at)
                    .bind(serde_json::to_string(&failed.made_with)?)
                    .fetch_optional(&mut *conn)
                    .await?;
                if changed.is_none() {
                    return Ok(false);
                }
                let class = failed.failure.class.name();
                let attempt = BlockAttempt {
                    stage: failed.stage,
                    failure: Some((class, &failed.failure.message)),
                    ms: failed.ms,
                    at: failed.at,
                };
                checkpoint::add_attempt(conn, lease.block, lease.worker, &attempt).await?;
                checkpoint::update_inputs(conn, lease.block, &failed.inputs).await?;
                failpoint::hit(failed.stage, Point::Recorded, None);
                Ok(true)
            })
        })
        .await
    }

    /// Makes failed pairs and blocks ready in one transaction, and returns the number of each. Unknown names of blocks
    /// are ignored.
    ///
    /// # Errors
    /// Returns an error if a named pair does not exist, or if a database operation fails. In that case nothing changes.
    pub async fn retry_pairs_and_blocks(
        &self,
        pairs: &RetrySelection,
        blocks: &BlockRetry,
    ) -> Result<[u64; 2]> {
        let (pairs, blocks) = (pairs.clone(), blocks.clone());
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let retried = retry_pairs(conn, &pairs).await?;
                Ok([retried, retry_blocks(conn, &blocks).await?])
            })
        })
        .await
    }
}

/// Makes failed blocks ready, and returns their number.
async fn retry_blocks(conn: &mut Conn, selection: &BlockRetry) -> Result<u64> {
    let (names, class) = match selection {
        BlockRetry::All => (None, None),
        BlockRetry::Class(class) => (None, Some(class.name())),
        BlockRetry::Names(names) => {
            let names: Vec<&str> = names.iter().map(BlockName::as_str).collect();
            (Some(serde_json::to_string(&names)?), None)
        }
    };
    let retried = query_scalar(RETRY).bind(names).bind(class);
    let retried: Vec<BlockId> = retried.fetch_all(conn).await?;
    Ok(retried.len() as u64)
}
