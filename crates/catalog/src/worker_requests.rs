//! What a worker asks of the catalog, for pairs and blocks: its registration, heartbeats, claims, checkpoints, failures,
//! releases and its end. The requests for pairs share commits. There are few blocks, so each of their requests is a
//! transaction of its own. After a lost reply, such a request may be sent again.

use crate::blocks::block_job::BlockJob;
use crate::blocks::cut::{CutReply, CutSummary, store_cut, taken_name};
use crate::blocks::model::{BlockInputVersions, BlockWork, NewCharacter};
use crate::blocks::queue::{uncounted, work};
use crate::blocks::selection::BlockSelection;
use crate::db::conn::Conn;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::script::Script;
use crate::db::transaction::in_transaction;
use crate::jobs::workers::{WorkerInfo, WorkerSettings};
use crate::queue::checkpoint::{self, LeasedFailure};
use crate::queue::claim::{ClaimRequest, add_claim, claim_on_server, in_order};
use crate::queue::commit::group_commit::{Reply, Request};
use crate::queue::commit::writer::{Message, Waiting};
use crate::queue::kind::StoredKind as _;
use crate::queue::lease::{
    CheckpointOutcome, FencedRow, Heartbeat, LEASED, Lease, LeasedCheckpoints, add_release,
    is_end_stored, is_late, leases, stored_before,
};
use crate::queue::stage_record::{StageCheckpoint, StageFailure};
use crate::records::similar_names;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{BlockStage, UnixMillis, WorkerId, WorkerMetrics};

impl Catalog {
    /// Registers a worker process with its settings. Returns an id that no worker had before.
    pub async fn register_worker(
        &self,
        info: WorkerInfo,
        settings: WorkerSettings,
        now: UnixMillis,
    ) -> Result<WorkerId> {
        self.in_transaction(move |conn| Box::pin(insert_worker(conn, info, settings, now)))
            .await
    }

    /// Records that a worker ended properly, and with which metrics. Without metrics, the worker is not listed any more.
    pub async fn end_worker(
        &self,
        worker: WorkerId,
        now: UnixMillis,
        metrics: Option<&WorkerMetrics>,
    ) -> Result<()> {
        let metrics = metrics.map(serde_json::to_string).transpose()?;
        in_transaction!(self, |conn| {
            query("UPDATE worker SET ended = ?2, metrics = ?3 WHERE id = ?1")
                .bind(worker.0)
                .bind(now)
                .bind(metrics)
                .execute(conn)
                .await?;
            Ok(())
        })
    }

    /// Leases up to `slots` ready pairs, or none if the worker has ended or its heartbeat is before `alive_since`. May also
    /// return leases of an earlier claim whose reply was lost.
    ///
    /// # Errors
    /// Returns an error if a database operation fails. On a server, pairs may be leased nevertheless. The worker's
    /// claims of the next two minutes return them.
    pub async fn claim(&self, request: ClaimRequest) -> Result<Vec<Lease>> {
        self.grouped(|reply| Request::Claim(request, reply)).await
    }

    /// Gives a lease back. The attempt does not count. Returns `false` if the lease was already lost.
    pub async fn release(&self, lease: Lease) -> Result<bool> {
        self.grouped(|reply| Request::Release(lease, reply)).await
    }

    /// Keeps the lock of this process's worker on a server, also over a new connection if the old one is broken. Must be
    /// called every few seconds. Does nothing if the catalog is a file.
    pub async fn keep_worker_lock(&self, worker: WorkerId) -> Result<()> {
        if !self.is_shared() {
            return Ok(());
        }
        self.reply_to(|reply| {
            Message::Transaction(Box::new(move |writer| {
                Box::pin(async move {
                    let _ = reply.send(writer.keep_worker_lock(worker).await);
                })
            }))
        })
        .await
    }

