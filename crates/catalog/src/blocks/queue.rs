//! The jobs of blocks: what a leased block needs, counts of the work that is left, back-offs and retries. Claims and what is
//! stored under a lease are in `worker_requests.rs`.

use crate::blocks::block_job::BlockJob;
use crate::blocks::model::{BlockAttributes, BlockInputVersions, BlockWork};
use crate::blocks::records::{BLOCK, control_points, stage_records};
use crate::blocks::selection::BlockSelection;
use crate::db::conn::Conn;
use crate::db::query::{query, query_as};
use crate::db::row::{FromRow as _, from_row};
use crate::db::script::Script;
use crate::db::transaction::in_transaction;
use crate::jobs::requeue::{RetrySelection, retry, retry_pairs};
use crate::queue::claim::release_due;
use crate::queue::counters::Deltas;
use crate::queue::kind::StoredKind as _;
use crate::queue::lease::Lease;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{BlockId, UnixMillis};

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
    /// Stores versions of the input files of blocks that no worker has leased. Keeps the stored version of a file whose new version is `None`.
    pub async fn store_block_inputs(&self, seen: Vec<(BlockId, BlockInputVersions)>) -> Result<()> {
        in_transaction!(self, |conn| {
            let mut script = Script::default();
            BlockJob::add_inputs(&mut script, seen.iter().map(|(id, seen)| (*id, seen)))?;
            script.run(conn).await?;
            Ok(())
        })
    }

    /// Counts the blocks that are ready, leased or backing off, and the failed ones. If `selection` is given, counts only
    /// its blocks.
    pub async fn outstanding_blocks(
        &self,
        selection: Option<&BlockSelection>,
    ) -> Result<OutstandingBlocks> {
        let mut conn = self.read_conn().await?;
        let counts = query_as(OUTSTANDING).bind(selection.map(BlockSelection::json));
        counts.fetch_one(&mut conn).await
    }

    /// Ends the back-offs of blocks that are due, and returns the number of blocks made ready. Also ends back-offs with
    /// more than `longest` milliseconds left, which only a clock jump can cause.
    pub async fn release_due_blocks(&self, now: UnixMillis, longest: i64) -> Result<u64> {
        in_transaction!(self, |conn| {
            release_due::<BlockJob>(conn, now, longest, &mut uncounted()).await
        })
    }

    /// Makes failed pairs and blocks ready in one transaction, and returns the number of each. Unknown names of blocks
    /// are ignored.
    ///
    /// # Errors
    /// Returns an error if a named pair does not exist, or if a database operation fails. In that case nothing changes.
    pub async fn retry_pairs_and_blocks(
        &self,
        pairs: &RetrySelection,
        blocks: &RetrySelection<BlockJob>,
    ) -> Result<[u64; 2]> {
        let (pairs, blocks) = (pairs.clone(), blocks.clone());
        in_transaction!(self, |conn| {
            let retried = retry_pairs(conn, &pairs).await?;
            Ok([retried, retry(conn, &blocks, &mut uncounted()).await?])
        })
    }
}

/// Returns changes of counters to drop, because the jobs of blocks are not counted.
pub(crate) fn uncounted() -> Deltas {
    Deltas::default()
}

/// Reads the attributes, inputs and earlier results of a leased block.
pub(crate) async fn work(conn: &mut Conn, lease: &Lease<BlockJob>) -> Result<BlockWork> {
    let row = query(BLOCK).bind(lease.unit.0).fetch_optional(&mut *conn);
    let Some(row) = row.await? else {
        let text = format!("the block of job row {} is missing", lease.unit.0);
        return Err(CatalogError::Corrupt(text));
    };
    let attributes = BlockAttributes::from_row(&row)?;
    let inputs: BlockInputVersions = BlockInputVersions::from_row(&row)?;
    let control_points = control_points(&row)?;
    let mut results = stage_records(conn, lease.unit).await?;
    results.retain(|record| record.stage < lease.cursor);
    Ok(BlockWork {
        attributes,
        inputs,
        control_points,
        results,
    })
}
