//! Leases of block jobs: claims, releases, and what a leased block needs.

use crate::blocks::model::{BlockAttributes, BlockInputVersions, BlockLease, BlockWork};
use crate::blocks::records::{BLOCK, control_points, input_versions, stage_records};
use crate::blocks::selection::BlockSelection;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::{FromRow as _, from_row};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{BlockId, UnixMillis, WorkerId};
use mocban_system::failpoint::{self, Point};

/// Selects the lease that a worker holds already. A worker has at most one: another claim means that the reply to the
/// claim before was lost.
const HELD: &str = "
SELECT block, worker, token, stage, attempt FROM block_job WHERE worker = ?1 AND status = 1 ORDER BY block LIMIT 1";

/// Builds the text of a claim from a condition.
macro_rules! claim {
    ($condition:literal) => {
        concat!(
            "
UPDATE block_job SET status = 1, worker = ?1, deadline = ?2, token = token + 1, attempt = attempt + 1
WHERE block = (
        SELECT block FROM block_job
        WHERE status = 0 AND (?4 IS NULL OR block IN (SELECT CAST(atom AS bigint) FROM json_each(?4)))
        ORDER BY stage DESC, block LIMIT 1)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ?1 AND ended IS NULL AND heartbeat >= ?3)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND exclusive = 1)",
            $condition,
            "
RETURNING block, worker, token, stage, attempt"
        )
    };
}

/// Leases the most advanced ready block, of all or of those with the ids `?4`. No block starts while a pair must run
/// exclusively. In PostgreSQL, a worker whose settings are not those of the last plan gets nothing.
const CLAIM: Sql = Sql::pair(
    claim!(""),
    claim!(
        "
    AND coalesce((SELECT s.block_settings = me.block_settings FROM run_settings AS s, worker AS me WHERE me.id = ?1), true)"
    ),
);

/// Gives a lease back. Its attempt does not count.
const RELEASE: &str = "
UPDATE block_job SET status = 0, worker = NULL, deadline = NULL, attempt = max(attempt - 1, 0)
WHERE block = ?1 AND worker = ?2 AND token = ?3 AND status = 1 RETURNING block";

const DUE: &str = "
UPDATE block_job SET status = 0, run_at = NULL WHERE status = 2 AND (run_at <= ?1 OR run_at > ?2) RETURNING block";

const OUTSTANDING: &str = "
SELECT count(*) FILTER (WHERE status = 0) AS ready, count(*) FILTER (WHERE status = 1) AS leased,
    count(*) FILTER (WHERE status = 2) AS backoff, count(*) FILTER (WHERE status = 4) AS quarantined,
    min(run_at) AS next_due FROM block_job
WHERE ?1 IS NULL OR block IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";

/// Numbers of blocks that have a stage to run, and of blocks that failed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OutstandingBlocks {
    /// Blocks that are ready.
    pub ready: u64,
    /// Blocks leased by any worker.
    pub leased: u64,
    /// Blocks that back off.
    pub backoff: u64,
    /// Blocks that failed.
    pub quarantined: u64,
    /// Time at which the first back-off ends.
    pub next_due: Option<UnixMillis>,
}

from_row! { OutstandingBlocks { ready, leased, backoff, quarantined, next_due } }

impl OutstandingBlocks {
    /// Returns the number of blocks that have a stage to run.
    pub const fn left(&self) -> u64 {
        self.ready + self.leased + self.backoff
    }
}

impl Catalog {
    /// Leases one ready block, with the data that its stages need. If `among` is given, considers only its blocks.
    /// Returns `None` if no block is ready, or if the worker has ended or its last heartbeat is before `alive_since`.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn claim_block(
        &self,
        worker: WorkerId,
        deadline: UnixMillis,
        alive_since: UnixMillis,
        among: Option<&BlockSelection>,
    ) -> Result<Option<(BlockLease, BlockWork)>> {
        let among = among.map(BlockSelection::json);
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let held = query_as(HELD).bind(worker.0);
                let mut lease: Option<BlockLease> = held.fetch_optional(&mut *conn).await?;
                if lease.is_none() {
                    let claim = query_as(CLAIM).bind(worker.0).bind(deadline);
                    let claim = claim.bind(alive_since).bind(among);
                    lease = claim.fetch_optional(&mut *conn).await?;
                }
                let Some(lease) = lease else { return Ok(None) };
                failpoint::hit(lease.cursor, Point::Claiming, None);
                let work = work(conn, &lease).await?;
                Ok(Some((lease, work)))
            })
        })
        .await
    }

    /// Gives a lease back. Returns `false` if it was lost.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn release_block(&self, lease: BlockLease) -> Result<bool> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let release = query_scalar(RELEASE).bind(lease.block.0);
                let release = release.bind(lease.worker.0).bind(lease.token);
                let released: Option<BlockId> = release.fetch_optional(conn).await?;
                Ok(released.is_some())
            })
        })
        .await
    }

    /// Counts the blocks that are ready, leased or backing off, and the failed ones. If `among` is given, counts only
    /// its blocks.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn outstanding_blocks(
        &self,
        among: Option<&BlockSelection>,
    ) -> Result<OutstandingBlocks> {
        let mut conn = self.read_conn().await?;
        let counts = query_as(OUTSTANDING).bind(among.map(BlockSelection::json));
        counts.fetch_one(&mut conn).await
    }

    /// Ends the back-offs of blocks that are due, and returns the number of blocks made ready. Also ends back-offs with
    /// more than `longest` milliseconds left, which only a clock jump can cause.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn release_due_blocks(&self, now: UnixMillis, longest: i64) -> Result<u64> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let due = query_scalar(DUE).bind(now).bind(now + longest);
                let due: Vec<BlockId> = due.fetch_all(conn).await?;
                Ok(due.len() as u64)
            })
        })
        .await
    }
}

/// Reads the attributes, inputs and earlier results of a leased block.
async fn work(conn: &mut Conn, lease: &BlockLease) -> Result<BlockWork> {
    let row = query(BLOCK).bind(lease.block.0).fetch_optional(&mut *conn);
    let Some(row) = row.await? else {
        let text = format!("the block of job row {} is missing", lease.block.0);
        return Err(CatalogError::Corrupt(text));
    };
    let attributes = BlockAttributes::from_row(&row)?;
    let inputs: BlockInputVersions = input_versions(&row)?;
    let control_points = control_points(&row)?;
    let mut results = stage_records(conn, lease.block).await?;
    results.retain(|record| record.stage < lease.cursor);
    Ok(BlockWork {
        attributes,
        inputs,
        control_points,
        results,
    })
}
