//! Commits requests in PostgreSQL, and what this process remembers: the leases that it has received, and the lock of its
//! worker. Checkpoints, and each claim, are one statement that commits by itself; the rarer requests share a
//! transaction.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::query_scalar;
use crate::db::retry_wait::RetryWait;
use crate::queue::claim::{ClaimRequest, claim_on_server};
use crate::queue::claim_tracker::ClaimTracker;
use crate::queue::commit::group_commit::{Batch, BatchReply};
use crate::queue::counters::{self, cursor};
use crate::queue::lease::{
    Lease, LeasedCheckpoints, is_late, leases, position_after, stored_before,
};
use crate::queue::pair_job::PairJob;
use crate::queue::server_checkpoint;
use mocban_core::domain::{JobStatus, PairId, WorkerId};

/// What this process remembers of its requests to a server.
#[derive(Debug, Default)]
pub(crate) struct CatalogServerState {
    pub(crate) leases: KnownLeases,
    pub(crate) claim_tracker: ClaimTracker,
    /// Whether the counters of all earlier slots were added up over this connection.
    pub(crate) has_folded_all: bool,
    pub(crate) worker_lock: WorkerLock,
    pub(crate) retry_wait: Arc<RetryWait>,
}

/// Commits a batch of [`Batch::split_for_server`]. An earlier commit of the same batch may have been stored although its
/// reply was lost.
///
/// # Errors
/// Returns an error if a database operation fails. A part of the batch may be stored nevertheless.
pub(crate) async fn commit(
    batch: &Batch,
    conn: &mut Conn,
    state: &mut CatalogServerState,
) -> Result<BatchReply> {
    let outcome = commit_parts(batch, conn, state).await;
    // The leases may exist although the claim failed.
    if outcome.is_err() && !batch.claims.is_empty() {
        state.leases.replies_may_be_lost();
    }
    outcome
}

async fn commit_parts(
    batch: &Batch,
    conn: &mut Conn,
    state: &mut CatalogServerState,
) -> Result<BatchReply> {
    let mut reply = BatchReply::default();
    if batch.has_shared_transaction() {
        reply = batch.apply(conn, state.leases.is_searching()).await?;
        if !batch.heartbeats.is_empty() {
            state.claim_tracker.begin_again();
            // The reply does not depend on it. A broken connection shows at the next statement.
            match counters::fold(conn, !state.has_folded_all).await {
                Ok(()) => state.has_folded_all = true,
                Err(error) => tracing::debug!(%error, "counters are added up later"),
            }
        }
        let failed = || batch.failures.items().map(|item| &item.0);
        for lease in batch.releases.items().chain(failed()) {
            state.leases.remove(lease);
        }
        for lease in batch.releases.items() {
            state.claim_tracker.note_release(lease);
        }
        note_exclusive(failed(), state);
    }
    if !batch.checkpoints.is_empty() {
        let checkpoints: Vec<_> = batch.checkpoints.items().map(|item| &**item).collect();
        reply.checkpoints = store(conn, &checkpoints, state).await?;
    }
    for request in batch.claims.items() {
        reply.claims.push(claim(conn, request, state).await?);
    }
    Ok(reply)
}

/// Returns whether stages that were computed again end where their lease began. The position of the job then does not show
/// whether they are stored.
fn ends_at_its_start((lease, stages): &LeasedCheckpoints) -> bool {
    position_after(stages).is_some_and(|(end, _)| end == cursor(lease.cursor))
}

/// Stores checkpoints. Returns for each whether it is stored.
async fn store(
    conn: &mut Conn,
    checkpoints: &[&LeasedCheckpoints],
    state: &mut CatalogServerState,
) -> Result<Vec<bool>> {
    let Conn::Postgres(server) = conn else {
        unreachable!("a server is PostgreSQL");
    };
    let (late, timely): (Vec<&LeasedCheckpoints>, Vec<_>) =
        checkpoints.iter().partition(|item| is_late(item));
    let stored = server_checkpoint::store(server, &timely).await?;
    if !late.is_empty() {
        // The next claim gets these leases back, and computes the stages again.
        state.leases.replies_may_be_lost();
    }
    let mut earlier = Vec::new();
    // Otherwise, a refused checkpoint of an earlier stage, computed again, would look as if it were stored.
    if state.leases.is_searching() {
        let refused = timely.iter().filter(|(lease, _)| !lease.is_in(&stored));
        let late = late.iter().filter(|item| !ends_at_its_start(item));
        earlier = stored_before(conn, refused.chain(late).copied(), [].into_iter()).await?;
    }
    let is_kept = |lease: &Lease| lease.is_in(&stored) || lease.is_in(&earlier);
    let kept: Vec<bool> = checkpoints
        .iter()
        .map(|(lease, _)| is_kept(lease))
        .collect();
    for ((lease, stages), kept) in checkpoints.iter().zip(&kept) {
        let is_done = position_after(stages).is_some_and(|(_, status)| status == JobStatus::Done);
        if is_done || !kept {
            state.leases.remove(lease);
        }
    }
    note_exclusive(checkpoints.iter().map(|(lease, _)| lease), state);
    Ok(kept)
}