    /// Stores a worker's heartbeat, and its metrics if given. Returns `false`, and stores nothing, if the worker has ended
    /// or its previous heartbeat is older than `alive_since`. In that case the worker's leases are void, and it must
    /// register again.
    pub async fn heartbeat(
        &self,
        worker: WorkerId,
        now: UnixMillis,
        alive_since: UnixMillis,
        metrics: Option<&WorkerMetrics>,
    ) -> Result<bool> {
        let heartbeat = Heartbeat {
            worker,
            now,
            alive_since,
            metrics: metrics.map(serde_json::to_string).transpose()?,
        };
        self.grouped(|reply| Request::Heartbeat(heartbeat, reply))
            .await
    }

    /// Stores finished stages and advances the job, both or neither. The stages must be in the order they were
    /// computed, and their artifacts must be on disk already. The commit may be delayed so that later requests can
    /// share it. Call [`Catalog::waiting`] to turn the delay off.
    ///
    /// # Errors
    /// Returns an error if a score is not a finite number, or if a database operation fails. In that case nothing is stored,
    /// unless a server stored it and the reply was lost. The lease remains until it is recovered.
    pub async fn checkpoint(
        &self,
        lease: Lease,
        stages: Vec<StageCheckpoint>,
    ) -> Result<CheckpointOutcome> {
        let Some(last) = stages.last() else {
            return Ok(CheckpointOutcome::Lease(lease));
        };
        let mut metrics = stages.iter().flat_map(|stage| &stage.metrics);
        if let Some(invalid) = metrics.find(|metric| !metric.is_finite()) {
            let metric = invalid.outcome.metric;
            let text = format!("a score of {metric} is not a finite number");
            return Err(CatalogError::Corrupt(text));
        }
        let advanced = lease.after(last);
        let item = Box::new((lease, stages));
        let stored = self
            .reply_to(|reply| Message::Deferrable(Request::Checkpoint(item, reply)))
            .await?;
        Ok(CheckpointOutcome::of(stored, advanced))
    }

    /// Stores a failed stage. Returns `false`, and stores nothing, if the lease was lost.
    pub async fn fail(&self, lease: Lease, failure: StageFailure) -> Result<bool> {
        self.grouped(|reply| Request::Fail(Box::new((lease, failure)), reply))
            .await
    }

    /// Commits all pending requests at once. Prevents delays of later commits until the returned value is dropped.
    ///
    /// # Errors
    /// Returns an error if the catalog is closed or read-only.
    pub async fn waiting(&self) -> Result<Waiting> {
        let waiting = Waiting::new(&self.delay);
        self.send(Message::Flush).await?;
        Ok(waiting)
    }

