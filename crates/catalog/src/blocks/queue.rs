//! The queue of blocks: claims with what a leased block needs, checkpoints, failures and releases. There are few blocks,
//! so each operation is a transaction of its own.

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
use crate::queue::claim::{ClaimRequest, add_claim, in_order, release_due};
use crate::queue::counters::Deltas;
use crate::queue::kind::StoredKind as _;
use crate::queue::lease::{
    CheckpointOutcome, FencedRow, LEASED, Lease, add_release, is_end_stored, leases, stored_before,
};
use crate::queue::stage_record::{StageCheckpoint, StageFailure};
use crate::queue::{checkpoint, fail, server_claim};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{BlockId, BlockStage, UnixMillis, WorkerId};

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
    /// Leases one ready block, with the data that its stages need. If `selection` is given, considers only its blocks.
    /// Returns `None` if no block is ready, or if the worker has ended or its last heartbeat is before `alive_since`. A
    /// worker has at most one block: it gets the same lease again if the reply to the claim before was lost.
    pub async fn claim_block(
        &self,
        worker: WorkerId,
        deadline: UnixMillis,
        alive_since: UnixMillis,
        selection: Option<&BlockSelection>,
    ) -> Result<Option<(Lease<BlockJob>, BlockWork)>> {
        let request = ClaimRequest {
            worker,
            slots: 1,
            until: BlockStage::Cut,
            exclusive: false,
            selection: selection.cloned(),
            deadline,
            alive_since,
        };
        in_transaction!(self, |conn| {
            let mut held = leases(conn, worker).await?;
            if held.is_empty() {
                held = claim(conn, &request).await?;
            }
            let Some(lease) = held.into_iter().next() else {
                return Ok(None);
            };
            let work = work(conn, &lease).await?;
            Ok(Some((lease, work)))
        })
    }

    /// Stores a finished stage and advances the job. Its artifacts must be on disk already. If the lease was lost, nothing
    /// is stored. A call again, because the reply was lost, returns the same and stores nothing more. The last
    /// stage is stored with [`Catalog::finish_cut`].
    pub async fn checkpoint_block(
        &self,
        lease: Lease<BlockJob>,
        stage: StageCheckpoint<BlockJob>,
    ) -> Result<CheckpointOutcome<BlockJob>> {
        // An earlier stage than that of the lease may have been computed again. If the job stays where it was, its position
        // does not show whether an earlier call stored it.
        let next = lease.after(&stage);
        let moves = next.as_ref().is_none_or(|next| next.cursor != lease.cursor);
        let item = (lease, vec![stage]);
        let stored = in_transaction!(self, |conn| {
            let is_stored = checkpoint::store(conn, &item, &mut uncounted()).await?;
            if is_stored || !moves {
                return Ok(is_stored);
            }
            let stored = stored_before(conn, [&item].into_iter(), [].into_iter()).await?;
            Ok(item.0.is_in(&stored))
        });
        Ok(match (stored?, next) {
            (false, _) => CheckpointOutcome::Refused,
            (true, Some(lease)) => CheckpointOutcome::Lease(lease),
            (true, None) => CheckpointOutcome::Done,
        })
    }

    /// Stores a failed stage of a block. Returns `false`, and stores nothing, if the lease was lost. A call again, because
    /// the reply was lost, stores nothing and returns `true`.
    pub async fn fail_block(
        &self,
        lease: Lease<BlockJob>,
        failed: StageFailure<BlockJob>,
    ) -> Result<bool> {
        let item = (lease, failed);
        in_transaction!(self, |conn| {
            let is_stored = fail::store(conn, &item, &mut uncounted()).await?;
            Ok(is_stored || is_end_stored(conn, &item.0).await?)
        })
    }

    /// Gives a lease back. Returns `false` if it was lost. A call again, because the reply was lost, returns `true`.
    pub async fn release_block(&self, lease: Lease<BlockJob>) -> Result<bool> {
        in_transaction!(self, |conn| {
            let mut script = Script::default();
            let statement = add_release(&mut script, [&lease].into_iter())?;
            let rows = script.run(conn).await?;
            let is_released = lease.is_in(&rows.read_if_any(statement.as_ref())?);
            Ok(is_released || is_end_stored(conn, &lease).await?)
        })
    }

    /// Stores versions of the input files of a leased block, and keeps the stored version of a file whose new version is
    /// `None`. Returns `false`, and stores nothing, if the lease was lost or the worker's last heartbeat is before
    /// `alive_since`.
    pub async fn store_leased_inputs(
        &self,
        lease: Lease<BlockJob>,
        seen: BlockInputVersions,
        alive_since: UnixMillis,
    ) -> Result<bool> {
        in_transaction!(self, |conn| {
            let leased = query_as(LEASED.of::<BlockJob>()).bind(lease.unit.0);
            let leased = leased.bind(lease.worker.0).bind(lease.token);
            let rows: Vec<FencedRow> = leased.bind(alive_since).fetch_all(&mut *conn).await?;
            if !lease.is_in(&rows) {
                return Ok(false);
            }
            let mut script = Script::default();
            BlockJob::add_inputs(&mut script, [(lease.unit, &seen)].into_iter())?;
            script.run(conn).await?;
            Ok(true)
        })
    }

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

async fn claim(conn: &mut Conn, request: &ClaimRequest<BlockJob>) -> Result<Vec<Lease<BlockJob>>> {
    if matches!(conn, Conn::Postgres(_)) {
        return server_claim::claim(conn, request, None).await;
    }
    let mut script = Script::default();
    let statement = add_claim(&mut script, request);
    let rows = script.run(conn).await?;
    Ok(in_order(rows.read(&statement)?))
}

/// Reads the attributes, inputs and earlier results of a leased block.
async fn work(conn: &mut Conn, lease: &Lease<BlockJob>) -> Result<BlockWork> {
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