/// Leases pairs. Also returns leases of the worker that an earlier claim received without a reply.
async fn claim(
    conn: &mut Conn,
    request: &ClaimRequest,
    state: &mut CatalogServerState,
) -> Result<Vec<Lease>> {
    // Before the claim, because nothing may fail between its commit and its reply.
    let unknown = state.leases.unknown(conn, request.worker).await?;
    let began = Instant::now();
    let start = state.claim_tracker.of(request, began);
    let mut claimed = claim_on_server(conn, request, start).await?;
    let times = [began, Instant::now()];
    state.claim_tracker.note(request, start, &claimed, times);
    claimed.extend(without_pairs_of(unknown, &claimed));
    state.leases.add(&claimed);
    Ok(claimed)
}

/// Returns leases without those of a pair that was leased again meanwhile.
fn without_pairs_of(mut leases: Vec<Lease>, later: &[Lease]) -> Vec<Lease> {
    leases.retain(|lease| later.iter().all(|other| other.unit != lease.unit));
    leases
}

/// Lets claims search from the beginning after an exclusive lease, which prevented claims.
fn note_exclusive<'l>(leases: impl Iterator<Item = &'l Lease>, state: &mut CatalogServerState) {
    for lease in leases.filter(|lease| lease.exclusive) {
        state.claim_tracker.note_release(lease);
    }
}

/// Time after a reconnection or a failed claim during which unknown leases are searched for. A server may execute a commit
/// of the broken connection until it notices that the connection is broken.
const SEARCH_TIME: Duration = Duration::from_mins(2);

/// Leases that this process has received from a server: their tokens by pair. The reply to a claim can be lost after its
/// commit. Then the catalog contains leases that this process has not received, and its heartbeats keep them valid.
#[derive(Debug, Default)]
pub(crate) struct KnownLeases {
    tokens: BTreeMap<PairId, i64>,
    search_until: Option<Instant>,
}

impl KnownLeases {
    /// Records that replies may have been lost.
    pub(crate) fn replies_may_be_lost(&mut self) {
        self.search_until = Some(Instant::now() + SEARCH_TIME);
    }

    /// Returns whether an earlier commit may have been stored although its reply was lost.
    fn is_searching(&self) -> bool {
        self.search_until
            .is_some_and(|until| Instant::now() <= until)
    }

    /// Adds leases that a claim returned.
    fn add(&mut self, leases: &[Lease]) {
        let tokens = leases.iter().map(|lease| (lease.unit, lease.token));
        self.tokens.extend(tokens);
    }

    /// Removes a lease that has ended. A later lease of the same pair stays.
    fn remove(&mut self, lease: &Lease) {
        if self.tokens.get(&lease.unit) == Some(&lease.token) {
            self.tokens.remove(&lease.unit);
        }
    }

    /// Returns the leases of a worker that this process has not received. Queries the server only for `SEARCH_TIME` after
    /// a reconnection or a failed claim.
    async fn unknown(&self, conn: &mut Conn, worker: WorkerId) -> Result<Vec<Lease>> {
        if !self.is_searching() {
            return Ok(Vec::new());
        }
        let mut leases = leases::<PairJob>(conn, worker).await?;
        leases.retain(|lease| self.tokens.get(&lease.unit) != Some(&lease.token));
        Ok(leases)
    }
}

/// Takes the lock of a worker until the end of the session. Returns `false` if another session holds it, such as a broken
/// connection of the same worker. `WORKER_LOCKS` in `lease_recovery.rs` has the same key.
const TRY_LOCK: &str = "
SELECT pg_try_advisory_lock(hashtext(current_setting('search_path')), CAST(?1 % 2147483648 AS integer))";

/// The lock of a worker, as far as its connection knows. It shows others that the worker is connected, and the server releases
/// it when the process dies. A lock that is free is only a hint: a connection may break while its worker lives.
#[derive(Debug, Default)]
pub(crate) struct WorkerLock {
    worker: Option<WorkerId>,
    is_held: bool,
}

impl WorkerLock {
    /// Sets the worker whose lock is taken from now on.
    pub(crate) fn set_worker(&mut self, worker: WorkerId) {
        if self.worker != Some(worker) {
            *self = Self {
                worker: Some(worker),
                is_held: false,
            };
        }
    }

    /// Records that the session has ended.
    pub(crate) const fn session_ended(&mut self) {
        self.is_held = false;
    }

    /// Takes the lock if it is not held. Otherwise, only finds out whether the connection works.
    pub(crate) async fn take(&mut self, conn: &mut Conn) -> Result<()> {
        let Some(worker) = self.worker else {
            return Ok(());
        };
        if self.is_held {
            let _: i64 = query_scalar("SELECT CAST(1 AS bigint)")
                .fetch_one(conn)
                .await?;
        } else {
            self.is_held = query_scalar(TRY_LOCK)
                .bind(worker.0)
                .fetch_one(conn)
                .await?;
        }
        Ok(())
    }
}