    /// Sends a request into the next group commit and waits for the reply.
    async fn grouped<T>(&self, request: impl FnOnce(Reply<T>) -> Request) -> Result<T> {
        self.reply_to(|reply| Message::Grouped(request(reply)))
            .await
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
    /// is stored. A call again, because the reply was lost, returns the same and stores nothing more, unless an earlier stage
    /// was computed again: then the attempt is recorded twice. The last stage is stored with [`Catalog::finish_cut`].
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
            let is_stored = store_checkpoint(conn, &item).await?;
            if is_stored || !moves {
                return Ok(is_stored);
            }
            let stored = stored_before(conn, [&item].into_iter(), [].into_iter()).await?;
            Ok(item.0.is_in(&stored))
        });
        Ok(CheckpointOutcome::of(stored?, next))
    }

    /// Stores the stage `cut`: its result, the characters, and a pair for each character that was cut. All files must
    /// be on disk already. A pair whose files and attributes are the same stays as it is, a changed one runs again from
    /// the first stage, and one whose box is gone is retired. Verdicts stay in all cases.
    ///
    /// # Errors
    /// Returns an error if the name of a pair is invalid, or if a database operation fails.
    pub async fn finish_cut(
        &self,
        lease: Lease<BlockJob>,
        stage: StageCheckpoint<BlockJob>,
        characters: Vec<NewCharacter>,
    ) -> Result<CutReply> {
        let done = (lease, vec![stage]);
        // Other writers need not wait while the names of all pairs are read. Ids grow, and no pair is renamed, so the
        // transaction reads only newer pairs.
        let mut conn = self.read_conn().await?;
        let last = similar_names::last_pair(&mut conn).await?;
        let taken = taken_name(&mut conn, done.0.unit, &characters, 0).await?;
        drop(conn);
        if let Some(taken) = taken {
            return Ok(CutReply::NameTaken(taken));
        }
        in_transaction!(self, |conn| {
            store_last(conn, &done, &characters, last).await
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
            let is_stored = store_failure(conn, &item).await?;
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
}

async fn claim(conn: &mut Conn, request: &ClaimRequest<BlockJob>) -> Result<Vec<Lease<BlockJob>>> {
    if matches!(conn, Conn::Postgres(_)) {
        return claim_on_server(conn, request, None).await;
    }
    let mut script = Script::default();
    let statement = add_claim(&mut script, request);
    let rows = script.run(conn).await?;
    Ok(in_order(rows.read(&statement)?))
}

/// Stores a finished stage of a block. Returns `false`, and stores nothing, if the lease was lost, or if the files of the
/// stage may have been removed as unreferenced.
async fn store_checkpoint(conn: &mut Conn, done: &LeasedCheckpoints<BlockJob>) -> Result<bool> {
    if is_late(done) {
        return Ok(false);
    }
    let mut script = Script::default();
    let statement = checkpoint::add_advance(&mut script, [done].into_iter())?;
    let advanced = script.run(conn).await?.read_if_any(statement.as_ref())?;
    if !done.0.is_in(&advanced) {
        return Ok(false);
    }
    let mut script = Script::default();
    checkpoint::add_results(&mut script, &[done], &mut uncounted())?;
    script.run(conn).await?;
    Ok(true)
}

/// Stores the last stage of a block with its characters and pairs.
async fn store_last(
    conn: &mut Conn,
    done: &LeasedCheckpoints<BlockJob>,
    found: &[NewCharacter],
    last: i64,
) -> Result<CutReply> {
    let (lease, stages) = done;
    let at = stages.last().map_or(0, |last| last.at);
    if let Some(taken) = taken_name(conn, lease.unit, found, last).await? {
        return Ok(CutReply::NameTaken(taken));
    }
    if !store_checkpoint(conn, done).await? {
        let stored = stored_before(conn, [done].into_iter(), [].into_iter()).await?;
        return Ok(if lease.is_in(&stored) {
            CutReply::Stored(CutSummary::default())
        } else {
            CutReply::Refused
        });
    }
    let summary = store_cut(conn, lease.unit, found, at).await?;
    Ok(CutReply::Stored(summary))
}

/// Stores a failed stage of a block. Returns `false`, and stores nothing, if the lease was lost.
async fn store_failure(conn: &mut Conn, failed: &LeasedFailure<BlockJob>) -> Result<bool> {
    let mut script = Script::default();
    let statement = checkpoint::add_failures(&mut script, [failed].into_iter())?;
    let rows = script.run(conn).await?.read_if_any(statement.as_ref())?;
    let Some(row) = checkpoint::failed_row(&failed.0, &rows) else {
        return Ok(false);
    };
    let mut script = Script::default();
    checkpoint::add_failure_records(&mut script, &[(failed, row)], &mut uncounted())?;
    script.run(conn).await?;
    Ok(true)
}

async fn insert_worker(
    conn: &mut Conn,
    info: WorkerInfo,
    settings: WorkerSettings,
    now: UnixMillis,
) -> Result<WorkerId> {
    let id: i64 = query_scalar(
        "INSERT INTO worker (host, pid, boot_id, started, heartbeat, fingerprints, block_settings)
        VALUES (?1, ?2, ?3, ?4, ?4, ?5, ?6) RETURNING id",
    )
    .bind(info.host)
    .bind(info.pid)
    .bind(info.boot_id)
    .bind(now)
    .bind(settings.fingerprints.json())
    .bind(settings.blocks.json())
    .fetch_one(conn)
    .await?;
    Ok(WorkerId(id))
}
